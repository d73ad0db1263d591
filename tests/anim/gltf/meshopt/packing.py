"""What tests of packing share: clips whose values went through meshopt's filters, and what another decoder finds."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import meshopt
import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.document import Document, Json
from anim.gltf.meshopt import storage
from anim.gltf.meshopt.storage import EncodedTrack, FilteredValues, attach_codes
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import FLOAT32, AccessorFormat, Clip, Interpolation, Track
from tests import judge
from tests.files import glb_of

EXTENSIONS = ("EXT_meshopt_compression", "KHR_meshopt_compression")
INT16 = AccessorFormat(5122, normalized=True)
ROOT = Path(__file__).resolve().parents[4]
ACCESSORS = ROOT / "tests" / "threejs" / "accessors.mjs"


def quaternions(track: Track, bits: int = 12) -> EncodedTrack:
    """Return a rotation as the quaternion filter keeps it, with the filter's codes."""
    unit = track.values / np.linalg.norm(track.values, axis=1, keepdims=True)
    filtered = FilteredValues("QUATERNION", meshopt.encode_filter_quat(unit.astype(np.float32), 8, bits).tobytes())
    return attach_codes(replace(track, values=storage.decompress_document(filtered, 4), storage=INT16), filtered)


def exponents(track: Track, power: int = -12) -> EncodedTrack:
    """Return a track in multiples of 2 ** power, tangents too, with the exponential filter's codes of it."""
    parts = [part for part in (track.in_tangents, track.values, track.out_tangents) if part is not None]
    whole = [np.rint(part * 2.0**-power) for part in parts]
    filtered = FilteredValues("EXPONENTIAL", exponent_codes(np.stack(whole, axis=1), power))
    kept = [each * 2.0**power for each in whole]
    if len(kept) == 1:
        return attach_codes(replace(track, values=kept[0], storage=FLOAT32), filtered)
    made = track.with_keys(track.time_axis, kept[1], kept[0], kept[2])
    return attach_codes(replace(made, storage=FLOAT32), filtered)


def exponent_codes(mantissa: Floats, power: int) -> bytes:
    """Return the codes of whole numbers of 24 bits under one power of two."""
    return ((mantissa.astype(np.int64) & 0xFFFFFF) | ((power & 255) << 24)).astype("<u4").tobytes()


def filtered_clips(clips: Sequence[Clip]) -> dict[int, Clip]:
    """Return all clips by number with rotations and vectors as the filters keep them."""
    new = {}
    for number, clip in enumerate(clips):
        tracks = []
        for track in clip.tracks:
            spline = track.interpolation is Interpolation.CUBICSPLINE
            tracks.append(quaternions(track) if track.path == "rotation" and not spline else exponents(track))
        new[number] = Clip(clip.name, tuple(tracks))
    return new


def packed(document: Document, extension: str) -> tuple[dict[int, Clip], Document]:
    """Return the clips of a document as filters keep them, and the document with those."""
    clips = filtered_clips(reader.clips(document))
    return clips, writer.replace_clips(document, clips, extension=extension)


def streams(document: Document, extension: str) -> list[Json]:
    """Return the extension's objects of all views that are compressed under it."""
    views = document.json.get("bufferViews", [])
    return [view["extensions"][extension] for view in views if extension in view.get("extensions", {})]


def found_by_three(document: Document, folder: Path) -> dict[int, Floats]:
    """Return the numbers of each accessor that animations use as three.js decodes them. folder: for a file."""
    path = folder / "seen.glb"
    path.write_bytes(glb_of(document))
    command = ["node", str(ACCESSORS), str(judge.package()), str(path)]
    run = subprocess.run(command, capture_output=True, check=True, timeout=judge.TIMEOUT)
    return {int(number): np.array(values, np.float64) for number, values in json.loads(run.stdout).items()}


def gltfpack(source: Path, folder: Path, *options: str) -> Path:
    """Return what gltfpack makes of a file, in `folder`; skips the test where it is absent."""
    given = [os.environ.get(name) for name in ("GLTF_PEERS_DIR", "GLTF_VALIDATOR_DIR")]
    places = [*(Path(each) / ".bin" for each in given if each), *(Path(each) for each in given if each)]
    places.append(ROOT / "node_modules" / ".bin")
    tool = next(
        (str(place / "gltfpack") for place in places if (place / "gltfpack").is_file()), shutil.which("gltfpack")
    )
    if tool is None or shutil.which("node") is None:
        pytest.skip("gltfpack is not installed (npm install gltfpack, or set GLTF_PEERS_DIR)")
    output = folder / "packed.glb"
    subprocess.run([tool, "-i", str(source), "-o", str(output), *options], capture_output=True, check=True, timeout=60)
    return output
