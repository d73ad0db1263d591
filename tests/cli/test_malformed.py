"""Malformed files through three commands: the exit code that each must have, one line, and nothing half-written."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

import fixtures
from tests.cli.conftest import Call
from tests.cli.running import ROOT, Run, refusal
from tests.cli.sweep import Outcome
from tests.files import BAD_INPUTS

SLOW = 10.0  # s of CPU time, for one run: usually 0.01, which no load of the machine lifts to this
LARGE = 300e6  # bytes, of the process that runs them all

# Exit codes of `inspect FILE`, `resample FILE out.glb --fps 30` and `convert FILE out.glb`. What `convert` doesn't need
# to look at (keys, nodes' rotations) it carries over as it is.
BROKEN = {
    "empty_file": "333",
    "truncated_glb": "333",
    "wrong_magic": "333",
    "glb_version_1": "333",
    "bad_json": "333",
    "not_utf8": "333",
    "nan_in_json": "333",
    "huge_number": "333",
    "huge_integer": "333",
    "deep_nesting": "333",
    "deep_extras": "333",
    "lfs_pointer": "333",
    "accessor_out_of_view": "333",
    "view_out_of_buffer": "333",
    "buffer_too_short": "333",
    "missing_view": "333",
    "unknown_component_type": "333",
    "huge_count": "444",
    "sparse_index_out_of_range": "330",
    "sparse_not_increasing": "330",
    "uri_parent": "333",
    "uri_parent_encoded": "333",
    "uri_absolute": "333",
    "uri_http": "333",
    "missing_external": "333",
    "bad_data_uri": "333",
    "times_not_increasing": "330",
    "times_equal": "330",
    "times_negative": "330",
    "nan_in_output": "330",
    "nan_in_times": "330",
    "wrong_output_count": "330",
    "wrong_cubic_count": "330",
    "cubic_one_key": "330",
    "unknown_interpolation": "330",
    "integer_times": "330",
    "wrong_output_type": "330",
    "missing_sampler": "333",
    "missing_node": "333",
    "duplicate_target": "333",
    "matrix_node": "333",
    "weights_without_targets": "330",
    "node_cycle": "333",
    "node_own_child": "333",
    "two_parents": "333",
    "missing_child": "333",
    "joints_out_of_range": "000",  # vertices: a finding of inspect, and nothing that keys need
    "missing_joint_node": "333",
    "rotation_zero": "330",
    "nodes_not_array": "333",
    "negative_index": "333",
    "no_asset": "333",
    "version_1": "333",
    "unknown_required_extension": "000",  # passes through, and inspect says so
    "draco": "000",  # the same: only what needs vertices refuses
}
KHRONOS = {
    "accessor/alignment.gltf": "333",
    "accessor/byteoffset_no_bufferview.gltf": "000",
    "accessor/custom_property.gltf": "000",
    "accessor/empty_array.gltf": "000",
    "accessor/empty_object.gltf": "333",
    "accessor/float_normalized.gltf": "000",
    "accessor/invalid_sparse_count_and_stride.gltf": "333",
    "accessor/matrix_alignment.gltf": "333",
    "accessor/small_stride.gltf": "333",
    "accessor/unknown_type.gltf": "000",
    "accessor/unresolved_bufferviews.gltf": "333",
    "accessor/valid.gltf": "044",  # its buffer has no data, which a GLB can't express
    "animation/channel_duplicate_targets.gltf": "333",
    "animation/channel_node_matrix.gltf": "000",
    "animation/channel_node_no_morphs.gltf": "330",
    "animation/custom_property.gltf": "000",
    "animation/empty_array.gltf": "000",
    "animation/empty_objects.gltf": "333",
    "animation/sampler_bufferview_bytestride.gltf": "334",
    "animation/sampler_input_format_invalid.gltf": "330",
    "animation/sampler_input_no_bounds.gltf": "000",
    "animation/sampler_output_count_invalid.gltf": "330",
    "animation/sampler_output_format_invalid.gltf": "330",
    "animation/sampler_too_few_cubic_frames.gltf": "330",
    "animation/unresolved_channel_sampler.gltf": "333",
    "animation/unresolved_channel_target.gltf": "333",
    "animation/unresolved_sampler_input.gltf": "333",
    "animation/unresolved_sampler_output.gltf": "333",
    "animation/valid.gltf": "330",  # two key times of 0, which the validator doesn't see
    "buffer/custom_property.gltf": "044",
    "buffer/data_uri.glb": "000",
    "buffer/empty_array.gltf": "000",
    "buffer/empty_object.gltf": "333",
    "buffer/extra_padding.glb": "000",
    "buffer/invalid_object.gltf": "333",
    "buffer/invalid_uri_data.glb": "333",
    "buffer/invalid_uri_data.gltf": "333",
    "buffer/invalid_uri_data_bytelength.gltf": "333",
    "buffer/invalid_uri_data_mime.gltf": "333",
    "buffer/invalid_uri_scheme.gltf": "333",
    "buffer/no_bin_chunk.glb": "333",
    "buffer/non_relative_uri.gltf": "333",
    "buffer/not_found.gltf": "333",
    "buffer/valid.glb": "000",
    "buffer/valid.gltf": "000",
    "buffer/valid_placeholder.glb": "000",
    "buffer/wrong_bytelength.glb": "333",
    "buffer/zero_bytelength.gltf": "333",
    "glb/bom.glb": "333",
    "glb/chunk_too_big.glb": "333",
    "glb/empty_file.glb": "333",
    "glb/empty_json_chunk.glb": "333",
    "glb/empty_json_object.glb": "333",
    "glb/extra_data.glb": "000",
    "glb/invalid_json_chunk.glb": "333",
    "glb/invalid_magic.glb": "333",
    "glb/invalid_version.glb": "333",
    "glb/json_and_two_buffers.glb": "333",
    "glb/length_mismatch.glb": "333",
    "glb/misplaced_bin_chunk.glb": "333",
    "glb/no_header.glb": "333",
    "glb/only_bin_chunk.glb": "333",
    "glb/only_header.glb": "333",
    "glb/truncated_chunk_data.glb": "333",
    "glb/truncated_chunk_header.glb": "333",
    "glb/two_bin_chunks.glb": "333",
    "glb/two_empty_bin_chunks.glb": "333",
    "glb/two_empty_json_chunks.glb": "333",
    "glb/two_images.glb": "000",
    "glb/two_valid_json_chunks.glb": "333",
    "glb/unaligned_chunk.glb": "333",
    "glb/unknown_chunk.glb": "333",
    "glb/valid.glb": "000",
    "glb/valid_buffer.glb": "000",
    "glb/zero_chunk_header.glb": "333",
    "glb/zero_length.glb": "333",
    "skin/buffer_view_bytestride.gltf": "044",
    "skin/custom_property.gltf": "000",
    "skin/empty_array.gltf": "000",
    "skin/empty_joints_array.gltf": "333",
    "skin/empty_object.gltf": "333",
    "skin/ibm_invalid_count.gltf": "333",
    "skin/ibm_invalid_format.gltf": "333",
    "skin/ignored_animated_transform.gltf": "330",  # two key times of 0 again
    "skin/ignored_local_transform.gltf": "000",
    "skin/ignored_parent_transform.gltf": "000",
    "skin/no_common_root.gltf": "000",
    "skin/no_joints_in_scene.gltf": "000",
    "skin/skeleton_invalid.gltf": "000",
    "skin/unresolved_ibm.gltf": "333",
    "skin/unresolved_joint.gltf": "333",
    "skin/unresolved_skeleton.gltf": "333",
    "skin/valid.gltf": "000",
}

# Files on which a warning comes before the refusal: the surface can't be measured, then the output can't be made.
NOTED = {"skin/buffer_view_bytestride.gltf"}


class Case(NamedTuple):
    """One file, the exit codes it must have, and where the outputs were to go."""

    path: Path
    codes: str
    folder: Path

    def lines(self) -> list[list[str]]:
        path, out = str(self.path), str(self.folder / "out.glb")
        return [["inspect", path], ["resample", path, out, "--fps", "30"], ["convert", path, out]]


Swept = dict[str, tuple[Case, list[Outcome]]]


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Swept:
    """Every malformed file through three commands, in one process whose memory is watched."""
    folder = tmp_path_factory.mktemp("bad")
    cases = {}
    for name, codes in {**BROKEN, **KHRONOS}.items():
        if name in BROKEN:
            path = folder / f"{name}{fixtures.BROKEN[name].suffix}"
            path.write_bytes(fixtures.BROKEN[name].data)
        else:
            path = BAD_INPUTS / name
        if path.is_file():
            outputs = folder / "out" / name
            outputs.mkdir(parents=True)
            cases[name] = Case(path, codes, outputs)
    lines = [line for case in cases.values() for line in case.lines()]
    run = subprocess.run(
        [sys.executable, "-m", "tests.cli.sweep"],
        input=json.dumps(lines).encode(),
        cwd=ROOT,
        capture_output=True,
        check=True,
    )
    found: list[Outcome] = json.loads(run.stdout)
    return {name: (case, found[3 * i : 3 * i + 3]) for i, (name, case) in enumerate(cases.items())}


@pytest.mark.parametrize("name", [*BROKEN, *KHRONOS])
def test_malformed_files(name: str, swept: Swept) -> None:
    if name not in swept:
        pytest.skip(f"shared/bad-inputs/{name} is not there")
    case, outcomes = swept[name]
    assert "".join(str(code) for code, *_ in outcomes) == case.codes, [err for _, _, err, _, _ in outcomes]
    for line, (code, printed, err, seconds, _) in zip(case.lines(), outcomes, strict=True):
        assert seconds < SLOW, line
        if code:
            if line[0] == "inspect" and printed:  # a report of what can be read comes first
                printed = 0
            said = err if not (name in NOTED and err.startswith("warning: ")) else err.partition("\n")[2]
            message = refusal(Run(code, b"x" * printed, said), code)
            assert message.startswith(f"gltf-anim: {case.path}: ")
            assert len(message) < 300 + len(str(case.path))
            assert "Traceback" not in err
    is_written = (case.folder / "out.glb").exists()
    assert is_written == ("0" in case.codes[1:])
    assert len(list(case.folder.iterdir())) == is_written


def test_malformed_files_never_take_much_memory(swept: Swept) -> None:
    assert max(outcome[4] for _, outcomes in swept.values() for outcome in outcomes) < LARGE


@pytest.mark.parametrize("name", [name for name, codes in BROKEN.items() if codes != "000"])
def test_the_message_names_the_fault(name: str, swept: Swept) -> None:
    _, outcomes = swept[name]
    assert outcomes[0][0] == fixtures.BROKEN[name].exit_code
    assert fixtures.BROKEN[name].word.lower() in outcomes[0][2].splitlines()[0].lower()


def test_the_tables_are_complete() -> None:
    assert list(BROKEN) == list(fixtures.BROKEN)
    if BAD_INPUTS.is_dir():
        found = {
            path.relative_to(BAD_INPUTS).as_posix() for path in BAD_INPUTS.rglob("*.gl*") if path.suffix != ".json"
        }
        assert found == set(KHRONOS)


def test_a_failed_run_leaves_the_old_output(call: Call, tmp_path: Path) -> None:
    out = tmp_path / "out.glb"
    out.write_bytes(b"precious")
    refusal(call("resample", "-", out, "--fps", "30", stdin=fixtures.BROKEN["times_equal"].data), 3)
    refusal(call("convert", "-", out, stdin=fixtures.BROKEN["bad_json"].data), 3)
    assert out.read_bytes() == b"precious"
    assert list(tmp_path.iterdir()) == [out]
