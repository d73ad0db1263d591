"""GA019: required extensions that are not supported here."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule

KNOWN_REQUIRED = frozenset(
    """
    EXT_mesh_gpu_instancing EXT_meshopt_compression EXT_texture_webp KHR_animation_pointer KHR_draco_mesh_compression
    KHR_lights_punctual KHR_materials_unlit KHR_mesh_quantization KHR_meshopt_compression KHR_node_visibility
    KHR_texture_basisu KHR_texture_transform
    """.split()  # noqa: SIM905 (one name per line would hide the words)
)


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the extensions."""
    for name in file.json.get("extensionsRequired", ()):
        if name not in KNOWN_REQUIRED:
            problem = f"{name} is required but not supported here"
            yield Occurrence("extensionsRequired", "/extensionsRequired", problem=problem, name=name)


RULE = Rule(
    "GA019",
    "unknown-extension",
    Severity.WARNING,
    "The file requires an extension that is not supported here.",
    "Errors are measured without it, so that they may not be what players show.",
    find,
    advice="it stays unchanged; check the result in a viewer that supports it",
)
