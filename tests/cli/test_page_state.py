"""State of pages in Chromium: the address keeps it, and lists and legend follow it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.gltf.io import container
from tests.browser import evaluate, needs_browser
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import built
from tests.cli.test_table import renamed
from tests.files import glb_of, opened_fixture

pytestmark = [pytest.mark.slow, needs_browser]
ROWS = "[...document.querySelectorAll('#list-report button.row')]"
DOWN = "(document.activeElement.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowDown', bubbles: true })), true)"
PRESS = "document.body.dispatchEvent(new KeyboardEvent('keydown', { key: '%s', bubbles: true }))"


def test_the_address_keeps_lists_and_empty_choices(call: Call, tmp_path: Path) -> None:
    """A list beside curves without a node; nothing shown and no node, on a page that begins with both."""
    (tmp_path / "a.glb").write_bytes(built("biped"))
    page = tmp_path / "a.html"
    call("view", tmp_path / "a.glb", "-o", page, "--show", "bones,curves", "--node", "#3").product()
    cleared = "(player.update({ node: null, show: new Set() }), player.address())"
    chosen = "(player.update({ tab: 'clips' }), player.address())"
    (begun, without, listed) = evaluate(
        page,
        [
            ("", ["player.state.node", cleared]),
            ("#node=&show=", ["player.state.node", "player.state.show.size"]),
            ("#node=&show=curves", ["player.state.tab", chosen]),
        ],
    )
    assert begun[0] == 3
    assert {"node=", "show="} <= set(begun[1].strip("#").split("&"))
    assert without == [None, 0]
    assert listed[0] == "nodes"
    assert evaluate(page, [(listed[1], ["player.state.tab"])]) == [["clips"]]


def test_a_clip_whose_name_another_has(call: Call, tmp_path: Path) -> None:
    path, page = tmp_path / "a.glb", tmp_path / "a.html"
    path.write_bytes(renamed(built("biped"), ["walk", "walk"]))
    call("view", path, "-o", page).product()
    ((address,),) = evaluate(page, [("#clip=%231", ["player.address()"])])
    assert evaluate(page, [(address, ["player.state.clip"])]) == [[1]]


def test_the_wheel_zooms_to_the_cursor_in_either_view(call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(built("biped"))
    page = tmp_path / "ab.html"
    call("view", tmp_path / "a.glb", tmp_path / "a.glb", "-o", page).product()
    point = "player.stage.camera.position.clone().set(0.1, 0.2, -1).unproject(player.stage.camera)"
    canvas = "document.querySelector('#view canvas')"
    codes = []
    for side in (0, 1):
        x, y = f"(0.55 + {side}) * {canvas}.clientWidth / 2", f"0.4 * {canvas}.clientHeight"
        wheel = (
            f"new WheelEvent('wheel', {{ deltaY: -150, clientX: left + {x}, clientY: top + {y}, cancelable: true }})"
        )
        codes.append(f"""(() => {{
            const {{ stage }} = player, {{ left, top }} = {canvas}.getBoundingClientRect();
            const ahead = stage.controls.target.clone().sub(stage.camera.position);
            const ray = {point}.sub(stage.camera.position);
            const below = ray.multiplyScalar(ahead.lengthSq() / ray.dot(ahead)).add(stage.camera.position);
            for (let i = 0; i < 2; i++) {canvas}.dispatchEvent({wheel});
            stage.camera.updateMatrixWorld();
            const distance = stage.controls.target.distanceTo(stage.camera.position) / ahead.length();
            const {{ x, y }} = below.project(stage.camera);
            return [distance, x, y].map((each) => Math.round(each * 1e4) / 1e4);
        }})()""")
    for found in evaluate(page, [("#t=0", codes)])[0]:
        assert found == [
            pytest.approx(1.0005**-300, abs=2e-4),
            pytest.approx(0.1, abs=4e-3),
            pytest.approx(0.2, abs=4e-3),
        ]


def test_the_ghost_of_a_covers_b_only_where_both_differ(call: Call, tmp_path: Path) -> None:
    """Equal files make the picture of B alone; there is more blue where A is elsewhere."""
    (tmp_path / "a.glb").write_bytes(built("biped"))
    call("optimize", tmp_path / "a.glb", tmp_path / "b.glb", "--max-error", "5%", "--effort", "fast")
    blue = """(() => {
        player.draw();
        const { domElement: { width, height } } = player.stage.renderer;
        const gl = player.stage.renderer.getContext(), pixels = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        let count = 0;
        for (let i = 0; i < pixels.length; i += 4) count += pixels[i + 2] > pixels[i] + 60;
        return count;
    })()"""
    sides = [f"(player.update({{ side: '{side}' }}), {blue})" for side in ("b", "over")]
    found = []
    for name in ("a.glb", "b.glb"):
        call("view", tmp_path / "a.glb", tmp_path / name, "-o", tmp_path / "ab.html").product()
        found += evaluate(tmp_path / "ab.html", [("#clip=jump&t=0.438&show=clay", sides)])
    (alone, equal), (_, different) = found
    assert equal == alone
    assert different > alone + 500


def test_bones_begin_at_joints_with_vertices(asset: Find, call: Call, tmp_path: Path) -> None:
    """Dashes lead to the controls of IK and from the root; ends of chains such as slots of hands are bones."""
    page = tmp_path / "a.html"
    call("view", asset("Knight.glb"), "-o", page).product()
    names = "player.extras[0].bones.{}.map(([parent, child]) => `${{parent.name}} ${{child.name}}`)"
    ((bones, guides),) = evaluate(page, [("#t=0", [names.format("links"), names.format("guides")])])
    assert {"upperleg.l lowerleg.l", "chest head", "hand.l handslot.l"} <= set(bones)
    assert {"root kneeIK.l", "root handIK.r", "root hips", "control-heel-roll.l IK-toe.l"} <= set(guides)
    assert not [link for link in bones if "IK" in link or "control" in link or link.startswith("root ")]


def test_meshes_that_are_not_in_a_bake_are_not_drawn(call: Call, tmp_path: Path) -> None:
    """Neither in the picture nor by its camera; bones, and nodes below those of such meshes, stay."""
    document = container.read(np.frombuffer(built("biped"), np.uint8))
    count = len(document.json["nodes"])
    statue = {"name": "statue", "mesh": 0, "translation": [40, 0, 0]}
    scenes = [{**each, "nodes": [*each["nodes"], count]} for each in document.json["scenes"]]
    json = {**document.json, "nodes": [*document.json["nodes"], statue], "scenes": scenes}
    path, page = tmp_path / "a.glb", tmp_path / "b.html"
    path.write_bytes(b"".join(piece.tobytes() for piece in container.glb(replace(document, json=json))))
    call("bake", path, tmp_path / "a.npz", "--clip", "walk", "--fps", "6", "--html", page)
    tag = "document.querySelector('#tag-a').textContent"
    drawn = "(player.draw(), player.stage.renderer.info.render.calls)"
    codes = ["player.stage.radius < 10", "player.sides.map((side) => side.meshes.length)", tag]
    found = evaluate(page, [("#t=0&side=a", [*codes, drawn])])
    assert found == [[True, [5, 1], "a.glbwithout 1 mesh", 6]]  # with the floor


def test_arrows_leave_out_folded_rows_and_show_those_below_the_filter(
    fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    page = tmp_path / "a.html"
    call("inspect", fixture("biped"), "--html", page).product()
    folded = f"{ROWS}.find((row) => row.closest('details'))"
    before = f"{ROWS}[{ROWS}.indexOf({folded}) - 1]"
    behind = f"{ROWS}.find((row, i) => i > {ROWS}.indexOf({folded}) && !row.closest('details'))"
    row = "document.querySelector('[data-node]:nth-of-type(2)')"
    margin = f"parseFloat(getComputedStyle({row}).scrollMarginTop)"
    filter_px = "document.querySelector('#list-nodes .filter').offsetHeight"
    ((there, is_below),) = evaluate(
        page,
        [
            (
                "#list=report",
                [
                    f"({before}.focus(), {DOWN}, document.activeElement === ({behind} ?? {before}))",
                    f"(player.update({{ tab: 'nodes' }}), {margin} >= {filter_px})",
                ],
            )
        ],
    )
    assert there
    assert is_below


def test_no_legend_of_heat_beside_a_clip_that_the_other_file_lacks(call: Call, tmp_path: Path) -> None:
    document = container.read(np.frombuffer(built("biped"), np.uint8))
    whole, part, page = tmp_path / "a.glb", tmp_path / "b.glb", tmp_path / "ab.html"
    whole.write_bytes(built("biped"))
    shorter = replace(document, json={**document.json, "animations": document.json["animations"][:1]})
    part.write_bytes(b"".join(piece.tobytes() for piece in container.glb(shorter)))
    call("view", whole, part, "-o", page, "--show", "heat").product()
    shown = "!document.querySelector('#legend').hidden"
    codes = [f"(player.chooseClip({clip}), {shown})" for clip in (0, 1, 0)]
    assert evaluate(page, [("", codes)]) == [[True, False, True]]


def test_figures_of_vrm_0_are_seen_from_their_front(call: Call, tmp_path: Path) -> None:
    document = opened_fixture("biped")
    named = {"extensions": {"VRM": {}}, "extensionsUsed": ["VRM"]}
    offset = "player.stage.camera.position.clone().sub(player.stage.controls.target).toArray()"
    keys = [f"({PRESS % key}, {offset})" for key in "137"]
    seen = []
    for json in (document.json, {**document.json, **named}):
        (tmp_path / "a.glb").write_bytes(glb_of(replace(document, json=json)))
        call("view", tmp_path / "a.glb", "-o", tmp_path / "a.html").product()
        seen += evaluate(tmp_path / "a.html", [("", [offset, *keys])])
    assert np.allclose(np.array(seen[1]) * (-1, 1, -1), seen[0], atol=0.02)  # what is framed is not symmetric
    assert seen[0][1][2] > 1
