"""Runs the notebooks of docs/notebooks, and compares their outputs with those that they have: texts must be the same up
to the last digits of numbers, and pictures must be close.

    PYTHONPATH=$PWD/build/release/python /usr/bin/python3 tests/python/notebooks_test.py --store [NAME.ipynb...]

stores the outputs instead. Look at the pictures afterwards.
"""

import base64
import copy
import io
import math
import os
import re
import sys
import tempfile
import unittest

import matplotlib.pyplot as plt
import nbformat
import numpy as np
from nbconvert.preprocessors import ExecutePreprocessor

FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs", "notebooks")
NAMES = sorted(name for name in os.listdir(FOLDER) if name.endswith(".ipynb"))
MAX_BYTES = 1_000_000
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def path_of(name):
    return os.path.join(FOLDER, name)


def executed(notebook):
    """The notebook with the outputs of a run. What only a terminal shows, or differs from run to run, is left out."""
    result = copy.deepcopy(notebook)
    run = ExecutePreprocessor(timeout=None, startup_timeout=1200, kernel_name="python3")
    run.preprocess(result, {"metadata": {"path": FOLDER}})
    for cell in result.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            cell.outputs = [output for output in cell.outputs if output.get("name") != "stderr"]  # Progress.
    result.metadata = notebook.metadata
    return result


def texts_of(cell):
    return "".join(output.get("text") or output.get("data", {}).get("text/plain", "") for output in cell.outputs)


def pictures_of(cell):
    """The bytes of the PNGs in a cell's outputs."""
    data = [output.get("data", {}).get("image/png") for output in cell.outputs]
    return [base64.b64decode(picture) for picture in data if picture]


def text_difference(there, here):
    """What differs between two texts; empty if nothing does."""
    if NUMBER.sub("#", there) != NUMBER.sub("#", here):
        return f"{there!r} is {here!r}"
    for a, b in zip(NUMBER.findall(there), NUMBER.findall(here)):
        if not math.isclose(float(a), float(b), rel_tol=1e-6):
            return f"{a} is {b}"
    return ""


def picture_difference(there, here):
    """The same of two PNGs. Other versions of Matplotlib give figures other margins."""
    a, b = (plt.imread(io.BytesIO(picture))[..., :3] for picture in (there, here))
    if np.abs(np.array(a.shape) - b.shape).max() > 0.02 * max(a.shape):
        return f"a picture of {a.shape} is one of {b.shape}"
    height, width = np.minimum(a.shape, b.shape)[:2]
    error = np.abs(a[:height, :width] - b[:height, :width]).mean()
    return f"a picture differs by {error:.3f} in the mean" if error > 0.02 else ""


def differences(there, here):
    """All differences between the outputs of two runs of a notebook, with the numbers of the cells."""
    found = []
    for number, (a, b) in enumerate(zip(there.cells, here.cells)):
        if a.cell_type != "code":
            continue
        cell = [text_difference(texts_of(a), texts_of(b))]
        pictures = pictures_of(a), pictures_of(b)
        cell += map(picture_difference, *pictures)
        if len(pictures[0]) != len(pictures[1]):
            cell.append("the number of pictures differs")
        found += [f"cell {number}: {text}" for text in cell if text]
    return found


class NotebooksTest(unittest.TestCase):
    def test_outputs_are_those_of_a_run(self):
        for name in NAMES:
            with self.subTest(name):
                notebook = nbformat.read(path_of(name), as_version=4)
                self.assertEqual(differences(notebook, executed(notebook)), [])


def store(names):
    for name in names:
        notebook = executed(nbformat.read(path_of(name), as_version=4))
        with open(path_of(name), "w") as file:
            nbformat.write(notebook, file)
        print(f"stored the outputs of {name}")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as home:
        os.environ["HOME"] = home  # Jupyter writes files there.
        os.environ["PYDEVD_DISABLE_FILE_VALIDATION"] = "1"  # Else kernels warn of Debian's Python.
        if sys.argv[1:2] == ["--store"]:
            store(sys.argv[2:] or NAMES)
        else:
            unittest.main()
