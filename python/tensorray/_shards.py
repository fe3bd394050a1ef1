"""Renders in shards: parts of a render that are made apart from each other, and then merged.

A shard is a file, as `tensorray render --shard` writes it, in a folder that lasts as long as the call. So an executor
carries only names, however large the field and the shards are, and all shards know when to end: when the folder is gone.
"""

import contextlib
import operator
import os
import pickle
import queue
import shutil
import tempfile

from . import _tensorray
from ._arguments import request_of

_most = 100000  # As of --shard.


@contextlib.contextmanager
def made(arguments, threads, *, shards, executor, shard_folder, report):
    """Makes the shards of a render, and yields their files, which are removed at the end.

    arguments  Of `request_of`.
    report     A function of (phase, done, total), or None.
    """
    count = operator.index(shards)
    if not 1 <= count <= _most:
        raise ValueError(f"shards: give a number from 1 to {_most}")
    request = request_of(**arguments)
    _tensorray.check_shards(request)
    folder = tempfile.mkdtemp(prefix="tensorray-", dir=None if shard_folder is None else os.path.abspath(shard_folder))
    try:
        if executor is None:
            _make_here(request, threads, folder, count, report)
        else:
            _make_by(executor, arguments, threads, folder, count, report)
        yield [_shard(folder, index) for index in range(count)]
    finally:
        ended = folder + ".ended"
        os.rename(folder, ended)  # At once: a shard that is still being made ends, and cannot write there meanwhile.
        shutil.rmtree(ended, ignore_errors=True)


def render_shard(folder, index, count):
    """Makes shard `index` of `count`, from 0 on, of the render that a folder belongs to. Executors call it."""
    try:
        with open(_arguments(folder), "rb") as file:
            arguments, threads = pickle.load(file)
    except FileNotFoundError:
        raise RuntimeError(f"{folder} is not there: give shard_folder=, a folder that all machines have") from None

    def end_with_folder(*_):
        if not os.path.exists(folder):
            raise RuntimeError("the render has ended")

    _tensorray.render_shard(request_of(**arguments), index, count, _shard(folder, index), threads, end_with_folder)


def _make_here(request, threads, folder, count, report):
    for index in range(count):
        def labelled(phase, done, total, name=f"shard {index + 1}/{count}"):
            report(f"{name}: {phase}", done, total)

        with _named(index, count):
            _tensorray.render_shard(request, index, count, _shard(folder, index), threads, report and labelled)


def _make_by(executor, arguments, threads, folder, count, report):
    with open(_arguments(folder), "wb") as file:
        pickle.dump((_anywhere(arguments), threads), file)
    ended, futures = queue.SimpleQueue(), []
    try:
        for index in range(count):
            futures.append(executor.submit(render_shard, folder, index, count))
            futures[-1].add_done_callback(lambda _, index=index: ended.put(index))
        for done in range(count):
            if report:
                report("shards", done, count)
            index = ended.get()
            with _named(index, count):
                futures[index].result()
    finally:
        for future in futures:
            future.cancel()  # Those that have not begun.


def _anywhere(arguments):
    """The same for another working folder."""
    here = os.getcwd()
    if isinstance(arguments["scene"], (str, os.PathLike)):
        return {**arguments, "scene": os.path.join(here, arguments["scene"])}
    return {**arguments, "folder": os.path.join(here, arguments["folder"] or "")}


@contextlib.contextmanager
def _named(index, count):
    """Names the shard in errors."""
    try:
        yield
    except Exception as error:
        kinds = (_tensorray.SceneError, ValueError, MemoryError)
        kind = next((kind for kind in kinds if isinstance(error, kind)), RuntimeError)
        raise kind(f"shard {index + 1}/{count}: {str(error) or type(error).__name__}") from error


def _shard(folder, index):
    return os.path.join(folder, f"{index + 1}.shard")


def _arguments(folder):
    return os.path.join(folder, "arguments")
