"""Stamps of outputs: a buffer may be in another folder, as in a .gltf that somebody put in an output's place."""

from __future__ import annotations

import json
from pathlib import Path

from cli.workflows.run.output_stamps import are_unchanged, stamp_output


def test_buffers_are_named_from_the_folder_of_the_settings(tmp_path: Path) -> None:
    buffers = [{"uri": uri, "byteLength": 4} for uri in ("own.bin", "parts/a%20b.bin")]
    (tmp_path / "out/parts").mkdir(parents=True)
    (tmp_path / "out/x.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "buffers": buffers}))
    (tmp_path / "out/own.bin").write_bytes(b"1234")
    (tmp_path / "out/parts/a b.bin").write_bytes(b"1234")
    found = stamp_output(tmp_path, "out/x.gltf")
    assert found is not None
    assert set(found.buffers) == {"out/own.bin", "out/parts/a b.bin"}
    assert are_unchanged(tmp_path, found.buffers)
    (tmp_path / "out/parts/a b.bin").write_bytes(b"12345")
    assert not are_unchanged(tmp_path, found.buffers)
