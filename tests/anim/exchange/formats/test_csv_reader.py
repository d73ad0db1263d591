"""CSV curves: both forms, every fault with its line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from anim.errors import FormatError, RangeError
from anim.exchange.euler.convention import UNSPECIFIED, PartialConvention
from anim.exchange.euler.curve import Curve, Mode
from anim.exchange.euler.motion import Convention, EulerNode, Unit
from anim.exchange.formats import csv_reader
from anim.maths.euler import AxesConvention

XYZ = PartialConvention("XYZ", AxesConvention.EXTRINSIC, Unit.DEG)

FRAMES = """# order=ZXY frame=intrinsic unit=deg meters_per_unit=0.01
#node,hips,,0,90,0
#node,"spine, lower",hips,0,12,0,5,0,0
time,hips.ty,hips.rz,"spine, lower.ry"
0,90,0,0
0.5,,45,

1,95,90,30
"""

KEYS = """node,channel,time,value,interpolation,in_tangent,out_tangent,in_weight,out_weight
arm,rx,0,0,linear,,,,
arm,ry,0,0,step,,,,
arm,rx,1,720,cubic,0,90,,0.5
arm,rx,2,0,,-90,,,
"""


def _node(data: str, name: str, options: PartialConvention = UNSPECIFIED) -> EulerNode:
    return next(node for node in csv_reader.read(data.encode(), options).nodes if node.name == name)


def _curve(curve: Curve | None) -> Curve:
    assert curve is not None
    return curve


def test_frames_with_gaps_are_keys_of_their_own() -> None:
    hips, spine = _node(FRAMES, "hips"), _node(FRAMES, "spine, lower")
    np.testing.assert_allclose(hips.moves[1].times, (0, 1))
    np.testing.assert_allclose(hips.moves[1].values, (0.9, 0.95))
    np.testing.assert_allclose(_curve(hips.rotation[0]).times, (0, 0.5, 1))
    np.testing.assert_allclose(_curve(hips.rotation[0]).values, np.radians((0, 45, 90)))
    assert hips.rotation[1] is None
    np.testing.assert_allclose(_curve(spine.rotation[2]).times, (0, 1))
    np.testing.assert_allclose(spine.translation, (0, 0.12, 0))
    np.testing.assert_allclose(spine.angles, np.radians((5, 0, 0)))
    assert (hips.parent, spine.parent) == (-1, 0)


def test_keys_with_modes_and_tangents() -> None:
    arm = _node(KEYS, "arm", XYZ)
    x, y = _curve(arm.rotation[0]), _curve(arm.rotation[1])
    np.testing.assert_allclose(x.values, np.radians((0, 720, 0)))
    assert x.modes.tolist() == [Mode.LINEAR, Mode.CUBIC, Mode.LINEAR]
    assert x.out_weights is not None
    np.testing.assert_allclose(x.out_weights, (1 / 3, 0.5, 1 / 3))
    assert x.in_weights is None
    assert x.in_tangents is not None
    np.testing.assert_allclose(x.in_tangents, np.radians((0, 0, -90)))
    assert y.modes.tolist() == [Mode.STEP]


def test_keys_before_zero_come_later_all_by_as_much() -> None:
    frames = csv_reader.read(FRAMES.replace("\n0,90", "\n-0.25,90").encode(), UNSPECIFIED)
    np.testing.assert_allclose(_curve(frames.nodes[0].rotation[0]).times, (0, 0.75, 1.25))
    np.testing.assert_allclose(_curve(frames.nodes[1].rotation[2]).times, (0, 1.25))
    keys = csv_reader.read(KEYS.replace("arm,rx,0", "arm,rx,-2").encode(), XYZ)
    np.testing.assert_allclose(_curve(keys.nodes[0].rotation[0]).times, (0, 3, 4))
    np.testing.assert_allclose(_curve(keys.nodes[0].rotation[1]).times, (2,))
    assert keys.notes == ("the first key is at -2 s: all are moved by 2 s, to begin at 0",)


def test_proper_orders_number_their_angles() -> None:
    arm = _node(
        "time,a.r1,a.r2,a.r3\n0,1,2,3\n1,4,5,6\n", "a", PartialConvention("ZXZ", AxesConvention.INTRINSIC, Unit.RAD)
    )
    assert [_curve(c).values[0] for c in arm.rotation] == [1, 2, 3]
    with pytest.raises(FormatError, match="line 1: axis 'z' has no single place in order ZXZ"):
        csv_reader.read(b"time,a.rz\n0,1\n", PartialConvention("ZXZ", AxesConvention.INTRINSIC, Unit.RAD))


@pytest.mark.parametrize("text", [FRAMES, KEYS])
def test_what_is_written_is_read_as_the_same(text: str) -> None:
    motion = csv_reader.read(text.encode(), XYZ if text is KEYS else UNSPECIFIED)
    node = motion.nodes[0]
    again = csv_reader.read(csv_reader.write(motion, Convention(node.order, node.frame, Unit.RAD)), UNSPECIFIED)
    for one, two in zip(motion.nodes, again.nodes, strict=True):
        assert (one.name, one.parent, one.order, one.frame) == (two.name, two.parent, two.order, two.frame)
        np.testing.assert_allclose(two.translation, one.translation, atol=1e-9)
        for a, b in zip(one.rotation, two.rotation, strict=True):
            assert (a is None) == (b is None)
            if a is not None and b is not None:
                np.testing.assert_allclose(b.times, a.times, atol=1e-9)
                np.testing.assert_allclose(b.values, a.values, atol=1e-9)
                assert a.modes.tolist() == b.modes.tolist()
                assert (a.out_weights is None) == (b.out_weights is None)


def test_a_node_whose_name_begins_like_a_comment_keeps_its_keys() -> None:
    motion = csv_reader.read(KEYS.encode(), XYZ)
    nodes = (replace(motion.nodes[0], name="#1"), *motion.nodes[1:])
    again = csv_reader.read(
        csv_reader.write(replace(motion, nodes=nodes), Convention("XYZ", AxesConvention.EXTRINSIC, Unit.DEG)),
        UNSPECIFIED,
    )
    assert again.nodes[0].name == "#1"
    curves = [[curve is not None for curve in each.nodes[0].rotation] for each in (motion, again)]
    assert curves[0] == curves[1]
    assert any(curves[0])


@pytest.mark.parametrize(
    ("stated", "problem"),
    [
        (UNSPECIFIED, "rotation order not specified"),
        (PartialConvention("XYZ"), "axes convention not specified"),
        (PartialConvention("XYZ", AxesConvention.INTRINSIC), "angle unit not specified"),
        (PartialConvention("XXZ", AxesConvention.INTRINSIC, Unit.DEG), "`order` is 'XXZ'"),
    ],
)
def test_the_convention_is_never_guessed(stated: PartialConvention, problem: str) -> None:
    with pytest.raises(RangeError, match=problem):
        csv_reader.read(KEYS.encode(), stated)


def test_the_convention_in_a_persons_spelling() -> None:
    """Spaces, capitals and commas in comments, "# node", and what spreadsheets save as Unicode text."""
    loose = FRAMES.replace("order=ZXY frame=intrinsic", "Order = zxy, FRAME = Intrinsic,").replace("#node", "# node")
    assert loose != FRAMES
    for text in (loose.encode(), FRAMES.encode("utf-16"), FRAMES.replace("\n", "\r").encode()):
        motion = csv_reader.read(text, UNSPECIFIED)
        assert [(n.name, n.parent, n.order, n.frame) for n in motion.nodes] == [
            ("hips", -1, "ZXY", AxesConvention.INTRINSIC),
            ("spine, lower", 0, "ZXY", AxesConvention.INTRINSIC),
        ]
        np.testing.assert_allclose(motion.nodes[1].translation, (0, 0.12, 0))


def test_other_separators_are_named() -> None:
    with pytest.raises(FormatError, match=r"line 1: the header is 'time;a\.rx'.*separated by commas"):
        csv_reader.read(b"time;a.rx\n0;1\n", XYZ)


def test_two_conventions_are_refused() -> None:
    with pytest.raises(RangeError, match=r"rotation order is ZXY in the file \(got XYZ\)"):
        csv_reader.read(FRAMES.encode(), XYZ)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("0,90,0,0", "0,90,0", "line 5: 3 columns .expected 4"),
        ("1,95,90,30", "1,95,90,30,1", "line 8: 5 columns .expected 4"),
        ("1,95", "1,nan", "line 8: hips.ty is 'nan'"),
        ("1,95", "1,9_5", "line 8: hips.ty is '9_5'"),
        ("1,95", "1,x", "line 8: hips.ty is 'x'"),
        ("0.5,,45", "2,,45", "line 8: time 1 s after 2 s"),
        ("hips.rz", "hips.rw", "line 4: unknown channel"),
        ("hips.rz", "hips.q", "line 4: unknown channel 'q'"),
        ("hips.rz", "hips.ty", "line 4: column 'hips.ty' twice"),
        ("time,", "tme,", "line 4: the header is 'tme,"),
        ("0.01", "0", "line 1: meters_per_unit is 0 .expected a number above 0"),
        ("0.01", "cm", "line 1: meters_per_unit is 'cm'"),
        ("unit=deg", "unit=grad", "unit is 'grad'"),
        (",hips,0,12", ",hip,0,12", "has the parent 'hip', which is not there"),
        ("#node,hips,,", "#node,hips,hips,", "'hips' is its own ancestor"),
        ("0,90,0\n#", "0,90\n#", "line 2: expected #node"),
        ("0.5,,45", '0.5,,"45', "broken CSV"),
    ],
)
def test_a_fault_is_told_with_its_line(old: str, new: str, problem: str) -> None:
    assert old in FRAMES
    with pytest.raises(FormatError, match=problem):
        csv_reader.read(FRAMES.replace(old, new, 1).encode(), UNSPECIFIED)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("cubic,0", "bezier,0", "line 4: interpolation is 'bezier'"),
        ("arm,rx,2", "arm,rx,0.5", "line 5: time 0.5 s after 1 s"),
        ("720", "inf", "line 4: value is 'inf'"),
        (",,0.5", ",,1.5", "line 4: out_weight is 1.5 .expected a share"),
        ("interpolation", "interp", "unknown column 'interp'"),
        ("cubic,0,90", "cubic,0,", "line 4: a cubic piece lacks its out_tangent"),
        (",-90", ",", "line 5: a cubic piece lacks its in_tangent"),
    ],
)
def test_a_fault_in_keys_is_told_with_its_line(old: str, new: str, problem: str) -> None:
    with pytest.raises(FormatError, match=problem):
        csv_reader.read(KEYS.replace(old, new, 1).encode(), XYZ)


@pytest.mark.parametrize("text", ["", "time,a.rx\n", "# order=XYZ\n"])
def test_nothing_in_it_is_refused(text: str) -> None:
    with pytest.raises(FormatError, match=r"no rows|is empty"):
        csv_reader.read(text.encode(), XYZ)
