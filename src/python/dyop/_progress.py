# SPDX-License-Identifier: BSD-3-Clause
"""A line that shows how far something is, on a terminal or in a notebook."""

import sys
import time

_REPORT_SECONDS = 0.2  # between two drawings


def is_notebook():
    """Whether a kernel of Jupyter runs this: its output shows HTML and keeps no screen."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")


class Bar:
    """Draws ``[###...] done/total``, at most five times a second; a call draws."""

    def __init__(self, total=None):
        self._draws = sys.stderr.isatty() or is_notebook()
        self._total = total
        self._start = time.monotonic()
        self._last = 0.0

    def __call__(self, done, total=None):
        total = self._total if total is None else total
        now = time.monotonic()
        if not self._draws or (now - self._last <= _REPORT_SECONDS and done < total):
            return
        self._last = now
        width = int(30 * min(1.0, done / total)) if total else 30
        counts = f"{done:.4g}/{total:.4g}" if isinstance(done, float) else f"{done}/{total}"
        print(
            f"\r[{'#' * width}{'.' * (30 - width)}] {counts}  {now - self._start:.1f} s", end="",
            file=sys.stderr, flush=True,
        )
        if done >= total:
            self.finish()

    def finish(self):
        """Ends the line, if there is one."""
        if self._draws and self._last:
            print(file=sys.stderr, flush=True)
        self._draws = False


def call_of(progress):
    """What is called with (done, total): None, a bar for True, or the function itself."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return Bar()
    if not callable(progress):
        found = type(progress).__name__
        raise TypeError(f"progress must be a bool or a function, not a value of type {found}")
    return progress
