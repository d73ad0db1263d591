"""Devices and pipes that never end: refused by their first bytes, or at a limit."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, refusal, shell

needs_devices = pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no /dev/zero")


@needs_devices
@pytest.mark.parametrize("line", ["inspect /dev/zero", "inspect < /dev/zero", "optimize /dev/urandom out.glb"])
def test_what_never_ends_is_no_gltf(line: str, tmp_path: Path) -> None:
    assert "is no glTF" in refusal(shell(f"ulimit -v 4000000; gltf-anim {line}", tmp_path), 3)


ENDLESS = (
    "from-euler /dev/zero out.glb",
    "from-euler z.bvh out.glb",
    "from-euler - out.glb < /dev/zero",
    "yes 'v 1 2 3' | gltf-anim render - out.png",
    "check arm.glb --baseline /dev/zero",
    "simulate springs arm.glb out.glb --clip '#0' --springs /dev/zero",
    "simulate cloth arm.glb out.npz --clip '#0' --colliders /dev/zero",
    "mkfifo a.usda; yes '#usda' > a.usda & gltf-anim convert-cache a.usda out.npz",
)


@needs_devices
@pytest.mark.parametrize("line", ENDLESS)
def test_other_inputs_that_never_end_are_refused(line: str, tmp_path: Path) -> None:
    (tmp_path / "arm.glb").write_bytes(built("arm"))
    (tmp_path / "z.bvh").symlink_to("/dev/zero")
    line = line if "gltf-anim" in line else f"gltf-anim {line}"
    done = shell(f"ulimit -v 4000000; ulimit -f 200000; {line} --memory-limit 50MB", tmp_path)
    assert "is a pipe or device with more than 0.05 GB" in refusal(done, 4)


@needs_devices
def test_a_device_does_not_fill_the_disk(tmp_path: Path) -> None:
    line = "ulimit -f 200000; gltf-anim convert-cache - out.npz"
    assert "stdin: is a device" in refusal(shell(f"{line} < /dev/zero", tmp_path), 3)
    assert "stdin: is empty" in refusal(shell(f"{line} < /dev/null", tmp_path), 3)


def test_settings_of_a_pipe_are_limited_in_length(call: Call, tmp_path: Path) -> None:
    """Whatever the memory limit: what never ends is no settings."""
    (tmp_path / "arm.glb").write_bytes(built("arm"))
    done = shell("ulimit -v 4000000; yes | gltf-anim check arm.glb --baseline -", tmp_path)
    assert "more than 0.064 GB" in refusal(done, 4)
    call("check", tmp_path / "arm.glb", "--write-baseline", tmp_path / "known.json").product()
    assert shell("cat known.json | gltf-anim check arm.glb --baseline -", tmp_path).code == 0


@pytest.mark.parametrize("stream", ["yes '{'", "yes ' '", "(printf 'glTF\\2\\0\\0\\0\\0\\1\\0\\0'; yes)"])
def test_a_pipe_that_never_ends_is_refused(stream: str, tmp_path: Path) -> None:
    done = shell(f"ulimit -v 4000000; {stream} | gltf-anim inspect --memory-limit 20MB -", tmp_path)
    assert "stdin: is a pipe or device with more than 0.02 GB" in refusal(done, 4)
