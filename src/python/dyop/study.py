# SPDX-License-Identifier: BSD-3-Clause
"""Studies: the same function over many independent cases, on one machine or many.

The work is spread by Dask (python3-distributed). This module adds what a study needs: results on
disk from which it goes on, streaming, and answers that do not depend on the number of workers.
"""

import contextlib
import hashlib
import io
import os
import pickle
import queue
import sqlite3
import time
import weakref
from concurrent.futures import CancelledError
from typing import Callable, NamedTuple, Optional

from ._cases import CaseError, CaseLost, drop, run_isolated
from ._progress import Bar, call_of

_PROTOCOL = 5
_SEAL_SIZE = hashlib.sha256().digest_size
_LOOK_SECONDS = 1.0  # between two looks at the scheduler
_GONE_SECONDS = 30.0  # without an answer of the scheduler, which a client tries to reach again


class Failure(NamedTuple):
    """Stands for the result of a case that raised an exception, crashed or broke a limit."""

    case: int  #: its number
    error: str  #: type and message, or how its process ended


class StudyError(RuntimeError):
    """A study cannot go on: a case that crashed, results of another study, no worker, no scheduler."""


def _seal(number, digest, data):
    """A digest of a row of a store."""
    return hashlib.sha256(f"{number} {digest} ".encode() + data).digest()


class Store:
    """Results of a study on disk, each written once: a file of SQLite.

    A study that was killed goes on from here. Each row has the case's number, a digest of the case,
    and the pickled result behind a digest of the whole row: what is damaged is a StudyError, and is
    not unpickled.
    """

    def __init__(self, path, name):
        self._path = os.fspath(path)
        self._rows = sqlite3.connect(self._path)
        try:
            names = self._names(name)
        except StudyError:
            self._rows.close()
            raise
        if names != [name]:
            self._rows.close()
            raise StudyError(f"{self._path} holds results of {names[0]}, not of {name}")

    def _names(self, name):
        """The studies whose results these are: in a new file `name`."""
        with self._access():
            self._rows.execute("create table if not exists study (name text)")
            self._rows.execute(
                "create table if not exists results"
                " (number integer primary key, digest text not null, result blob not null)"
            )
            names = [row[0] for row in self._rows.execute("select name from study")]
            if not names:
                self._rows.execute("insert into study values (?)", (name,))
        return names or [name]

    @contextlib.contextmanager
    def _access(self):
        """One transaction."""
        try:
            with self._rows:
                yield
        except (sqlite3.Error, UnicodeError) as error:
            raise StudyError(f"{self._path}: {error}") from None

    def load(self, digests):
        """The results that are there, by number. @throws StudyError if a case has changed."""
        with self._access():
            rows = list(self._rows.execute("select number, digest, result from results"))
        found = {}
        for number, digest, sealed in rows:
            if number not in range(len(digests)) or digests[number] != digest:
                raise StudyError(f"{self._path}: case {number} is not the one it was")
            data = sealed[_SEAL_SIZE:] if isinstance(sealed, bytes) else b""
            if sealed != _seal(number, digest, data) + data:
                raise StudyError(f"{self._path}: the result of case {number} is damaged")
            found[number] = pickle.loads(data)
        return found

    def save(self, rows):
        """Rows (number, digest, result): all or none."""
        packed = [(n, d, pickle.dumps(r, _PROTOCOL)) for n, d, r in rows]
        data = [(n, d, _seal(n, d, r) + r) for n, d, r in packed]
        with self._access():
            self._rows.executemany("insert into results values (?, ?, ?)", data)

    def close(self):
        self._rows.close()


class _Task(NamedTuple):
    """How a worker runs cases; the same for all of a study."""

    function: Callable
    key: str  #: names function, shared and limits
    keeps_failures: bool
    isolates: bool
    seconds: Optional[float]
    megabytes: Optional[float]


def _result_of(task, case, shared):
    """(True, the result) or (False, the exception) of one case."""
    if task.isolates:
        try:
            return run_isolated(
                task.function, shared, task.key, case, task.seconds, task.megabytes
            )
        except CaseLost as error:
            return False, error
    try:
        return True, task.function(case, **shared)
    except Exception as error:  # the study's to judge
        return False, error


def _run_chunk(task, numbers, cases, shared):
    """What a worker does: the results of some cases, in their order."""
    results = []
    for number, case in zip(numbers, cases):
        is_good, result = _result_of(task, case, shared)
        if not is_good and not task.keeps_failures:
            if isinstance(result, CaseLost):
                raise StudyError(f"case {number} {result}")
            raise result
        if not is_good:
            kind = "" if isinstance(result, (CaseError, CaseLost)) else f"{type(result).__name__}: "
            result = Failure(number, f"{kind}{result}")
        results.append(result)
    return results


class _OrderedPickler(pickle._Pickler):
    """Pickles sets in an order that is the same in every process. The pickler in C asks nobody."""

    def reducer_override(self, thing):
        if isinstance(thing, (set, frozenset)):
            return type(thing), (sorted(thing, key=_ordered_pickle),)
        return NotImplemented


def _ordered_pickle(thing):
    data = io.BytesIO()
    _OrderedPickler(data, _PROTOCOL).dump(thing)
    return data.getvalue()


def _digest(thing):
    return hashlib.sha256(_ordered_pickle(thing)).hexdigest()


def _chunks(numbers, size):
    return [numbers[i : i + size] for i in range(0, len(numbers), size)]


def _run_here(task, chunks, cases, shared):
    try:
        for chunk in chunks:
            yield chunk, _run_chunk(task, chunk, [cases[n] for n in chunk], shared)
    finally:
        if task.isolates:
            drop()


class _Shared:
    """What the workers of a client hold between calls: the newest things, by their content."""

    _MOST = 16

    def __init__(self, client):
        self._client = client
        self._futures = {}  # by digest, the newest last

    def scatter(self, value):
        digest = _digest(value)
        future = self._futures.pop(digest, None)
        if future is None or future.status != "finished":
            # Once to every worker, not with every task.
            future = self._client.scatter(value, broadcast=True)
        self._futures[digest] = future
        while len(self._futures) > self._MOST:
            self._futures.pop(next(iter(self._futures)))
        return future


_shared_by_client = weakref.WeakKeyDictionary()


def forget(client):
    """Lets the workers of a client drop what they hold for its next studies."""
    _shared_by_client.pop(client, None)


class _Cluster:
    """The chunks of one study at the workers of a client."""

    def __init__(self, client, patience):
        self._client = client
        self._patience = patience
        self._finished = queue.Queue()
        self._futures = {}
        self._shared = {}

    def scatter(self, shared):
        kept = _shared_by_client.setdefault(self._client, _Shared(self._client))
        try:
            self._shared = {name: kept.scatter(value) for name, value in shared.items()}
        except (OSError, TimeoutError) as error:
            forget(self._client)
            raise StudyError(self._complaint()) from error

    def submit(self, task, chunk, cases):
        future = self._client.submit(
            _run_scattered, task, chunk, [cases[n] for n in chunk], list(self._shared),
            *self._shared.values(), pure=False,
        )
        self._futures[future] = chunk
        future.add_done_callback(self._finished.put)

    def next(self):
        """A chunk that is done, and its future."""
        last = time.monotonic()
        gone = None  # since when the scheduler does not answer
        while True:
            try:
                future = self._finished.get(timeout=min(_LOOK_SECONDS, self._patience))
                return self._futures.pop(future), future
            except queue.Empty:
                pass
            now = time.monotonic()
            is_there = self._client.status == "running"
            gone = None if is_there else gone or now
            if gone is not None and now - gone > min(_GONE_SECONDS, self._patience):
                raise StudyError("the scheduler is gone")
            if now - last > self._patience:
                raise StudyError(self._complaint())

    def _complaint(self):
        if self._client.status != "running":
            return "the scheduler is gone"
        return f"no result for {self._patience:g} s: are there workers, with dyop?"

    def close(self):
        if self._futures and self._client.status == "running":
            with contextlib.suppress(OSError, TimeoutError):  # the scheduler may end meanwhile
                self._client.cancel(list(self._futures))
        self._futures.clear()


def _run_on(client, task, chunks, cases, shared, patience):
    """Results of chunks as they finish. What a lost worker had is run again by the others."""
    from distributed import KilledWorker

    cluster = _Cluster(client, patience)
    try:
        cluster.scatter(shared)
        for chunk in chunks:
            cluster.submit(task, chunk, cases)
        left = len(chunks)
        while left > 0:
            chunk, future = cluster.next()
            try:
                results = future.result()
            except KilledWorker as error:
                if not task.keeps_failures or task.isolates:
                    raise StudyError(f"cases {chunk} ended several workers: {error}") from error
                # In processes of their own, the cases that did it can be told from the others.
                cluster.submit(task._replace(isolates=True), chunk, cases)
                continue
            except CancelledError as error:
                raise StudyError(f"a task is lost, with all its workers: {error}") from error
            except (OSError, TimeoutError) as error:  # a case's own would be among the results
                raise StudyError(f"the scheduler does not give cases {chunk}: {error}") from error
            yield chunk, results
            left -= 1
            future.release()
    finally:
        cluster.close()


def _run_scattered(task, numbers, cases, names, *values):
    return _run_chunk(task, numbers, cases, dict(zip(names, values)))


def imap(
    function, cases, *, client=None, shared=None, chunk=1, store=None, keep_failures=False,
    seconds=None, megabytes=None, isolate=None, progress=False, patience=600.0,
):
    """Yields (number, result) of function(case, **shared) for every case as they finish.

    client: a distributed.Client; None runs here. shared: things that every case needs, such as
    meshes: sent to each worker once, where they stay for the next calls until forget(client), then
    handed over as keyword arguments. chunk: cases per task; choose it so that a task takes 0.3 s or
    more. store: file for the results; cases whose results are there are not run again.
    keep_failures: a case that raises, crashes or breaks a limit gives a Failure, which is kept like
    a result; otherwise its exception, or a StudyError that names it, ends the study. seconds,
    megabytes: limits for each case, on its time and on the memory it takes beyond what is shared.
    isolate: cases run in a process of their own, which may crash; None: if there are limits.
    progress: True for a bar, on a terminal or in a notebook, or a function called with (done,
    total). patience: seconds without any result after which StudyError is raised; it is also raised
    when the scheduler is gone. Cases that a lost worker had are run again by the others.
    """
    if chunk < 1:
        raise ValueError(f"chunk must be >= 1, not {chunk}")
    for name, limit in (("seconds", seconds), ("megabytes", megabytes)):
        if limit is not None and not 0 < limit < float("inf"):
            raise ValueError(f"{name} must be > 0 and finite, not {limit}")
    cases = list(cases)
    shared = dict(shared or {})
    name = f"{function.__module__}.{function.__qualname__} with {_digest(shared)[:16]}"
    isolates = (seconds is not None or megabytes is not None) if isolate is None else isolate
    task = _Task(
        function, f"{name}, {seconds}, {megabytes}, {os.urandom(8).hex()}", keep_failures, isolates,
        seconds, megabytes,
    )
    kept = None if store is None else Store(store, name)
    digests = [_digest(case) for case in cases] if kept else []
    bar = call_of(progress)
    try:
        found = kept.load(digests) if kept else {}
        for number in sorted(found):
            yield number, found[number]
        done = len(found)
        if bar is not None:
            bar(done, len(cases))
        chunks = _chunks([n for n in range(len(cases)) if n not in found], chunk)
        found.clear()
        if client is None:
            finished = _run_here(task, chunks, cases, shared)
        else:
            finished = _run_on(client, task, chunks, cases, shared, patience)
        for numbers, results in finished:
            if kept:
                kept.save([(n, digests[n], r) for n, r in zip(numbers, results)])
            done += len(numbers)
            if bar is not None:
                bar(done, len(cases))
            yield from zip(numbers, results)
    finally:
        if isinstance(bar, Bar):
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


def failures(results):
    """The Failures among the results of map()."""
    return [result for result in results if isinstance(result, Failure)]
