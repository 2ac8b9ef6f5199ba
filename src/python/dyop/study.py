# SPDX-License-Identifier: BSD-3-Clause
"""Studies: the same function over many independent cases, on one machine or many.

The work is spread by Dask (python3-distributed). This module adds what a study needs: results on
disk from which it goes on, streaming, and answers that do not depend on the number of workers.
"""

import hashlib
import os
import pickle
import queue
import sqlite3
import sys
import time
from concurrent.futures import CancelledError
from typing import NamedTuple

_PROTOCOL = 5
_REPORT_SECONDS = 0.2  # between two drawings of the progress bar


class Failure(NamedTuple):
    """Stands for the result of a case that raised an exception."""

    case: int  #: its number
    error: str  #: type and message


class StudyError(RuntimeError):
    """A study cannot go on: results of another study, or no worker for too long."""


class Store:
    """Results of a study on disk, each written once: a file of SQLite.

    A study that was killed goes on from here. Each row has the case's number, a digest of the case,
    and the pickled result.
    """

    def __init__(self, path, name):
        self._path = os.fspath(path)
        self._rows = sqlite3.connect(self._path)
        with self._rows:
            self._rows.execute("create table if not exists study (name text)")
            self._rows.execute(
                "create table if not exists results"
                " (number integer primary key, digest text not null, result blob not null)"
            )
            names = [row[0] for row in self._rows.execute("select name from study")]
            if not names:
                self._rows.execute("insert into study values (?)", (name,))
        if names not in ([], [name]):
            self._rows.close()
            raise StudyError(f"{self._path} holds results of {names[0]}, not of {name}")

    def load(self, digests):
        """The results that are there, by number. @throws StudyError if a case has changed."""
        found = {}
        for number, digest, result in self._rows.execute("select * from results"):
            if number >= len(digests) or digests[number] != digest:
                raise StudyError(f"{self._path}: case {number} is not the one it was")
            found[number] = pickle.loads(result)
        return found

    def save(self, rows):
        """Rows (number, digest, result): all or none."""
        data = [(n, d, pickle.dumps(r, _PROTOCOL)) for n, d, r in rows]
        with self._rows:
            self._rows.executemany("insert into results values (?, ?, ?)", data)

    def close(self):
        self._rows.close()


class _Progress:
    """A line on a terminal, or a function to be called."""

    def __init__(self, wanted, total):
        self._call = wanted if callable(wanted) else None
        self._draws = wanted is True and sys.stderr.isatty()
        self._total = total
        self._start = time.monotonic()
        self._last = 0.0

    def update(self, done):
        if self._call is not None:
            self._call(done, self._total)
        now = time.monotonic()
        if self._draws and (now - self._last > _REPORT_SECONDS or done == self._total):
            self._last = now
            width = 30 * done // max(self._total, 1)
            bar = "#" * width + "." * (30 - width)
            print(
                f"\r[{bar}] {done}/{self._total}  {now - self._start:.1f} s", end="",
                file=sys.stderr, flush=True,
            )

    def finish(self):
        if self._draws:
            print(file=sys.stderr)


def _run_chunk(function, numbers, cases, shared, keeps_failures):
    """What a worker does: the results of some cases, in their order."""
    results = []
    for number, case in zip(numbers, cases):
        try:
            results.append(function(case, **shared))
        except Exception as error:  # the study's to judge
            if not keeps_failures:
                raise
            results.append(Failure(number, f"{type(error).__name__}: {error}"))
    return results


def _digest(thing):
    return hashlib.sha256(pickle.dumps(thing, _PROTOCOL)).hexdigest()


def _chunks(numbers, size):
    return [numbers[i : i + size] for i in range(0, len(numbers), size)]


def _run_here(function, chunks, cases, shared, keeps_failures):
    for chunk in chunks:
        yield chunk, _run_chunk(function, chunk, [cases[n] for n in chunk], shared, keeps_failures)


def _run_on(client, function, chunks, cases, shared, keeps_failures, patience):
    """Results of chunks as they finish. What a lost worker had is run again by the others."""
    finished = queue.Queue()
    futures = {}
    try:
        # Once to every worker, not with every task.
        scattered = {name: client.scatter(value, broadcast=True) for name, value in shared.items()}
        for chunk in chunks:
            future = client.submit(
                _run_scattered, function, chunk, [cases[n] for n in chunk], list(scattered),
                *scattered.values(), keeps_failures=keeps_failures, pure=False,
            )
            futures[future] = chunk
            future.add_done_callback(finished.put)
        for _ in chunks:
            future = finished.get(timeout=patience)
            yield futures[future], future.result()
            future.release()
    except (queue.Empty, TimeoutError) as error:
        raise StudyError(f"no result for {patience:g} s: are there workers, with dyop?") from error
    except CancelledError as error:
        raise StudyError(f"a task is lost, with all its workers: {error}") from error
    finally:
        client.cancel(list(futures))


def _run_scattered(function, numbers, cases, names, *values, keeps_failures):
    return _run_chunk(function, numbers, cases, dict(zip(names, values)), keeps_failures)


def imap(
    function, cases, *, client=None, shared=None, chunk=1, store=None, keep_failures=False,
    progress=False, patience=600.0,
):
    """Yields (number, result) of function(case, **shared) for every case as they finish.

    client: a distributed.Client; None runs here. shared: things that every case needs, such as
    meshes: sent to each worker once, then handed over as keyword arguments. chunk: cases per task;
    choose it so that a task takes 0.3 s or more. store: file for the results; cases whose results
    are there are not run again. keep_failures: a case that raises gives a Failure, which is kept
    like a result; otherwise its exception ends the study. progress: True for a bar on a terminal,
    or a function called with (done, total). patience: seconds without any result after which
    StudyError is raised. Cases that a lost worker had are run again by the others.
    """
    if chunk < 1:
        raise ValueError(f"chunk must be >= 1, not {chunk}")
    cases = list(cases)
    shared = dict(shared or {})
    name = f"{function.__module__}.{function.__qualname__} with {_digest(shared)[:16]}"
    kept = None if store is None else Store(store, name)
    digests = [_digest(case) for case in cases] if kept else []
    bar = _Progress(progress, len(cases))
    try:
        found = kept.load(digests) if kept else {}
        for number in sorted(found):
            yield number, found[number]
        done = len(found)
        bar.update(done)
        chunks = _chunks([n for n in range(len(cases)) if n not in found], chunk)
        found.clear()
        if client is None:
            finished = _run_here(function, chunks, cases, shared, keep_failures)
        else:
            finished = _run_on(client, function, chunks, cases, shared, keep_failures, patience)
        for numbers, results in finished:
            if kept:
                kept.save([(n, digests[n], r) for n, r in zip(numbers, results)])
            done += len(numbers)
            bar.update(done)
            yield from zip(numbers, results)
    finally:
        bar.finish()
        if kept:
            kept.close()


def map(function, cases, **options):  # noqa: A001  the name in the documentation
    """The results of function(case, **shared) in the order of the cases; options as of imap()."""
    cases = list(cases)
    results = [None] * len(cases)
    for number, result in imap(function, cases, **options):
        results[number] = result
    return results
