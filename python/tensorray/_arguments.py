"""Python's objects as the plain arguments of the module."""

from __future__ import annotations

import collections.abc
import json
import os
from typing import Any, Callable, Literal, Mapping, Protocol, Union

import numpy as np

from . import _tensorray

Path = Union[str, os.PathLike[str]]
Progress = Union[None, bool, Callable[[str, int, int], object]]
Scene = Union[None, Path, Mapping[str, Any]]
Changes = Union[None, Mapping[str, Any]]
Eigenvalues = Literal["auto", "raw", "absolute", "positive"]
Method = Literal["auto", "splitting", "splitting4", "euler", "rk4", "bs23", "dopri5"]


class Executor(Protocol):
    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Any: ...

#: The scene of a field alone: the light that it bends, on a plate, from the side that shows most.
_FIELD_ALONE = {"light": {"direction": "auto"}, "integrator": {"type": "photon_distribution"}}


def json_of(value):
    """A dictionary as JSON; NumPy's numbers and arrays, paths and tuples may be in it. Bytes of paths that are not
    UTF-8 become the characters that base/text/path_text.h names."""
    def plain(item):
        if isinstance(item, (np.ndarray, np.generic)):
            return item.tolist()
        if isinstance(item, os.PathLike):
            return os.fspath(item)
        if isinstance(item, collections.abc.Mapping):
            return dict(item)
        raise TypeError(f"a scene cannot contain {type(item).__name__}")
    text = json.dumps(value, default=plain, allow_nan=False, ensure_ascii=False)
    return text.translate({0xDC00 + byte: 0xF700 + byte for byte in range(0x80, 0x100)})


def changes_of(changes, seed=None):
    """{"light.photons": 1e5} as the texts that the command line has after --set."""
    texts = [f"{key}={json_of(value)}" for key, value in (changes or {}).items()]
    return texts if seed is None else texts + [f"seed={int(seed)}"]


def module_field(function, field):
    """The module's part of a Field."""
    if not hasattr(field, "_field"):
        raise TypeError(f"{function}: field must be a tensorray.Field, not {type(field).__name__}; tr.Field(T) makes "
                        "one of an array")
    return field._field


def request_of(function, scene, field, *, changes, frame, folder, seed=None, outputs=(), keep=()):
    """A scene, as a dictionary or a file, or the scene of a field alone, as the module takes it."""
    if scene is None:
        if field is None:
            raise ValueError(f"{function}: give a scene, a field, or both")
        scene = _FIELD_ALONE
    if isinstance(scene, collections.abc.Mapping):
        file, text = os.path.join(os.fspath(folder) if folder else "", "scene"), json_of(scene)
    elif folder:
        raise ValueError("folder: only for scenes that are dictionaries; a file's own folder is that of its paths")
    else:
        file, text = os.fspath(scene), ""
    own = None if field is None else module_field(function, field)
    return _tensorray.SceneRequest(file, text, changes_of(changes, seed), frame, own, outputs, keep)
