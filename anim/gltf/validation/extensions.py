"""Extensions that a file may require, and that are supported or without effect here."""

from __future__ import annotations

from anim.gltf.document import Json

KNOWN_REQUIRED = frozenset(
    """
    EXT_mesh_gpu_instancing EXT_meshopt_compression EXT_texture_webp KHR_animation_pointer KHR_draco_mesh_compression
    KHR_lights_punctual KHR_materials_unlit KHR_mesh_quantization KHR_meshopt_compression KHR_node_visibility
    KHR_texture_basisu KHR_texture_transform
    """.split()  # noqa: SIM905 (one name per line would hide the words)
)
# Bodies, which `simulate rigid` moves; for all other commands they stay where the clips put them.
PHYSICS = frozenset(
    """
    KHR_collision_shapes KHR_implicit_shapes KHR_physics_rigid_bodies OMI_physics_body OMI_physics_shape
    """.split()  # noqa: SIM905
)


def unknown_required(json: Json) -> list[str]:
    """Return the names of required extensions that are not supported."""
    return [name for name in json.get("extensionsRequired", ()) if name not in KNOWN_REQUIRED]
