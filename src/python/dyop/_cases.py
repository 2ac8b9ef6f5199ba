# SPDX-License-Identifier: BSD-3-Clause
"""Cases of a study in a process of their own, which may crash, hang or eat memory."""

import atexit
import multiprocessing.connection
import multiprocessing.spawn
import os
import pickle
import resource
import signal
import subprocess
import sys
import threading
import time

try:
    import cloudpickle as _pickler  # functions of notebooks and of the main program, too
except ImportError:
    _pickler = pickle

_START_SECONDS = 300.0  # for a process to import what the function needs, and to read what is shared
_GRACE_SECONDS = 5.0  # after which a process that is told to end is killed
_MEGABYTE = 1 << 20


class CaseLost(RuntimeError):
    """A case that gave no result: its process crashed, or was ended because it took too long."""


class CaseError(RuntimeError):
    """Type and message of a case's exception that cannot be sent from its process."""


def _pack(function, shared):
    """What a process needs besides the cases, as bytes."""
    main = {}
    if function.__module__ == "__main__" and _pickler is pickle:
        data = multiprocessing.spawn.get_preparation_data("dyop-study")
        main = {k: v for k, v in data.items() if k.startswith("init_main_from")}
    return pickle.dumps((main, _pickler.dumps((function, shared), 5)), 5)


class _Process:
    """A process that runs a function over one case after another."""

    def __init__(self, packed, megabytes):
        self._here, there = multiprocessing.Pipe()
        code = (
            f"import sys; sys.path[:] = {sys.path!r}; "
            f"from dyop._cases import serve; serve({there.fileno()})"
        )
        self._process = subprocess.Popen(
            [sys.executable, "-c", code], pass_fds=[there.fileno()], stdin=subprocess.DEVNULL
        )
        there.close()
        try:
            self._here.send_bytes(pickle.dumps((os.getpid(), megabytes)))
            self._here.send_bytes(packed)
            answer = self._receive(_START_SECONDS)
        except CaseLost as error:
            raise CaseLost(f"before the first case: {error}") from None
        if answer is not None:
            self.end()
            raise answer

    def run(self, case, seconds):
        """(True, the result) or (False, the exception). Raises CaseLost."""
        try:
            self._here.send_bytes(_pickler.dumps((case, seconds), 5))
        except OSError:
            raise self._lost() from None
        return self._receive(seconds)

    def _receive(self, seconds):
        try:
            if not self._here.poll(seconds):
                self.end()
                raise CaseLost(f"took more than {seconds:g} s")
            answer = self._here.recv_bytes()
        except (EOFError, OSError):
            raise self._lost() from None
        try:
            return pickle.loads(answer)
        except Exception as error:  # a result whose class cannot be made anew
            return False, CaseError(f"its result does not unpickle: {_text_of(error)}")

    def _lost(self):
        self._here.close()
        try:
            code = self._process.wait(_GRACE_SECONDS)
        except subprocess.TimeoutExpired:
            code = self._process.poll()
        self.end()
        if code is not None and code < 0:
            return CaseLost(f"crashed: {signal.Signals(-code).name}")
        return CaseLost(f"ended its process with code {code}")

    def end(self):
        self._here.close()
        self._process.kill()
        self._process.wait()


_kept = threading.local()  # one process for each thread, kept between calls
_all = set()


def _end_all():
    for process in list(_all):
        process.end()


atexit.register(_end_all)


def run_isolated(function, shared, key, case, seconds, megabytes):
    """(True, the result) or (False, the exception) of one case. Raises CaseLost.

    The process is kept for the next case with the same key, with all that is shared.
    """
    process = getattr(_kept, "process", None)
    if process is not None and _kept.key != key:
        drop()
        process = None
    if process is None:
        process = _Process(_pack(function, shared), megabytes)
        _kept.process, _kept.key = process, key
        _all.add(process)
    try:
        return process.run(case, seconds)
    except CaseLost:
        drop()
        raise


def drop():
    """Ends this thread's process, if there is one."""
    process = getattr(_kept, "process", None)
    if process is not None:
        _all.discard(process)
        process.end()
        _kept.process = None


def _watch(parent):
    """Ends this process when its parent is gone."""
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)


def _limit_memory(megabytes):
    """Counts from here: what is shared is there already."""
    with open("/proc/self/statm", encoding="ascii") as file:
        now = int(file.read().split()[0]) * resource.getpagesize()
    limit = now + int(megabytes * _MEGABYTE)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _text_of(error):
    return f"{type(error).__name__}: {error}"


def _answer(result):
    """As bytes; what cannot be pickled is an exception that says so."""
    is_good, value = result
    try:
        packed = _pickler.dumps(result, 5)
        # Exceptions are made anew from `args`, which need not fit their constructor.
        if is_good or _text_of(pickle.loads(packed)[1]) == _text_of(value):
            return packed
        text = _text_of(value)
    except Exception as error:
        text = _text_of(error if is_good else value)
    return pickle.dumps((False, CaseError(text)), 5)


def serve(descriptor):
    """What the process does: answers cases until the pipe is closed."""
    try:
        _serve(multiprocessing.connection.Connection(descriptor))
    except (EOFError, ConnectionError):
        pass  # the parent is gone, or has had enough: nobody waits for an answer


def _serve(source):
    parent, megabytes = pickle.loads(source.recv_bytes())
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to judge
    try:
        main, packed = pickle.loads(source.recv_bytes())
        if main:
            multiprocessing.spawn.prepare(main)
        function, shared = pickle.loads(packed)
        if megabytes is not None:
            _limit_memory(megabytes)
        source.send_bytes(pickle.dumps(None))
    except Exception as error:
        source.send_bytes(pickle.dumps(CaseLost(f"could not start: {type(error).__name__}: {error}")))
        return
    while True:
        case, seconds = pickle.loads(source.recv_bytes())
        if seconds is not None:  # if nobody is left to end this process
            signal.setitimer(signal.ITIMER_REAL, 2 * seconds + _GRACE_SECONDS)
        try:
            result = True, function(case, **shared)
        except Exception as error:
            result = False, error
        signal.setitimer(signal.ITIMER_REAL, 0)
        source.send_bytes(_answer(result))
