"""Advice about methods, from the measures of every one."""

from __future__ import annotations

import numpy as np
import pytest

from anim.skinning.analysis.collapse import MeshCollapse, collapse
from anim.skinning.analysis.collapse_index import CollapsePoint
from anim.skinning.analysis.collapsed_clips import MIN_VOLUME_FRACTION, is_collapsed
from anim.skinning.analysis.method_scores import MethodScore
from anim.skinning.analysis.ranking import RankedMethod, best_method, rank_methods
from anim.skinning.analysis.recommendations import CollapseFinding, recommend
from tests.anim.skinning.analysis.tubes import tube, turned
from tests.clips import clip, track


def told(axis: str, angle: float, *methods: str, clamped: bool = False) -> list[str]:
    """The advice on a tube that is turned by an angle."""
    time, methods = np.array([1.0]), methods or ("lbs", "dqs")
    seen = collapse(tube(), turned(axis, 0, angle), times=time, methods=methods, bulge_clamp=clamped)
    return list(recommend([CollapseFinding(0, "turn", each) for each in seen], clamped=clamped))


def made_up(index: float, *, closed: bool = True, **methods: tuple[float | None, float]) -> CollapseFinding:
    """A mesh with an index, and of each method the volume and the bulge."""
    worst = CollapsePoint(index, 0, "arm", "hand", 0.0, 1.5, twist=False)
    fared = tuple(
        MethodScore(name, None if volume is None else np.full(2, volume), bulge, 0.5, 0, "arm", 0.5)
        for name, (volume, bulge) in methods.items()
    )
    return CollapseFinding(
        0, "turn", MeshCollapse("m", 0, 9, np.arange(2.0), np.ones(2), worst, 0, 0, float(closed), fared)
    )


def test_advice() -> None:
    (fine,) = told("y", 0)
    assert fine.startswith("linear blending is good enough: no index is below 0.7 (min 1.000), 100 %")
    pinched, bake_it, share = told("y", 120)
    assert pinched.startswith("1 clip collapses; min index 0.50 in 'turn': 'lower' against 'upper', 120° at 1.00 s")
    assert bake_it == (
        "to bake with dqs (lbs keeps 50 %, dqs keeps 100 % of the volume): "
        "gltf-anim bake IN OUT --method dqs --clip '#0'"
    )
    assert share.startswith("or distribute the twist over 4 joints between 'lower' and 'upper' (97 %")
    bent = told("x", 120)
    assert not any("twist" in line for line in bent)
    assert bent[-3].startswith("dqs bulges up to ")
    assert list(recommend([])) == ["there is no clip to look at"]


@pytest.mark.parametrize(("angle", "is_pinched"), [(44, False), (45.6, True), (90, True)])
def test_a_tenth_of_the_volume_is_pinching_though_no_vertex_is(angle: float, is_pinched: bool) -> None:
    """1 − ⅔ sin²(θ/2) is 0.9 at θ = 45.57°, where the index is still 0.92."""
    least = 1 - 2 / 3 * np.sin(np.radians(angle) / 2) ** 2
    assert (least < 0.9) == is_pinched
    first = told("y", angle)[0]
    assert first.startswith("1 clip collapses" if is_pinched else "linear blending is good enough")
    assert f"{100 * least:.0f} %" in first


def test_the_limit_of_the_volume_is_a_quarter_turn_over_three_tenths() -> None:
    assert pytest.approx(1 - 2 / 3 * 0.3 * np.sin(np.pi / 4) ** 2) == MIN_VOLUME_FRACTION


def test_what_every_method_loses_is_no_pinching() -> None:
    """A joint that shrinks takes volume from all methods: another one would be no help."""
    sizes = np.array([[1, 1, 1], [1e-3, 1e-3, 1e-3]])
    shrunk = clip(track("scale", [0, 1], sizes, node=1), name="shrink")
    (found,) = collapse(tube(), shrunk, times=np.array([1.0]))
    assert found.methods[0].volume is not None
    assert found.methods[0].volume[0] < 0.8
    assert not is_collapsed(found)
    (line,) = recommend([CollapseFinding(0, "shrink", found)])
    assert "good enough" not in line
    assert line.endswith("remains at worst, and no method that was measured keeps more")


def test_of_what_was_measured_the_best_is_recommended() -> None:
    """CesiumMan's figures: cor keeps more and bulges less, so nobody is told to bake dqs or to try cor."""
    lines = list(recommend([made_up(0.68, lbs=(0.94, 1.46), dqs=(0.96, 1.78), cor=(0.97, 1.57))]))
    assert lines[1].startswith("to bake with cor (lbs keeps 94 %, dqs keeps 96 %, cor keeps 97 % of the volume): ")
    assert lines[2:] == [
        "cor bulges up to 1.57× at 'arm' (turn, 0.50 s)",
        "to compare with the bulge clamp: gltf-anim collapse IN --method lbs --method dqs --method cor "
        "--bulge-clamp --clip '#0'",
    ]


@pytest.mark.parametrize(
    ("dqs", "cor", "chosen"),
    [
        ((0.99, 1.9), (0.9, 1.1), "dqs"),  # volume counts first
        ((0.99, 1.9), (0.98, 1.1), "cor"),  # alike: the one that bulges less
        ((1.2, 1.9), (0.99, 1.1), "cor"),  # more than bind pose is no gain
        ((0.99, 1.1), (0.99, 1.1), "dqs"),  # equal: the first
        ((None, 1.9), (None, 1.1), "cor"),  # nothing closed: bulge alone
    ],
)
def test_the_best_by_volume_then_by_bulge(
    dqs: tuple[float | None, float], cor: tuple[float | None, float], chosen: str
) -> None:
    meshes = [made_up(0.5, lbs=(None if dqs[0] is None else 0.5, 1.0), dqs=dqs, cor=cor).mesh]
    found = best_method(rank_methods(meshes))
    assert found is not None
    assert found.method == chosen


def test_standings_are_the_worst_over_all_meshes() -> None:
    two = [made_up(0.5, dqs=(0.9, 1.0)).mesh, made_up(0.5, dqs=(0.8, 1.2)).mesh, made_up(0.5, dqs=(None, 1.1)).mesh]
    assert rank_methods(two) == (RankedMethod("dqs", 0.8, 1.2),)


def test_only_what_was_not_measured_is_to_be_tried() -> None:
    clamp, other = told("x", 120)[-2:]
    assert clamp.endswith(": gltf-anim collapse IN --method lbs --method dqs --bulge-clamp --clip '#0'")
    assert other == ("to compare with cor: gltf-anim collapse IN --method lbs --method dqs --method cor --clip '#0'")
    assert told("x", 120, "lbs", "dqs", "cor")[-1].endswith("--method cor --bulge-clamp --clip '#0'")
    assert told("y", 120, "lbs")[1] == (
        "bake with another method; to compare first with dqs and cor: "
        "gltf-anim collapse IN --method lbs --method dqs --method cor --clip '#0'"
    )
    assert told("y", 120, "cor")[1].startswith("to bake with cor (cor keeps 100 % of the volume): ")
    clamped = told("x", 120, "lbs", "dqs", clamped=True)
    assert clamped[1].endswith("gltf-anim bake IN OUT --method dqs --bulge-clamp --clip '#0'")
    assert not any("a clamp" in line for line in clamped)


def test_nobody_is_warned_of_a_bulge_that_nobody_needs() -> None:
    (line,) = recommend([made_up(0.71, lbs=(0.93, 1.15), dqs=(1.0, 1.6))])
    assert line.startswith("linear blending is good enough")
    both = [made_up(0.71, lbs=(0.93, 1.0), dqs=(1.0, 1.9)), made_up(0.5, lbs=(0.8, 1.0), dqs=(1.0, 1.0))]
    assert not any("bulges" in each for each in recommend(both)), "it bulges where nothing pinches"


def test_a_method_that_loses_more_than_lbs_is_not_recommended() -> None:
    lines = list(recommend([made_up(0.6, lbs=(0.97, 1.0), dqs=(0.9, 1.9))]))
    assert lines[1:] == [
        "no other method that was measured keeps more of the volume than lbs (lbs keeps 97 %, dqs keeps 90 %)"
    ]


def test_without_lbs_nothing_is_said_of_its_volume() -> None:
    (line,) = told("y", 90, "cor")
    assert line == (
        "no index is below 0.7 (min 0.707); to measure the volume with linear blending: "
        "gltf-anim collapse IN --method cor --method lbs --clip '#0'"
    )
    (line,) = recommend([made_up(0.8, closed=False, dqs=(None, 1.0))])
    assert line == "linear blending is good enough: no index is below 0.7 (min 0.800)"
