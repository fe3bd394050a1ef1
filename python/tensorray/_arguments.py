"""Python's objects as the plain arguments of the module."""

import json
import os

import numpy as np


def json_of(value):
    """A dictionary as JSON; NumPy's numbers and arrays, paths and tuples may be in it."""
    def plain(item):
        if isinstance(item, (np.ndarray, np.generic)):
            return item.tolist()
        if isinstance(item, os.PathLike):
            return os.fspath(item)
        raise TypeError(f"a scene cannot contain {type(item).__name__}")
    return json.dumps(value, default=plain, allow_nan=False)


def changes_of(changes, seed=None):
    """{"light.photons": 1e5} as the texts that the command line has after --set."""
    texts = [f"{key}={json_of(value)}" for key, value in (changes or {}).items()]
    return texts if seed is None else texts + [f"seed={int(seed)}"]


def scene_of(scene, folder):
    """A scene, as a dictionary or a file, as (file, JSON). JSON is empty where the file is to be read."""
    if isinstance(scene, dict):
        return os.path.join(os.fspath(folder) if folder else "", "scene"), json_of(scene)
    if folder:
        raise ValueError("folder: only for scenes that are dictionaries; a file's own folder is that of its paths")
    return os.fspath(scene), ""
