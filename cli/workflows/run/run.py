"""A run: looks results up, lets workers make the others, and reports and records each file."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from itertools import chain

from anim.units import plural
from cli import errors
from cli.errors import run_guarded
from cli.progress import Progress
from cli.streams import StepStreams, use_streams
from cli.text import Reporter, format_change, format_duration
from cli.workflows.run.cache import FileHashes, ResultCache, path_key, recipe_key, result_key
from cli.workflows.run.cluster import Cluster
from cli.workflows.run.job import (
    EMPTY,
    Job,
    JobResult,
    WrittenOutput,
    input_size,
    is_text,
    write_output,
)
from cli.workflows.run.journal import CACHED, DONE_BEFORE, FAILED, MADE, STATUSES, Journal, JournalEntry
from cli.workflows.run.order import group_jobs, keys_read
from cli.workflows.run.output_stamps import OutputStamps, stamp_output
from cli.workflows.run.outputs import WrittenFiles
from cli.workflows.run.places import output_key
from cli.workflows.run.run_job import is_notice, run_job
from cli.workflows.run.stamps import is_changed_since, stamp_of, stamp_read, status_of
from cli.workflows.run.steps import Step
from cli.workflows.run.workers import local_pool, run_jobs

MISSING_HELP = (
    "files without the clip or node that a step selects need a recipe of their own, above this one: "
    "of two recipes with the same output the first counts"
)


@dataclass
class RecipeRun:
    """A run of jobs.

    cache: None to keep no results. processes: of this machine. cluster: its workers instead of these.
    written: outputs that are complete, and images beside them. code: the largest exit code.
    """

    jobs: Sequence[Job]
    journal: Journal
    cache: ResultCache | None
    reporter: Reporter
    processes: int
    cluster: Cluster | None = None
    written: WrittenFiles = field(default_factory=WrittenFiles)
    counts: Counter[str] = field(default_factory=Counter)
    code: int = errors.DONE
    _hashes: FileHashes = field(default_factory=FileHashes)
    _recipes: dict[tuple[Step, ...], str] = field(default_factory=dict)
    _failed: dict[str, tuple[str, int]] = field(default_factory=dict)  # outputs and exit codes, by `output_key`

    def run(self) -> int:
        """Run all jobs; return the largest exit code."""
        began, self._began_ns = time.perf_counter(), time.time_ns()
        self._progress = Progress("", len(self.jobs), shown=not self.reporter.quiet)
        try:
            for group in group_jobs(self.jobs):
                with closing(self._results(group)) as results:  # ends the workers
                    for job, result in results:
                        self._record(job, result, MADE if result.code == errors.DONE else FAILED)
        except (KeyboardInterrupt, SystemExit):
            self._progress.close()
            self.reporter.info(
                f"ended after {self.counts.total()} of {plural(len(self.jobs), 'file')}: --resume continues"
            )
            raise
        finally:
            self._progress.close()
        counts = [f"{self.counts[each]} {each}" for each in STATUSES if self.counts[each]]
        took = format_duration(time.perf_counter() - began)
        self.reporter.info(f"{plural(len(self.jobs), 'file')}: {', '.join(counts)}, {took}")
        if errors.NOT_FOUND in (code for _, code in self._failed.values()):
            self.reporter.info(f"help: {MISSING_HELP}")
        self.journal.write_line({"end": {**self.counts, "code": self.code}})
        return self.code

    def _results(self, group: Sequence[Job]) -> Generator[tuple[Job, JobResult], None, None]:
        """Yield the jobs of a group that have no known result, each with its new one."""
        count = min(self.processes, len(group))  # of this machine, at a time
        missing = self._look_up(group, cores=1 if self.cluster else max(1, self.processes // count))
        if len(self.jobs) == 1 and self.cluster is None:  # in this process: starting another takes longer
            yield from ((job, run_job(job)) for job in missing)
            return
        first = next(missing, None)
        if first is not None:
            pool, count = (local_pool, count) if self.cluster is None else (self.cluster.open_pool, self.cluster.count)
            yield from run_jobs(chain([first], missing), pool, count)

    def _look_up(self, group: Sequence[Job], *, cores: int) -> Iterator[Job]:
        """Yield the jobs without a known result; of others, write the output."""
        for each in group:
            if (lacking := self._find_lacking(each)) is not None:
                self._record(each, lacking, FAILED)
                continue
            job = replace(each, cores=cores)
            recipe = self._recipe(job)
            done = self.journal.find_done(job.folder, job.input, job.output, recipe)
            if done is not None:
                before = input_size(job) if self.reporter.verbose else 0  # for the line of --verbose
                files = done.files or {}
                stamps = None if done.output_stamp is None else OutputStamps(done.output_stamp, done.buffers, {})
                result = JobResult(
                    errors.DONE, done.messages, done.size, done.input_stamp, 0.0, before, files, stamps=stamps
                )
                self._record(job, result, DONE_BEFORE)
            elif self.cache is None:
                yield job
            else:
                began_ns, path = time.time_ns(), os.path.join(job.folder, job.input)
                status, digest = status_of(path), self._hashes.hash(path)  # in this order
                key = result_key(recipe, job.steps, job.input, digest)
                keyed = replace(job, cache=self.cache.folder, key=key, status=status)
                found = self._from_cache(keyed, self.cache, began_ns)
                if found is None:
                    yield keyed
                else:
                    self._record(job, found, CACHED if found.code == errors.DONE else FAILED)

    def _find_lacking(self, job: Job) -> JobResult | None:
        """The result of a job whose steps read an output that failed; None of any other."""
        key = next(keys_read(job.steps, self._failed), None)
        if key is None:
            return None
        failed, code = self._failed[key]
        return JobResult(code, (f"{errors.PROGRAM}: {job.input}: its steps read '{failed}', which was not made",))

    def _from_cache(self, job: Job, cache: ResultCache, began_ns: int) -> JobResult | None:
        """The result of a job from the cache, with its output written; None if there is none.

        began_ns: time before its key was made.
        """
        began = time.perf_counter()
        keys = job.key, path_key(job.key, job.input)
        records = (cache.find(key, job.folder, self._hashes) for key in keys)
        record = next(filter(None, records), None)
        if record is None:
            return None
        cache.mark_used(record)
        stamp = stamp_of(job.folder / job.input)
        output = os.path.join(job.folder, job.output)
        if record.is_plain and not is_text(output) and self._hashes.hash(output) == record.product:
            others = stamp_read(job.folder, [job.input, *record.files], began_ns)
            if others is not None:
                others.pop(os.path.normpath(job.input))
            before, measured = input_size(job), tuple(record.step_errors)
            stamps = stamp_output(job.folder, job.output)
            return JobResult(errors.DONE, (), record.size, stamp, 0.0, before, others, (), measured, stamps)
        product = cache.product(record)
        if product is None:
            return None
        streams = StepStreams(job.input, EMPTY, job.folder)
        written = WrittenOutput()

        def write() -> None:
            nonlocal written
            written = write_output(job, product, record.files, began_ns)

        with use_streams(streams):
            code = run_guarded(write)
        seconds = time.perf_counter() - began
        size, files, copies, stamps = written
        messages, measured = tuple(streams.messages), tuple(record.step_errors)
        return JobResult(code, messages, size, stamp, seconds, input_size(job), files, copies, measured, stamps)

    def _recipe(self, job: Job) -> str:
        if job.steps not in self._recipes:
            self._recipes[job.steps] = recipe_key(job.steps, job.folder, self._hashes)
        return self._recipes[job.steps]

    def _record(self, job: Job, result: JobResult, status: str) -> None:
        self.counts[status] += 1
        if status == FAILED:
            self._failed[output_key(job.output)] = job.output, result.code
            result = replace(result, messages=(*result.messages, self._describe_failed(job, result)))
        else:
            self.written.add(job.output, job.input, result.stamps)
        self.code = max(self.code, result.code)
        self._progress.close()
        self._report(job, result, status)
        self._progress(self.counts.total(), f"{self.counts.total()} of {len(self.jobs)}, {job.input}")
        self.journal.write(
            JournalEntry(
                job.input,
                job.output,
                self._recipe(job),
                status,
                result.code,
                round(result.seconds, 3),
                result.size,
                result.stamp,
                None if result.stamps is None else result.stamps.output,
                None if result.files is None else dict(result.files),
                result.messages if status == FAILED else tuple(filter(is_notice, result.messages)),
                result.copies,
                buffers={} if result.stamps is None else dict(result.stamps.buffers),
            )
        )

    def _describe_failed(self, job: Job, result: JobResult) -> str:
        """Line on the output of a job that failed, which stays as it was before; and the step that failed."""
        path = job.folder / job.output
        if is_changed_since(path, self._began_ns):  # as by a worker that was ended after it had written
            words = "failed, but was written meanwhile"
        else:
            words = "not written" + (", an older one stays" if os.path.isfile(path) else "")
        failed = f": {result.failed_step} failed on {job.input}" if result.failed_step else ""
        return f"{job.output}  {words}{failed}"

    def _report(self, job: Job, result: JobResult, status: str) -> None:
        """Report a file: errors, warnings and notes, and a line if it was made; with --verbose all lines of steps."""
        reporter = Reporter() if status == FAILED else self.reporter
        for line in result.messages if status != DONE_BEFORE else ():
            is_shown = line.startswith("warning: ") or (is_notice(line) and not self.reporter.quiet)
            if status == FAILED or self.reporter.verbose or is_shown:
                Reporter().info(line if job.input in line or status == FAILED else f"{job.input}: {line}")
        if status == MADE or (self.reporter.verbose and status != FAILED):
            sizes = format_change(result.input_size, result.size)
            took = f", {format_duration(result.seconds)}" if status == MADE else f" ({status})"
            reporter.info(f"{job.output}  {', '.join((sizes, *result.step_errors))}{took}")
