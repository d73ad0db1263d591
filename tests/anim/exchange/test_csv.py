"""CSV curves: both forms, every fault with its line."""

from __future__ import annotations

import numpy as np
import pytest

from anim.errors import FormatError, RangeError
from anim.exchange import csv
from anim.exchange.convention import NOTHING, Stated
from anim.exchange.curve import Curve, Mode
from anim.exchange.motion import Convention, EulerNode, Unit
from anim.maths.euler import Frame

XYZ = Stated("XYZ", Frame.EXTRINSIC, Unit.DEG)

FRAMES = """# order=ZXY frame=intrinsic unit=deg meters_per_unit=0.01
#node,hips,,0,90,0
#node,"spine, lower",hips,0,12,0,5,0,0
time,hips.ty,hips.rz,"spine, lower.ry"
0,90,0,0
0.5,,45,

1,95,90,30
"""

KEYS = """node,channel,time,value,interpolation,in_tangent,out_tangent
arm,rx,0,0,linear,,
arm,ry,0,0,step,,
arm,rx,1,720,cubic,0,90
arm,rx,2,0,,-90,
"""


def _node(data: str, name: str, options: Stated = NOTHING) -> EulerNode:
    return next(node for node in csv.read(data.encode(), options).nodes if node.name == name)


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
    assert x.in_tangents is not None
    np.testing.assert_allclose(x.in_tangents, np.radians((0, 0, -90)))
    assert y.modes.tolist() == [Mode.STEP]


def test_proper_orders_number_their_angles() -> None:
    arm = _node("time,a.r1,a.r2,a.r3\n0,1,2,3\n1,4,5,6\n", "a", Stated("ZXZ", Frame.INTRINSIC, Unit.RAD))
    assert [_curve(c).values[0] for c in arm.rotation] == [1, 2, 3]
    with pytest.raises(FormatError, match="line 1: axis 'z' has no single place in order ZXZ"):
        csv.read(b"time,a.rz\n0,1\n", Stated("ZXZ", Frame.INTRINSIC, Unit.RAD))


@pytest.mark.parametrize("text", [FRAMES, KEYS])
def test_what_is_written_is_read_as_the_same(text: str) -> None:
    motion = csv.read(text.encode(), XYZ if text is KEYS else NOTHING)
    node = motion.nodes[0]
    again = csv.read(csv.write(motion, Convention(node.order, node.frame, Unit.RAD)), NOTHING)
    for one, two in zip(motion.nodes, again.nodes, strict=True):
        assert (one.name, one.parent, one.order, one.frame) == (two.name, two.parent, two.order, two.frame)
        np.testing.assert_allclose(two.translation, one.translation, atol=1e-9)
        for a, b in zip(one.rotation, two.rotation, strict=True):
            assert (a is None) == (b is None)
            if a is not None and b is not None:
                np.testing.assert_allclose(b.times, a.times, atol=1e-9)
                np.testing.assert_allclose(b.values, a.values, atol=1e-9)
                assert a.modes.tolist() == b.modes.tolist()


@pytest.mark.parametrize(
    ("stated", "problem"),
    [
        (NOTHING, "nobody says the order"),
        (Stated("XYZ"), "nobody says the frame"),
        (Stated("XYZ", Frame.INTRINSIC), "nobody says the unit"),
        (Stated("XXZ", Frame.INTRINSIC, Unit.DEG), "order is 'XXZ'"),
    ],
)
def test_the_convention_is_never_guessed(stated: Stated, problem: str) -> None:
    with pytest.raises(RangeError, match=problem):
        csv.read(KEYS.encode(), stated)


def test_two_conventions_are_refused() -> None:
    with pytest.raises(RangeError, match="the file says order ZXY, the options say XYZ"):
        csv.read(FRAMES.encode(), XYZ)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("0,90,0,0", "0,90,0", "line 5: 3 columns .expected 4"),
        ("1,95,90,30", "1,95,90,30,1", "line 8: 5 columns .expected 4"),
        ("1,95", "1,nan", "line 8: hips.ty is 'nan'"),
        ("1,95", "1,x", "line 8: hips.ty is 'x'"),
        ("0.5,,45", "2,,45", "line 8: time 1 s after 2 s"),
        ("0,90,0,0", "-1,90,0,0", "line 5: time is -1"),
        ("hips.rz", "hips.rw", "line 4: unknown channel"),
        ("hips.rz", "hips.q", "line 4: unknown channel 'q'"),
        ("hips.rz", "hips.ty", "line 4: column 'hips.ty' twice"),
        ("time,", "tme,", "the header is"),
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
        csv.read(FRAMES.replace(old, new, 1).encode(), NOTHING)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("cubic,0", "bezier,0", "line 4: interpolation is 'bezier'"),
        ("arm,rx,2", "arm,rx,0.5", "line 5: time 0.5 s after 1 s"),
        ("720", "inf", "line 4: value is 'inf'"),
        ("interpolation", "interp", "unknown column 'interp'"),
    ],
)
def test_a_fault_in_keys_is_told_with_its_line(old: str, new: str, problem: str) -> None:
    with pytest.raises(FormatError, match=problem):
        csv.read(KEYS.replace(old, new, 1).encode(), XYZ)


@pytest.mark.parametrize("text", ["", "time,a.rx\n", "# order=XYZ\n"])
def test_nothing_in_it_is_refused(text: str) -> None:
    with pytest.raises(FormatError, match=r"no rows|is empty"):
        csv.read(text.encode(), XYZ)
