"""BVH: every oddity of real files, every fault with its line, and joints where a plain loop puts them."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from anim.errors import FormatError
from anim.exchange.euler.evaluate import bounding_size, skeleton
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.motion import scale_motion, z_up_to_y_up
from anim.exchange.formats import bvh_reader
from anim.exchange.formats.bvh_reader import BvhPosition
from anim.exchange.stick_mesh import stick_mesh
from anim.gltf import authoring
from anim.gltf.reading import reader
from anim.sampling import sample_pose, world_matrices
from tests.anim.exchange.forward import world_positions
from tests.files import glb_of, opened

FILES = ("cmu_01_01.bvh", "freebvh.bvh", "example.bvh")
TOLERANCE = np.radians(0.05)
Find = Callable[[str], Path]

SMALL = """HIERARCHY
ROOT hip
{
  OFFSET 0 10 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT knee
  {
    OFFSET 0 -5 0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0 -5 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.1
0 10 0 0 0 0 0
1 10 0 0 0 90 90
"""


def _positions(text: str) -> tuple[list[str], np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
    converted = from_euler(bvh_reader.read(text.encode()), tolerance=TOLERANCE)
    times = converted.clip.tracks[0].times
    world = world_matrices(converted.skeleton, sample_pose(converted.skeleton, converted.clip, times))
    return list(converted.skeleton.names), world[..., 3]


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_joints_stand_where_a_plain_loop_puts_them(name: str, asset: Find) -> None:
    """Through the written GLB, at every frame, to 1e-5 of the height."""
    text = asset(f"bvh/{name}").read_text()
    names, expected = world_positions(text)
    motion = bvh_reader.read(text.encode())
    converted = from_euler(scale_motion(motion, 0.01), tolerance=TOLERANCE, name="clip")
    document = authoring.build_document(
        converted.skeleton, [converted.clip], [stick_mesh(converted.skeleton, converted.ends)]
    )
    written = opened(glb_of(document))
    bones, clip = reader.skeleton(written), reader.clips(written)[0]
    assert list(bones.names[: len(names)]) == names
    times = next(track.times for track in clip.tracks if track.path == "translation")
    assert len(times) == len(expected)
    found = world_matrices(bones, sample_pose(bones, clip, times))[:, : len(names), :, 3] * 100
    height = bounding_size(skeleton(motion))
    assert np.abs(found - expected).max() < 1e-5 * height


@pytest.mark.parametrize("name", FILES)
def test_joints_stand_where_bvhio_puts_them(name: str, asset: Find, tmp_path: Path) -> None:
    """A library of others, where it is installed, in up to 40 frames; in all 2752 of the longest it is 4.8e-7."""
    bvhio = pytest.importorskip("bvhio")
    head, _, motion = asset(f"bvh/{name}").read_text().partition("MOTION")
    _, seconds, *rows = motion.strip().splitlines()
    path = tmp_path / name
    path.write_text("\n".join((f"{head}MOTION\nFrames: {len(rows[:40])}", seconds, *rows[:40], "")))
    root = bvhio.readAsHierarchy(str(path))
    converted = from_euler(bvh_reader.read(path.read_bytes()), tolerance=TOLERANCE)
    times = converted.clip.tracks[0].times
    world = world_matrices(converted.skeleton, sample_pose(converted.skeleton, converted.clip, times))[..., 3]
    for frame in range(0, len(times), 4):
        root.loadPose(frame)
        for joint, _, _ in root.layout():
            found = world[frame, converted.skeleton.names.index(joint.Name)]
            np.testing.assert_allclose(found, tuple(joint.PositionWorld), atol=1e-5 * bounding_size(converted.skeleton))


def test_frames_stand_on_their_grid(asset: Find) -> None:
    motion = bvh_reader.read(asset("bvh/cmu_01_01.bvh").read_bytes())
    times = from_euler(motion, tolerance=TOLERANCE).clip.tracks[0].times
    np.testing.assert_allclose(times, np.arange(2752) / 120, atol=1e-6)
    assert not any("1/120" in note for note in motion.notes)


def test_a_joint_by_hand() -> None:
    names, places = _positions(SMALL)
    assert names == ["hip", "knee", "knee_end"]
    np.testing.assert_allclose(places[0], [(0, 10, 0), (0, 5, 0), (0, 0, 0)], atol=1e-12)
    # Turned left by 90° about Y, the knee swings the shin from down to back, which now is −X.
    np.testing.assert_allclose(places[1], [(1, 10, 0), (1, 5, 0), (-4, 5, 0)], atol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        SMALL.replace("\n", "\r\n"),
        SMALL.replace("\n", "\r"),
        SMALL.lower().replace("hierarchy", "Hierarchy"),
        "\ufeff" + SMALL,
        SMALL.replace("0 10 0 0 0 0 0", "0 10 0\n0 0 0 0\n"),
        SMALL.replace("0 10 0 0 0 0 0\n", "0 10 0 0 0 0 0 "),
        SMALL.replace("{", " {").replace("\n {", " {"),
        SMALL.replace("Frames: 2", "Frames:\t2").replace("Frame Time:", "Frame  Time :"),
        SMALL + "\n\n  \n",
        " ".join(SMALL.partition("MOTION")[0].split()) + "\nMOTION" + SMALL.partition("MOTION")[2],
    ],
    ids=["crlf", "old mac", "lower case", "bom", "wrapped", "joined", "braces", "spaces", "blank lines", "one line"],
)
def test_oddities_change_nothing(text: str) -> None:
    np.testing.assert_allclose(_positions(text)[1], _positions(SMALL)[1], atol=1e-12)


def test_utf16_is_read() -> None:
    assert len(bvh_reader.read(SMALL.encode("utf-16")).nodes) == 3


def test_names_with_spaces_and_twice() -> None:
    text = SMALL.replace("JOINT knee", "JOINT  left knee:1").replace("ROOT hip", "ROOT left knee:1")
    motion = bvh_reader.read(text.encode())
    assert [node.name for node in motion.nodes] == ["left knee:1", "left knee:1.2", "left knee:1_end"]
    assert any("left knee:1.2" in note for note in motion.notes)


def test_many_roots() -> None:
    head, _, tail = SMALL.partition("MOTION")
    other = "ROOT ball { OFFSET 1 2 3 CHANNELS 0 }\n"
    motion = bvh_reader.read((head + other + "MOTION" + tail).encode())
    assert [node.parent for node in motion.nodes] == [-1, 0, 1, -1]


@pytest.mark.parametrize(
    ("claim", "noted"), [("Frames: 2", False), ("Frames: 1", True), ("Frames: 3", True), ("Frames: 0", True)]
)
def test_a_wrong_frame_count_is_noted(claim: str, noted: bool) -> None:
    motion = bvh_reader.read(SMALL.replace("Frames: 2", claim).encode())
    curve = motion.nodes[0].rotation[0]
    assert curve is not None
    assert len(curve.times) == 2
    assert any("Frames says" in note for note in motion.notes) == noted


def test_positions_replace_or_add() -> None:
    replaced, added = (bvh_reader.read(SMALL.encode(), position=position) for position in BvhPosition)
    assert replaced.nodes[0].moves[1].values[0] == 10
    assert added.nodes[0].moves[1].values[0] == 20


def test_channels_of_any_subset_in_any_order() -> None:
    text = SMALL.replace("CHANNELS 1 Xrotation", "CHANNELS 2 Zposition Yrotation").replace("0 90 90", "0 90 90 -3")
    text = text.replace("0 0 0 0 0 0 0", "0 0 0 0 0 0 0 0").replace("0 10 0 0 0 0 0", "0 10 0 0 0 0 0 0")
    knee = bvh_reader.read(text.encode()).nodes[1]
    assert knee.order == "Y"
    assert list(knee.moves) == [2]
    np.testing.assert_allclose(knee.translation, (0, -5, 0))


def test_z_up_becomes_y_up() -> None:
    motion = bvh_reader.read(SMALL.encode())
    times = np.array([0.0, 0.05, 0.1])
    plain, turned = (from_euler(each, tolerance=TOLERANCE) for each in (motion, z_up_to_y_up(motion)))
    places = [world_matrices(c.skeleton, sample_pose(c.skeleton, c.clip, times))[..., 3] for c in (plain, turned)]
    np.testing.assert_allclose(places[1], places[0][..., [0, 2, 1]] * [1, 1, -1], atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("HIERARCHY", "HIRARCHY", "line 1: starts with 'HIRARCHY'"),
        ("1 Xrotation", "1 Xrotatoin", "line 9: unknown channel 'Xrotatoin'"),
        ("1 Xrotation", "2 Xrotation", "line 10: unknown channel 'End'"),
        ("1 Xrotation", "x Xrotation", "line 9: CHANNELS is followed by 'x'"),
        ("OFFSET 0 -5 0\n    CH", "OFFSET 0 nan 0\n    CH", "line 8: OFFSET holds 'nan'"),
        ("OFFSET 0 -5 0\n    CH", "OFFSET 0 0\n    CH", "line 9: OFFSET holds 'CHANNELS'"),
        ("0 90 90", "0 90 nan", "line 20: number 7 is 'nan'"),
        ("0 90 90", "0 90 1e40", "line 20: number 7 is '1e40'"),
        ("0 90 90", "0 90 9_0", "line 20: number 7 is '9_0'"),
        ("0 90 90", "0 90 1,5", "line 20: number 7 is '1,5'"),
        ("0 90 90", "0 90", "line 20: 6 numbers in a row .expected 7, one per channel; truncated"),
        ("0 90 90", "0 90 90 5", "line 20: 8 numbers in a row .expected 7, one per channel.$"),
        ("Frames: 2", "Frames: 1000000000", "line 20: the file holds 2 of 1000000000 claimed frames"),
        ("Frames: 2", "Frames: two", "line 17: 'Frames: two'"),
        (SMALL.partition("MOTION\n")[2], "Frames: 0\nFrame Time: 0.1", "line 18: there are no frames"),
        ("Frame Time: 0.1", "Frame Time: 0", "line 18: Frame Time is 0"),
        ("Frame Time: 0.1", "Frame Time: nan", "line 18: 'Frame Time: nan'"),
        ("MOTION", "MOTOIN", "line 16: 'MOTOIN' stands outside any joint"),
        ("ROOT hip\n", "JOINT hip\n", "line 2: JOINT outside any ROOT"),
        ("JOINT", "ROOT", "line 6: ROOT inside a joint"),
        ("    }\n  }\n}\nMOTION", "    }\n  }\nMOTION", "line 14: the hierarchy ends here"),
        ("6 Xposition", "6 Yposition", "line 5: Yposition twice"),
    ],
)
def test_a_fault_is_told_with_its_line(old: str, new: str, problem: str) -> None:
    assert old in SMALL
    with pytest.raises(FormatError, match=problem):
        bvh_reader.read(SMALL.replace(old, new, 1).encode())


@pytest.mark.parametrize("end", range(0, len(SMALL) - 12, 7))
def test_a_truncated_file_is_refused(end: int) -> None:
    with pytest.raises(FormatError, match=r"line \d+"):
        bvh_reader.read(SMALL[:end].encode())


def test_a_wrong_column_count_in_every_row_is_refused() -> None:
    body = "\n".join(["1 2 3 4 5 6 7 8"] * 7)
    text = SMALL.partition("Frames")[0] + f"Frames: 7\nFrame Time: 0.1\n{body}\n"
    with pytest.raises(FormatError, match=r"line 19: 8 numbers in a row .expected 7"):
        bvh_reader.read(text.encode())


def test_a_claim_of_frames_or_channels_allocates_nothing() -> None:
    tracemalloc.start()
    for old, new in (("Frames: 2", "Frames: 1000000000"), ("CHANNELS 1", "CHANNELS 1000000000")):
        with pytest.raises(FormatError):
            bvh_reader.read(SMALL.replace(old, new).encode())
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()


@pytest.mark.parametrize(
    ("stated", "rate", "noted"),
    [
        ("0.0333333", "30", False),
        ("0.03333", "30", False),
        ("0.1" + "0" * 2_100_000, "10", False),
        ("3.33333e-2", "30", False),
        ("0.03334", "30", True),
        ("0.0333320", "30", True),
        ("0.041708334", "23.976", False),
        ("0.1", "10", False),
    ],
)
def test_a_frame_time_is_noted_where_it_is_more_than_rounded(stated: str, rate: str, noted: bool) -> None:
    motion = bvh_reader.read(SMALL.replace("Time: 0.1", f"Time: {stated}").encode())
    assert any(f"is taken for 1/{rate} s" in note for note in motion.notes) == noted


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("OFFSET 0 10 0", "OFFSET 0 1e38 0", r"OFFSET holds '1e38' \(expected three numbers up to 1e\+15\)"),
        ("Time: 0.1", "Time: 1e30", r"Frame Time is 1e30 \(expected seconds, 1e-06 to 1e\+06\)"),
    ],
)
def test_numbers_out_of_range_are_named_with_their_limits(old: str, new: str, problem: str) -> None:
    with pytest.raises(FormatError, match=problem):
        bvh_reader.read(SMALL.replace(old, new).encode())
