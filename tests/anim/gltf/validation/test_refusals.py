"""Malformed files: each is refused in one clear line, at once, or read for a reason that is written down here.

Two sets: the Khronos validator's own test files with its reports (shared/bad-inputs), and fixtures.BROKEN.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

import fixtures
from anim.errors import AnimError, FormatError, UnsupportedError
from anim.gltf.document import Document
from anim.gltf.reading import reader
from tests.files import BAD_INPUTS, opened, opened_path

# A word of the refusal, or OK, when the file is read, then its clips, then its scene. Buffers are opened when needed
# only, so faults in those that nothing needs don't show.
OK = ""
OUTCOMES = {
    "accessor/alignment.gltf": "byteOffset",
    "accessor/byteoffset_no_bufferview.gltf": OK,
    "accessor/custom_property.gltf": OK,
    "accessor/empty_array.gltf": OK,
    "accessor/empty_object.gltf": "componentType",
    "accessor/float_normalized.gltf": OK,
    "accessor/invalid_sparse_count_and_stride.gltf": "sparse.count",
    "accessor/matrix_alignment.gltf": "byteOffset",
    "accessor/small_stride.gltf": "byteStride",
    "accessor/unknown_type.gltf": OK,
    "accessor/unresolved_bufferviews.gltf": "bufferView",
    "accessor/valid.gltf": OK,
    "animation/channel_duplicate_targets.gltf": "second channel",
    "animation/channel_node_matrix.gltf": OK,
    "animation/channel_node_no_morphs.gltf": "morph targets",
    "animation/custom_property.gltf": OK,
    "animation/empty_array.gltf": OK,
    "animation/empty_objects.gltf": "channels",
    "animation/sampler_bufferview_bytestride.gltf": "no data",
    "animation/sampler_input_format_invalid.gltf": "input accessor",
    "animation/sampler_input_no_bounds.gltf": OK,
    "animation/sampler_output_count_invalid.gltf": "output accessor",
    "animation/sampler_output_format_invalid.gltf": "VEC4",
    "animation/sampler_too_few_cubic_frames.gltf": "CUBICSPLINE with one key",
    "animation/unresolved_channel_sampler.gltf": "sampler",
    "animation/unresolved_channel_target.gltf": "node",
    "animation/unresolved_sampler_input.gltf": "input",
    "animation/unresolved_sampler_output.gltf": "output",
    "animation/valid.gltf": "not increasing",
    "buffer/custom_property.gltf": OK,
    "buffer/data_uri.glb": OK,
    "buffer/empty_array.gltf": OK,
    "buffer/empty_object.gltf": "byteLength",
    "buffer/extra_padding.glb": OK,
    "buffer/invalid_object.gltf": "is an array",
    "buffer/invalid_uri_data.glb": OK,
    "buffer/invalid_uri_data.gltf": OK,
    "buffer/invalid_uri_data_bytelength.gltf": "byteLength",
    "buffer/invalid_uri_data_mime.gltf": OK,
    "buffer/invalid_uri_scheme.gltf": OK,
    "buffer/no_bin_chunk.glb": "no BIN chunk",
    "buffer/non_relative_uri.gltf": OK,
    "buffer/not_found.gltf": OK,
    "buffer/valid.glb": OK,
    "buffer/valid.gltf": OK,
    "buffer/valid_placeholder.glb": OK,
    "buffer/wrong_bytelength.glb": "byteLength",
    "buffer/zero_bytelength.gltf": "byteLength",
    "glb/bom.glb": "byte order mark",
    "glb/chunk_too_big.glb": "cut off",
    "glb/empty_file.glb": "empty",
    "glb/empty_json_chunk.glb": "JSON is broken",
    "glb/empty_json_object.glb": "asset",
    "glb/extra_data.glb": OK,
    "glb/invalid_json_chunk.glb": "JSON is broken",
    "glb/invalid_magic.glb": "is no glTF",
    "glb/invalid_version.glb": "version",
    "glb/json_and_two_buffers.glb": "second or misplaced BIN",
    "glb/length_mismatch.glb": "truncated",
    "glb/misplaced_bin_chunk.glb": "second or misplaced BIN",
    "glb/no_header.glb": "is no glTF",
    "glb/only_bin_chunk.glb": "first chunk",
    "glb/only_header.glb": "no JSON chunk",
    "glb/truncated_chunk_data.glb": "truncated",
    "glb/truncated_chunk_header.glb": "cut off",
    "glb/two_bin_chunks.glb": "first chunk",
    "glb/two_empty_bin_chunks.glb": "first chunk",
    "glb/two_empty_json_chunks.glb": "JSON is broken",
    "glb/two_images.glb": OK,
    "glb/two_valid_json_chunks.glb": "second or misplaced JSON",
    "glb/unaligned_chunk.glb": "multiple of 4",
    "glb/unknown_chunk.glb": "first chunk",
    "glb/valid.glb": OK,
    "glb/valid_buffer.glb": OK,
    "glb/zero_chunk_header.glb": "first chunk",
    "glb/zero_length.glb": "wrong length",
    "skin/buffer_view_bytestride.gltf": "no data",
    "skin/custom_property.gltf": OK,
    "skin/empty_array.gltf": OK,
    "skin/empty_joints_array.gltf": "no joints",
    "skin/empty_object.gltf": "joints",
    "skin/ibm_invalid_count.gltf": "2 matrices for 3 joints",
    "skin/ibm_invalid_format.gltf": "MAT3",
    "skin/ignored_animated_transform.gltf": "not increasing",
    "skin/ignored_local_transform.gltf": OK,
    "skin/ignored_parent_transform.gltf": OK,
    "skin/no_common_root.gltf": OK,
    "skin/no_joints_in_scene.gltf": OK,
    "skin/skeleton_invalid.gltf": OK,
    "skin/unresolved_ibm.gltf": "inverseBindMatrices",
    "skin/unresolved_joint.gltf": "joints",
    "skin/unresolved_skeleton.gltf": "skeleton",
    "skin/valid.gltf": OK,
}

# Files with validator errors that are read all the same: the fault leaves no doubt about what is meant.
ACCEPTED = {
    "accessor/byteoffset_no_bufferview.gltf": "the offset is 0 and refers to nothing",
    "accessor/empty_array.gltf": "an empty array says the same as none",
    "accessor/float_normalized.gltf": "floats can't be normalised; the mark says nothing",
    "animation/channel_node_matrix.gltf": "the matrix is taken apart into translation, rotation and scale",
    "animation/empty_array.gltf": "an empty array says the same as none",
    "animation/sampler_input_no_bounds.gltf": "the bounds follow from the data",
    "buffer/empty_array.gltf": "an empty array says the same as none",
    "buffer/invalid_uri_data.glb": "nothing needs the buffer",
    "buffer/invalid_uri_data.gltf": "nothing needs the buffer",
    "buffer/invalid_uri_data_mime.gltf": "nothing needs the buffer",
    "buffer/invalid_uri_scheme.gltf": "nothing needs the buffer",
    "buffer/not_found.gltf": "nothing needs the buffer",
    "skin/empty_array.gltf": "an empty array says the same as none",
    "skin/no_common_root.gltf": "world matrices don't depend on it",
    "skin/no_joints_in_scene.gltf": "world matrices don't depend on it",
    "skin/skeleton_invalid.gltf": "the property is only a hint",
}
# Files without validator errors that are refused all the same.
REFUSED = {
    "animation/valid.gltf": "key times without data are zeros, which don't increase; the validator doesn't look",
    "skin/ignored_animated_transform.gltf": "the same",
}

# What reading the buffers' own data adds, for the files whose buffers nothing needs.
NEEDED = {
    "buffer/invalid_uri_data.glb": "broken data URI",
    "buffer/invalid_uri_data.gltf": "broken data URI",
    "buffer/invalid_uri_data_mime.gltf": "media type",
    "buffer/invalid_uri_scheme.gltf": "':' is not beside",
    "buffer/non_relative_uri.gltf": "has a scheme",
    "buffer/not_found.gltf": "is not beside",
    "buffer/custom_property.gltf": "no data",
}

# Fixtures that reading alone doesn't refuse.
ELSEWHERE = {"unknown_required_extension": "every command decides by itself which extensions concern it"}
EXIT = {3: FormatError, 4: UnsupportedError}

Find = Callable[[str], Path]


@pytest.mark.parametrize("name", OUTCOMES)
def test_the_validators_files(name: str, bad_input: Find) -> None:
    path = bad_input(name)
    refusal = _refusal(lambda: opened_path(path))
    _check(refusal, FormatError, OUTCOMES[name])


@pytest.mark.parametrize("name", OUTCOMES)
def test_we_and_the_validator_agree_but_for_listed_reasons(name: str, bad_input: Find) -> None:
    path = bad_input(name)
    report = json.loads(path.with_name(path.name + ".report.json").read_text())
    is_refused = bool(OUTCOMES[name])
    has_errors = report["issues"]["numErrors"] > 0
    assert (name in ACCEPTED) == (has_errors and not is_refused)
    assert (name in REFUSED) == (is_refused and not has_errors)


def test_no_file_of_the_validator_is_forgotten() -> None:
    if not BAD_INPUTS.is_dir():
        pytest.skip("shared/bad-inputs is not there")
    found = {path.relative_to(BAD_INPUTS).as_posix() for path in BAD_INPUTS.rglob("*.gl*") if path.suffix != ".json"}
    assert found == set(OUTCOMES)


@pytest.mark.parametrize("name", NEEDED)
def test_buffers_at_fault_are_refused_when_they_are_needed(name: str, bad_input: Find) -> None:
    document = opened_path(bad_input(name))
    with pytest.raises(FormatError) as caught:
        _ = document.buffers[0].data
    assert str(caught.value).startswith("buffer 0: ")
    assert NEEDED[name] in str(caught.value)


@pytest.mark.parametrize("name", fixtures.BROKEN)
def test_broken_fixtures(name: str) -> None:
    case = fixtures.BROKEN[name]
    refusal = _refusal(lambda: opened(case.data, {}))
    _check(refusal, EXIT[case.exit_code], OK if name in ELSEWHERE else case.word)


def _refusal(read_document: Callable[[], Document]) -> AnimError | None:
    """Return why a file, its clips or its scene is refused, None if all are read."""
    try:
        document = read_document()
        reader.clips(document)
        reader.scene(document)
    except AnimError as error:
        return error
    return None


def _check(refusal: AnimError | None, kind: type[AnimError], word: str) -> None:
    assert bool(refusal) == bool(word), refusal
    if refusal is not None:
        assert type(refusal) is kind
        assert word.lower() in str(refusal).lower()
        assert "\n" not in str(refusal)
        assert len(str(refusal)) < 300
