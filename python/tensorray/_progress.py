"""Progress bars of long calls: tqdm's if it is installed, else a line of text."""

import contextlib
import sys
import warnings

try:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Without ipywidgets a notebook has tqdm's bar of text.
        from tqdm.auto import tqdm
except ImportError:
    tqdm = None


class _Tqdm:
    def __init__(self):
        self.bar = None

    def __call__(self, phase, done, total):
        if self.bar is None or self.bar.desc != phase or done < self.bar.n:
            self.close()
            self.bar = tqdm(total=total, desc=phase, unit="", unit_scale=True, leave=False)
            self.bar.desc = phase
        self.bar.total = total
        self.bar.update(done - self.bar.n)

    def close(self):
        if self.bar is not None:
            self.bar.close()
        self.bar = None


class _Text:
    def __init__(self):
        self.drawn = False

    def __call__(self, phase, done, total):
        print(f"\r\033[K{phase} {100 * min(done, total) // total}%", end="", file=sys.stderr, flush=True)
        self.drawn = True

    def close(self):
        if self.drawn:
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
        try:
            yield bar
        finally:
            bar.close()
    else:
        yield None
