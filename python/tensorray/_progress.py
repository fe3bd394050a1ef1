"""Progress bars of long calls: tqdm's if it is installed, else a line of text."""

import atexit
import contextlib
import sys
import threading
import warnings

try:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Without ipywidgets a notebook has tqdm's bar of text.
        from tqdm.auto import tqdm
except ImportError:
    tqdm = None


_writing = threading.RLock()
_ended = False


def _end():
    """At Python's exit: waits for the bar that is being written; none is written afterwards. Python kills the threads
    that are left (daemons), and one that wrote then would leave standard error locked, which Python flushes."""
    global _ended
    _ended = True
    if _writing.acquire(timeout=5):
        _writing.release()


atexit.register(_end)


class _Tqdm:
    bar = None

    def draw(self, phase, done, total):
        if self.bar is None or self.bar.desc != phase or done < self.bar.n:
            self.clear()
            self.bar = tqdm(total=total, desc=phase, unit="", unit_scale=True, leave=False)
            self.bar.desc = phase
        self.bar.total = total
        self.bar.update(done - self.bar.n)

    def clear(self):
        if self.bar is not None:
            self.bar.disable = _ended  # Else it writes as soon as it is deleted.
            self.bar.close()
        self.bar = None


class _Text:
    drawn = False

    def draw(self, phase, done, total):
        print(f"\r\033[K{phase} {100 * min(done, total) // total}%", end="", file=sys.stderr, flush=True)
        self.drawn = True

    def clear(self):
        if self.drawn and not _ended:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def _is_watched():
    """Whether somebody looks at a terminal or a notebook."""
    if "ipykernel" in sys.modules:
        return True
    try:
        return sys.stderr.isatty()
    except (AttributeError, ValueError):  # None, another object that only writes, or closed.
        return False


@contextlib.contextmanager
def shown(progress):
    """The function that a long call reports to. `progress` is None (a bar if somebody looks), a truth value, or a
    function of (phase, done, total)."""
    if callable(progress):
        yield progress
    elif progress or (progress is None and _is_watched()):
        bar = _Tqdm() if tqdm else _Text()

        def report(*state):
            with _writing:
                if not _ended:
                    bar.draw(*state)

        try:
            yield report
        finally:
            with _writing:
                bar.clear()
    else:
        yield None
