"""Who does the rows: a pool of processes, Ray Data or Dask."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from .places import place_of
from .rows import Row, rows_of
from .tables import Summary, collect, record_of
from .work import Job, Worker, died

# Rows that are handed to a worker of Ray or Dask at a time: what is lost with it is done again.
_CHUNK = 16
# How many workers a row may bring down, alone, before it has failed.
_DEATHS = 2


def run(
    table: Iterable[Row | Mapping[str, Any]],
    output: str | os.PathLike[str],
    *,
    engine: str = "pool",
    workers: int | None = None,
    format: str = "glb",
    isolate: bool = False,
    plans: bool = False,
    retry_failed: bool = False,
    progress: Callable[[int, int], None] | None = None,
    client: Any = None,
) -> Summary:
    """Does all rows that are not done, and writes the table.

    ``engine`` is ``pool``, ``ray``, ``dask``, or ``here`` for none: one row after the other in this process. With ``isolate``, a file that
    brings a decoder down costs its row and nothing else. With ``plans``, pose arrays come out by plans that are compiled once per pair,
    and nothing is measured. ``client`` is a Dask client that is there already. ``progress`` hears of rows where the engine is ``pool``,
    ``dask`` or ``here``.

    A worker process takes one thread for a row, unless ``RAYON_NUM_THREADS`` says otherwise: many rows on as many workers as there are
    cores are faster than one row on all of them.
    """
    rows = rows_of(table)
    place = place_of(output)
    there = place.names("records")
    todo = [row for row in rows if f"{row.key}.json" not in there]
    if retry_failed:
        known = {row.key: record_of(place, row) for row in rows if f"{row.key}.json" in there}
        todo += [row for row in rows if (record := known.get(row.key)) and record["status"] == "failed"]
    # Rows of one character come after one another, and often to the same worker.
    todo.sort(key=lambda row: (row.pair, row.index))
    job = Job(os.fspath(output), format, isolate, plans, retry_failed)
    count = workers or os.cpu_count() or 1
    if todo:
        if engine == "pool":
            _Pool(job, count, progress).run(todo)
        elif engine == "ray":
            _with_ray(job, todo, count)
        elif engine == "dask":
            _with_dask(job, todo, count, client, progress)
        elif engine == "here":
            worker = Worker(job)
            for number, row in enumerate(todo):
                worker.do(row)
                if progress is not None:
                    progress(number + 1, len(todo))
        else:
            raise ValueError(f"there is no engine '{engine}'; use pool, ray, dask or here")
    return collect(rows, output, ran=len(todo))


_worker: Worker | None = None


def _do(job: Job, row: Row) -> str:
    """One row, in a process of a pool; the worker of the process is kept."""
    global _worker
    # Threads of the engine are counted when the first row is begun.
    os.environ.setdefault("RAYON_NUM_THREADS", "1")
    if _worker is None or _worker._job != job:
        _worker = Worker(job)
    return str(_worker.do(row)["status"])


def _do_chunk(job: Job, rows: list[Row]) -> int:
    """Rows one after the other, in a process of Ray or Dask."""
    for row in rows:
        # What was done by a worker that died is not done again.
        record = record_of(place_of(job.output), row)
        if record is None or (job.retry_failed and record["status"] == "failed"):
            _do(job, row)
    return len(rows)


class _Pool:
    """A pool of processes that survives the death of a worker: the rows that were being worked on are tried alone, and one that brings
    its worker down again has failed."""

    def __init__(self, job: Job, count: int, progress: Callable[[int, int], None] | None) -> None:
        self._job = job
        self._count = count
        self._progress = progress
        # A process that is forked has none of the threads that work may be waiting for.
        self._context = multiprocessing.get_context("spawn")

    def run(self, rows: list[Row]) -> None:
        waiting, total = list(reversed(rows)), len(rows)
        while waiting:
            suspects = self._until_broken(waiting, total)
            for row in suspects:
                if not self._alone(row):
                    died(self._job, row)

    def _until_broken(self, waiting: list[Row], total: int) -> list[Row]:
        """Works until nothing waits or the pool breaks; gives the rows that were being worked on then."""
        running: dict[Future[str], Row] = {}
        with ProcessPoolExecutor(self._count, mp_context=self._context) as pool:
            try:
                while waiting or running:
                    while waiting and len(running) < 2 * self._count:
                        row = waiting.pop()
                        try:
                            running[pool.submit(_do, self._job, row)] = row
                        except BrokenProcessPool:
                            waiting.append(row)
                            raise
                    done, _ = wait(running, return_when=FIRST_COMPLETED)
                    for future in done:
                        future.result()
                        del running[future]
                    if self._progress is not None:
                        self._progress(total - len(waiting) - len(running), total)
            except BrokenProcessPool:
                return _without_record(self._job, list(running.values()))
        return []

    def _alone(self, row: Row) -> bool:
        with ProcessPoolExecutor(1, mp_context=self._context) as pool:
            try:
                pool.submit(_do, self._job, row).result()
            except BrokenProcessPool:
                return False
        return True


def _chunks(rows: list[Row]) -> list[list[Row]]:
    return [rows[first : first + _CHUNK] for first in range(0, len(rows), _CHUNK)]


def _without_record(job: Job, rows: list[Row]) -> list[Row]:
    there = place_of(job.output).names("records")
    return [row for row in rows if f"{row.key}.json" not in there or record_of(place_of(job.output), row) is None]


def _with_ray(job: Job, rows: list[Row], count: int) -> None:
    import ray
    import ray.data

    if not ray.is_initialized():
        ray.init(num_cpus=count, include_dashboard=False, log_to_driver=False)

    def do(chunk: dict[str, Any]) -> dict[str, Any]:
        return {"done": _do_chunk(job, list(chunk["rows"]))}

    chunks = [{"rows": chunk} for chunk in _chunks(rows)]
    context = ray.data.DataContext.get_current()
    most_errors = context.max_errored_blocks
    # By itself, Ray Data begins tasks anew without end, and ends all others when one has failed. Here a chunk whose worker died is left,
    # and what of it was not done is done row by row.
    context.max_errored_blocks = -1
    try:
        data = ray.data.from_items(chunks, override_num_blocks=len(chunks))
        data.map(do, concurrency=count, max_retries=0).materialize()
    finally:
        context.max_errored_blocks = most_errors
    alone = ray.remote(num_cpus=1, max_retries=_DEATHS - 1)(_do_chunk)
    waiting = [(row, alone.remote(job, [row])) for row in _without_record(job, rows)]
    for row, task in waiting:
        try:
            ray.get(task)
        except (ray.exceptions.WorkerCrashedError, ray.exceptions.OutOfMemoryError):
            died(job, row)


def _with_dask(job: Job, rows: list[Row], count: int, client: Any, progress: Callable[[int, int], None] | None) -> None:
    import dask
    from distributed import Client, KilledWorker, LocalCluster, as_completed

    def submit(client: Any) -> None:
        done = 0
        for future in as_completed(client.map(_do_chunk, [job] * len(chunks), chunks, pure=False, retries=3)):
            # Workers died of this chunk, or of another one that waited for the same worker.
            if not isinstance(future.exception(), KilledWorker):
                done += future.result()
                if progress is not None:
                    progress(done, len(rows))
        # One after the other, so that none is blamed for another.
        for row in _without_record(job, rows):
            future = client.submit(_do_chunk, job, [row], pure=False)
            if isinstance(future.exception(), KilledWorker):
                died(job, row)
            else:
                future.result()

    chunks = _chunks(rows)
    if client is not None:
        submit(client)
        return
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": _DEATHS - 1}),
        LocalCluster(n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        Client(cluster) as own,
    ):
        submit(own)
