"""Light bent by tensor fields (Zheng and Pang, VisSym 2003), from Python.

A field of tensors bends light: V' = s (T V - (V^T T V) V) for the unit direction V of a ray, where s is the
flexibility of its light. The functions do what the program `tensorray` does, with the same bytes:

    import tensorray as tr
    field = tr.Field(T, voxel_size=0.01, origin=(0, 0, 0))     # T: array (nz, ny, nx, 3, 3)
    picture = tr.render(field=field)                           # the light that it bends, on a plate
    picture.display                                            # array (height, width, channels), for a screen
    rays = tr.trace(field, positions, directions, s=0.2)       # where single rays go

    Field, read_vdb, import_file, make      tensor fields: of arrays, of files, analytic
    invariant                               numbers that describe the tensors of a field
    render                                  pictures, photons, paths and statistics of a scene
    trace                                   single rays: ends, ways and Jacobians
    landings                                where the light of a scene lands on its plate, as a mesh
    schema                                  the keys of scenes, as a JSON Schema (a dictionary)

Lengths are in world units (those of the field), wavelengths in nm. World axes are x, y, z; arrays of voxels have the
shape (nz, ny, nx, ...), so that x varies fastest. Long calls release the GIL, show a progress bar, and end on Ctrl-C.
Errors are exceptions of one line: SceneError (a ValueError) for a wrong scene, ValueError for wrong arguments, and
RuntimeError for work that failed. docs/python.md has examples.
"""

import json as _json
import typing as _typing

from . import _tensorray
from ._fields import Field, import_file, invariant, make, programs as _programs, read_vdb
from ._render import Render, render
from ._tensorray import SceneError
from ._trace import Landings, Plate, Trace, landings, trace

__version__: str = _tensorray.version
SceneError.__module__ = __name__
_tensorray.use_programs_in(_programs())

#: Why a ray ended; index it with the numbers in `Trace.ends` and `Landings.ends`.
RAY_ENDS: _typing.Tuple[str, ...] = _tensorray.ray_ends

#: The names that `invariant` knows.
INVARIANTS: _typing.Tuple[str, ...] = tuple(_tensorray.invariant_names())

__all__ = ["Field", "INVARIANTS", "Landings", "Plate", "RAY_ENDS", "Render", "SceneError", "Trace", "import_file",
           "invariant", "landings", "make", "read_vdb", "render", "schema", "trace"]


def schema() -> _typing.Dict[str, _typing.Any]:
    """The JSON Schema of scenes, as a dictionary: all keys, their meanings, limits and defaults."""
    return _json.loads(_tensorray.schema())
