"""`diff` of colors, lights and other properties that move nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import anim
from anim.model import Track
from fixtures.document import Channel, add_clip, add_node, start
from tests.cli.conftest import Call
from tests.files import glb_of, opened_path

EMISSIVE, ACME = "/materials/0/emissiveFactor", "/materials/0/extensions/ACME_glow/glow"
TIMES = np.array([0.0, 1, 2])
COLORS = np.array([[0.0, 0, 0], [0.5, 0, 0], [0, 0, 0.25]])
UP = np.array([[0.0, 0, 0], [0, 1, 0], [0, 0, 0]])


def glowing(path: Path, pointer: str, **material: Any) -> Path:
    """A node that moves, and a material whose color changes."""
    gltf = start()
    node = add_node(gltf, "lamp")
    channels = [Channel(node, "translation", TIMES, UP), Channel(pointer, "pointer", TIMES, COLORS)]
    add_clip(gltf, "glow", channels)
    path.write_bytes(b"".join(gltf.save_to_bytes()))
    return edited(path, path, lambda json: json.update(materials=[material]))


def edited(path: Path, out: Path, edit: Callable[[dict[str, Any]], object]) -> Path:
    document = opened_path(path)
    edit(document.json)
    out.write_bytes(glb_of(document))
    return out


def drop_colors(json: dict[str, Any]) -> None:
    json["animations"][0]["channels"].pop()


@pytest.mark.parametrize(
    ("material", "error"), [({}, 0.5 / 0.5), ({"emissiveFactor": [0.5, 0, 0]}, 1.0), ({"emissiveFactor": [0, 1, 0]}, 2)]
)
def test_a_lost_track_is_an_error(material: dict[str, Any], error: float, call: Call, tmp_path: Path) -> None:
    """The file that lacks it shows its material's value, or that of the specification."""
    a = glowing(tmp_path / "a.glb", EMISSIVE, **material)
    b = edited(a, tmp_path / "b.glb", drop_colors)
    (found,) = call("diff", a, b, "--format", "json").json["clips"]
    assert (found["max_error_m"], found["max_pointer_error"], found["pointer"]) == (0, error, EMISSIVE)
    assert [each["target"] for each in found["missing_tracks"]] == [EMISSIVE]
    assert call("diff", a, b, "--fail-above", "1mm").code == 0  # of lengths
    run = call("diff", a, b, "--fail-above", "0")
    assert (run.code, f"% of range at {EMISSIVE} in 'glow' (limit 0 mm)" in run.err) == (6, True)
    assert call("diff", b, a, "--fail-above", "0").code == 6
    assert anim.diff(a, b).clips[0].error.max_pointer_error == error


def test_a_lost_track_that_shows_the_same_is_none(call: Call, tmp_path: Path) -> None:
    a = glowing(tmp_path / "a.glb", EMISSIVE, emissiveFactor=[0, 0, 0])
    still = edited(a, tmp_path / "still.glb", drop_colors)
    gone = edited(still, tmp_path / "gone.glb", lambda json: json["materials"][0].clear())
    assert call("diff", still, gone, "--fail-above", "0").code == 0
    assert call("diff", a, a, "--fail-above", "0").code == 0


@pytest.mark.parametrize("factor", [0.1, 1 / 3])
def test_numbers_of_the_json_are_rounded_as_keys_are(factor: float, call: Call, tmp_path: Path) -> None:
    a = glowing(tmp_path / "a.glb", EMISSIVE, emissiveFactor=[factor, factor, factor])
    still = edited(a, tmp_path / "still.glb", drop_colors)

    def hold(each: Track) -> Track:
        return replace(each, values=np.full_like(each.values, np.float32(factor))) if each.pointer else each

    constant = anim.load(a).map_clips(lambda clip: replace(clip, tracks=tuple(map(hold, clip.tracks))))
    constant.save(tmp_path / "constant.glb")
    assert call("diff", tmp_path / "constant.glb", still, "--fail-above", "0").code == 0


@pytest.mark.parametrize("value", [[10**400, 0, 0], [1e300, 0, 0], [True, None, 0], "red"])
def test_a_value_that_no_track_can_have_is_not_known(value: object, call: Call, tmp_path: Path) -> None:
    a = glowing(tmp_path / "a.glb", EMISSIVE, emissiveFactor=[0, 0, 0])
    b = edited(a, tmp_path / "b.glb", drop_colors)
    edited(b, b, lambda json: json["materials"][0].update(emissiveFactor=value))
    run = call("diff", a, b)
    assert run.code in (0, 3), run.err
    assert "Traceback" not in run.err


def test_defaults_of_other_vendors_are_not_known(call: Call, tmp_path: Path) -> None:
    pointer = "/materials/0/extensions/ACME_light/color"
    a = glowing(tmp_path / "a.glb", pointer, extensions={"ACME_light": {}})
    b = edited(a, tmp_path / "b.glb", drop_colors)
    assert "without a known value in the other: not measured" in call("diff", a, b).err


def test_a_value_that_is_not_known_is_a_warning(call: Call, tmp_path: Path) -> None:
    a = glowing(tmp_path / "a.glb", ACME)
    b = edited(a, tmp_path / "b.glb", drop_colors)
    for one, other in ((a, b), (b, a)):
        run = call("diff", one, other, "--format", "json")
        words = f"{ACME}: animated in one file only, without a known value in the other: not measured"
        assert any(words in each for each in run.json["warnings"])
        assert call("diff", one, other, "--fail-above", "0").code == 6


def test_a_changed_color_fails_a_limit_of_0(call: Call, tmp_path: Path) -> None:
    a = glowing(tmp_path / "a.glb", EMISSIVE)
    b = tmp_path / "b.glb"
    run = call("resample", a, b, "--fps", "0.4")
    assert "pointers max" in run.err
    assert call("diff", a, b, "--fail-above", "0").code == 6
