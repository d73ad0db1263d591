"""Random rigs: the same for a seed, and a judge that finds faults."""

from __future__ import annotations

from pathlib import Path
from random import Random

import numpy as np
import pytest

import fixtures
from anim.gltf.io import container
from anim.gltf.reading import reader
from tests.fuzz.execution import Job
from tests.fuzz.rigs.evaluation import Evaluator
from tests.fuzz.rigs.judgement import judge, rig_job
from tests.fuzz.rigs.rig import make_rig


def _write(job: Job, folder: Path) -> None:
    for name, data in job.files.items():
        (folder / name).write_bytes(data)


def test_a_seed_gives_one_rig() -> None:
    assert make_rig(5) == make_rig(5) != make_rig(6)
    first, second = (rig_job(Random("a")) for _ in range(2))
    assert (first.line, first.files) == (second.line, second.files)


@pytest.mark.parametrize("seed", range(20))
def test_rigs_are_sound(seed: int) -> None:
    document = container.read(np.frombuffer(make_rig(seed), np.uint8))
    assert reader.clips(document)
    assert reader.scene(document).instances


@pytest.mark.slow
def test_another_motion_is_a_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A judge that accepts everything finds nothing: here the output is a rig with a node elsewhere."""
    monkeypatch.chdir(tmp_path)
    jobs = [job for seed in range(200) if "diff" in (job := rig_job(Random(f"{seed}"))).line]
    num_faults = 0
    for job in jobs[:4]:
        _write(job, tmp_path)
        (tmp_path / "out.glb").write_bytes(job.files["other.glb"])
        stated = judge(["resample", "rig.glb", "out.glb"], "max 0 mm", b"")
        bound = judge(["optimize", "rig.glb", "out.glb", "--max-error", "0.0001%"], "", b"")
        difference = judge(job.line, "", b'{"clips": [{"max_error_m": 0}]}')
        assert bool(stated) == bool(bound) == bool(difference)
        num_faults += bool(bound)
    assert num_faults > 1


def test_the_evaluator_bends_the_arm(tmp_path: Path) -> None:
    """The tip, 0.3 m above the upper joint at 0.3 m, is at the joint's height after 90°."""
    (tmp_path / "arm.glb").write_bytes(fixtures.build("arm"))
    arm = Evaluator(str(tmp_path / "arm.glb"))
    times = arm.key_times(1)[[0, -1]]
    rest, bent = arm.vertices(None, np.zeros(1)), arm.vertices(1, times)
    (node,) = rest
    np.testing.assert_allclose(bent[node][0], rest[node][0], atol=1e-6)
    np.testing.assert_allclose(rest[node][0, :, 1].max(), 0.6, atol=1e-6)
    tip = arm.worlds(1, times)[1][:, :3] @ (0.0, 0.3, 0.0, 1.0)
    np.testing.assert_allclose(tip[:, 1], (0.6, 0.3), atol=1e-6)
