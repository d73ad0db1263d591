"""Workers of a cluster: those of a dask scheduler, which Slurm, Kubernetes and others can start."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

from anim.errors import UnsupportedError
from cli.errors import UsageError

MAX_CONNECT_S = 10
QUEUES = ("slurm", "pbs", "sge", "lsf", "oar", "htcondor", "kubernetes", "k8s")  # whose own tools start workers
MIN_JOBS_AT_A_TIME = 64  # waiting jobs are what an adaptive cluster grows by


@dataclass(frozen=True)
class Cluster:
    """A connected scheduler. count: of jobs that it gets at a time."""

    client: Any
    count: int

    def open_pool(self, count: int) -> AbstractContextManager[Executor]:
        """Provide the scheduler's workers as a pool, which is the same for any number."""
        return _opened(self.client.get_executor(pure=False))


@contextmanager
def connect_cluster(address: str) -> Iterator[Cluster]:
    """Connect to a scheduler: tcp://host:port, or the .json file that `dask scheduler --scheduler-file` writes.

    Its workers see the files under the same names. Raises UnsupportedError without dask, and UsageError for an address
    without a scheduler.
    """
    try:
        from distributed import Client
    except ImportError:
        problem = "--scheduler needs the package distributed"
        raise UnsupportedError(problem, help="pip install 'gltf-anim[cluster]'") from None
    if system := next((each for each in QUEUES if address.lower().startswith(each)), ""):
        raise UsageError(
            f"--scheduler {address}: {system} starts dask's workers, it is no address of a scheduler",
            help="srun, or SLURMCluster of dask-jobqueue: see Clusters in docs/recipes.md",
        )
    named = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    try:
        client = Client(**named, timeout=MAX_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        words = str(error).split("\n")[0]
        raise UsageError(
            f"--scheduler {address}: can't be reached ({words})", help="`dask scheduler` prints its address: tcp://…"
        ) from None
    with client:
        threads = sum(client.nthreads().values())
        yield Cluster(client, max(2 * threads, MIN_JOBS_AT_A_TIME))


@contextmanager
def _opened(pool: Executor) -> Iterator[Executor]:
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False)  # waiting jobs are cancelled
        raise
