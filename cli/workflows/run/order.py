"""Order of jobs: one whose steps read the output of another comes after it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

from cli.errors import UsageError
from cli.workflows.run.job import Job
from cli.workflows.run.places import output_key
from cli.workflows.run.steps import Step


def group_jobs(jobs: Sequence[Job]) -> list[list[Job]]:
    """Return jobs in groups, of which each reads, by files of its steps, only outputs of groups before it.

    Within a group jobs keep their order. Raises UsageError for jobs that read each other's outputs.
    """
    makers = {output_key(job.output): job for job in jobs}
    needed = {steps: [makers[key].steps for key in keys_read(steps, makers)] for steps in {job.steps for job in jobs}}
    if not any(needed.values()):
        return [list(jobs)]
    sorter = TopologicalSorter(needed)
    try:
        sorter.prepare()
    except CycleError as error:
        names = {makers[key].output for steps in error.args[1] for key in keys_read(steps, makers)}
        problem = f"{' and '.join(map(repr, sorted(names)))} can't be made: steps read the output of each other"
        raise UsageError(problem) from None
    groups = []
    while ready := set(sorter.get_ready()):
        groups.append([job for job in jobs if job.steps in ready])
        sorter.done(*ready)
    return groups


def keys_read(steps: Sequence[Step], outputs: Mapping[str, object]) -> Iterator[str]:
    """Yield the keys of outputs that steps read by their options. outputs: by `output_key`."""
    keys = (output_key(name) for step in steps for name in step.files)
    return (key for key in keys if key in outputs)
