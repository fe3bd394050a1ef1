"""Tensor fields."""

from __future__ import annotations

import functools
import inspect
import os
import shutil
import subprocess
import tempfile
import warnings
from typing import Any, Literal, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tensorray
from ._arguments import Path, Progress, json_of, module_field
from ._progress import shown


class Field:
    """A tensor field of an array.

    T           Tensors, shape (nz, ny, nx, 3, 3), world axes: T[k, j, i] is the tensor at voxel (i, j, k), with rows
                before columns, so that T[k, j, i] @ V is T V. float32 and float64 of any strides are not copied: the
                field shares the array's memory, so do not change the array afterwards; make another field, which costs
                nothing. Other types are converted. Tensors that are not finite bend no light, nor do those that a
                masked array masks.
    voxel_size  Distance of neighbouring voxels' centres, world units: a number, or three (x, y, z).
    origin      Centre of the voxel T[0, 0, 0], world (x, y, z).
    to_world    Instead of these two: a (4, 4) matrix from voxel indices (i, j, k, 1) to the world.
    name        Name of the field in files.
    surface     Surface of the body that the field is in, which light bends in alone: points (n, 3), world, and
                triangles (m, 3), numbers of points, counter-clockwise from outside; closed. None: there is no body.

    The volume reaches from the first to the last voxel's centre along each axis, and up to two voxels further to the
    surface; light is straight outside it.
    """

    def __init__(self, T: ArrayLike, voxel_size: ArrayLike = 1.0, origin: ArrayLike = (0.0, 0.0, 0.0), *,
                 to_world: ArrayLike | None = None, name: str = "tensor",
                 surface: tuple[ArrayLike, ArrayLike] | None = None) -> None:
        if np.ma.isMaskedArray(T):
            T = T.astype(np.result_type(T.dtype, np.float32)).filled(np.nan)
        tensors = np.asarray(T)
        if tensors.dtype not in (np.float32, np.float64) or not tensors.dtype.isnative or not tensors.flags.aligned:
            tensors = tensors.astype(np.float64)
        if to_world is None:
            to_world = np.diag(np.append(np.broadcast_to(np.asarray(voxel_size, float), 3), 1.0))
            to_world[:3, 3] = origin
        to_world = np.array(to_world, float)
        if to_world.shape != (4, 4):
            raise ValueError("to_world must be an array of shape (4, 4)")
        make_field = _tensorray.field_of_floats if tensors.dtype == np.float32 else _tensorray.field_of_doubles
        points, triangles = (np.empty((0, 3)), np.empty((0, 3), int)) if surface is None else map(np.asarray, surface)
        self._field = make_field(tensors, to_world, json_of({"file": "array", "name": name}), points, triangles)
        self._keys = None
        self._set(tensors, to_world, name, {})

    @classmethod
    def _of(cls, field, keys):
        """A field that is no array. `keys`: `field` of a scene that has it, as JSON."""
        self = cls.__new__(cls)
        self._field, self._keys = field, keys
        self._set(*_tensorray.tensors_of(field))
        return self

    def _set(self, tensors, to_world, name, metadata):
        self._tensors = tensors.view()
        self._tensors.flags.writeable = False
        self._to_world, self._name, self._metadata = to_world, name, metadata

    @property
    def tensors(self) -> NDArray[Any]:
        """The tensors, shape (nz, ny, nx, 3, 3); read-only. Voxels that a file does not have are zero."""
        return self._tensors

    @property
    def to_world(self) -> NDArray[np.float64]:
        """The (4, 4) matrix from indices (i, j, k, 1) of `tensors[k, j, i]` to the world (x, y, z, 1)."""
        return self._to_world.copy()

    @property
    def name(self) -> str:
        """Name of the field in files."""
        return self._name

    @property
    def metadata(self) -> dict[str, str]:
        """What the file says about the field: a dictionary of texts (`tensorray:units`, ...)."""
        return dict(self._metadata)

    @property
    def surface(self) -> tuple[NDArray[np.float64], NDArray[np.uint32]] | None:
        """Points (n, 3), world, and triangles (m, 3) of the surface of the body that the field is in; None: it has
        none."""
        points, triangles = _tensorray.surface_of(self._field)
        return (points, triangles) if len(triangles) else None

    @property
    def bounds(self) -> NDArray[np.float64]:
        """The least and the greatest corner of the volume's axis-aligned box, world; shape (2, 3)."""
        size = np.array(self._tensors.shape[2::-1], float) - 1
        corners = np.array([[x, y, z, 1] for x in (0, size[0]) for y in (0, size[1]) for z in (0, size[2])])
        world = corners @ self._to_world[:3].T
        return np.array([world.min(axis=0), world.max(axis=0)])

    def write(self, file: Path, *, half: bool = False, progress: Progress = None) -> None:
        """Writes the field as FILE.vdb, for the program `tensorray` and others that read OpenVDB.

        half  Store 16-bit floats: three significant digits, half the size.
        """
        with shown(progress) as report:
            _tensorray.write_field(self._field, os.fspath(file), half, report)

    def __reduce__(self):
        """For pickle: other processes get the same bits. (A file would round the transform.)"""
        if self._keys is None:
            return functools.partial(Field, to_world=self._to_world, name=self._name,
                                     surface=self.surface), (self._tensors,)
        return _of_voxels, (self._keys, _tensorray.voxels_of(self._field))

    def __repr__(self):
        nz, ny, nx = self._tensors.shape[:3]
        return f"<tensorray.Field {self._name!r}: {nx} x {ny} x {nz} voxels>"


def _of_voxels(keys, voxels):
    return Field._of(_tensorray.field_of_voxels(keys, voxels), keys)


def read_vdb(file: Path, name: str = "", *,
             derive: Literal["none", "gradient", "hessian", "viscous_stress", "-viscous_stress"] = "none",
             progress: Progress = None) -> Field:
    """Reads a field of an OpenVDB file.

    name    Name of the field; not needed if the file has one.
    derive  "gradient" of a vector grid, "hessian" of a scalar grid, "viscous_stress" of a velocity or its gradient (or
            with "-"), or "none": the grids are the tensor's components.
    """
    keys = {"file": os.path.abspath(os.fspath(file)), **({"name": name} if name else {})}  # In other folders, too.
    if derive != "none":
        keys["derive"] = derive
    with shown(progress) as report:
        return Field._of(_tensorray.read_field(os.fspath(file), json_of(keys), name, derive, report), json_of(keys))


def make(kind: str, resolution: int | Sequence[int] | None = None, *, min: ArrayLike | None = None,
         max: ArrayLike | None = None, progress: Progress = None, **parameters: Any) -> Field:
    """Makes an analytic field: point_load, two_point_load, constant, rotation, shear, vortex or helix.

    resolution  Voxels along the longest axis of the box (voxels are then cubes), or along x, y and z.
    min, max    Corners of the box, world; default: those of the kind.
    parameters  Those of the kind, as `field.generate` of a scene has them: tr.make("vortex", core=0.2).
    """
    keys = {"kind": kind, "resolution": resolution, "min": min, "max": max, **parameters}
    keys = {key: value for key, value in keys.items() if value is not None}
    with shown(progress) as report:
        return Field._of(_tensorray.make_field(json_of(keys), report), json_of({"generate": keys}))


def import_file(*files: Path, array: str | None = None, gradient_of: str | None = None, strain_of: str | None = None,
                viscous_stress_of: str | None = None, negate: bool = False, cells: str | None = None,
                order: str | None = None, frame: str | None = None, resolution: int | Sequence[int] | None = None,
                voxel_size: float | Sequence[float] | None = None, levels: int | None = None,
                finest: float | None = None, error: float | str | None = None, origin: Sequence[float] | None = None,
                bounds: Sequence[float] | None = None, mask: Path | None = None, thickness: float | None = None,
                step: int | str | None = None, boundary: Path | None = None, name: str | None = None,
                units: str | None = None, progress: Progress = None) -> Field:
    """Makes a field of other programs' files: VTK, XDMF, EnSight, ExodusII, CGNS, OpenFOAM, PLOT3D, NRRD, NIfTI,
    MetaImage, MRtrix, NumPy.

    files        One file, or several that belong together (a PLOT3D grid and its solution).
    array        Name of the array that is the tensor, or of its components, with commas: "sxx,syy,szz,sxy,syz,sxz";
                 default: the only array.
    gradient_of  Name of the velocity whose gradient is the tensor.
    strain_of    Name of the displacement whose strain is the tensor.
    viscous_stress_of  Name of the velocity whose viscous stress is the tensor.
    negate       Whether the tensor changes its sign.
    cells        What tensors at cells are between their centres: linear (the default) or constant in each cell.
    order        Order of six components: vtk, fsl, mrtrix, voigt or lower; of four of a plane: plane or 2x2.
    frame        Axes of the components in a medical image: ras, lps, voxels or fsl; default: those of the order.
    resolution   Voxels along the longest edge, or along x, y and z; default: the median cell is a voxel.
    voxel_size   Edge of a voxel, of the coarsest level, world units; of .npy also three, along x, y and z.
    levels       At most so many sizes of voxels, each half of the one before, as the mesh's cells ask: 1 to 4 (4).
    finest       The least edge of a voxel; without voxel_size, the levels are counted from it.
    error        Refine where voxels differ from the mesh by more than this part of its peak: 0.01, "1%".
    origin       World (x, y, z) of the centre of the first voxel of a .npy file; default: (0, 0, 0).
    bounds       Crop: (xmin, xmax, ymin, ymax, zmin, zmax).
    mask         A file of voxels with one number each: where it is 0, or does not reach, there is no tensor.
    thickness    Thickness of the slab that a flat mesh becomes; default: a typical edge of its cells.
    step         Step of time: a number from 1 on, "first" or "last" (the default).
    boundary     File.ply to write: the surface of the body that the mesh lies around, for `obstacles` of a scene.
    name, units  Name of the field (default: the array's), and units of the tensor.

    Warns (UserWarning) where sampling loses much of the tensor's peak. Runs `tensorray-import`, which is a part of the
    package `tensorray`, or is built by `tools/setup release import`.
    """
    if not files:
        raise ValueError("import_file: give a file")
    program = os.path.join(programs(), "tensorray-import")
    if not os.path.exists(program):
        raise RuntimeError(f"imports need {program}, which is not built; run `tools/setup release import`")
    options = {"--array": array, "--gradient-of": gradient_of, "--strain-of": strain_of,
               "--viscous-stress-of": viscous_stress_of, "--cells": cells, "--order": order, "--frame": frame,
               "--resolution": resolution, "--voxel-size": voxel_size, "--levels": levels, "--finest": finest,
               "--error": error, "--origin": origin, "--bounds": bounds, "--mask": mask, "--thickness": thickness,
               "--steps": step, "--boundary": boundary, "--name": name, "--units": units}
    with tempfile.TemporaryDirectory() as folder:
        vdb = os.path.join(folder, "field.vdb")
        command = [program, "--tell-progress", "-q", "-o", vdb, *["--negate"] * negate]
        for option, value in options.items():
            if value is not None:
                values = value if isinstance(value, (tuple, list, np.ndarray)) else [value]
                command += [option, *map(str, values)]
        with shown(progress) as report:
            status, messages = _run([*command, "--", *map(os.fspath, files)], report)
        if status != 0:
            error = messages[-1] if messages else "the import crashed; the file may be damaged"
            raise (ValueError if status == 2 else RuntimeError)(error)
        for message in messages:
            warnings.warn(message.removeprefix("warning: "), stacklevel=2)
        keys = json_of({"file": os.path.abspath(os.fspath(files[0]))})
        return Field._of(_tensorray.read_field(vdb, keys, "", "none", None), keys)


def imported(function, scene, field, frame, choices, progress, outputs=()):
    """The scene, the field and the frame to take, where the scene may be a file, or a list of files, for import_file. A
    `frame` that is a word is that of the import."""
    if isinstance(frame, str):
        choices, frame = {**choices, "frame": frame}, None
    for name in choices.keys() - inspect.signature(import_file).parameters.keys():
        raise TypeError(f"{function}() got an unexpected keyword argument {name!r}")
    files = scene if isinstance(scene, (list, tuple)) else [scene]
    if isinstance(scene, (list, tuple)) or isinstance(scene, (str, os.PathLike)) and needs_import(scene):
        if field is not None:
            raise ValueError("field: the scene is a file that is imported as one; give one of them")
        read = [file for file in (*files, choices.get("mask")) if file is not None and os.path.exists(file)]
        if any(os.path.exists(output) and os.path.samefile(output, file) for output in outputs for file in read):
            raise ValueError("outputs: one of them is a file that is read; choose another")
        return None, import_file(*files, **choices, progress=progress), frame
    if choices:
        raise ValueError(f"imports: only files that have to be imported have these choices: {', '.join(choices)}")
    return scene, field, frame


def needs_import(file):
    """Whether a file is neither a scene, which begins with "{" or a comment, nor an OpenVDB file."""
    name = os.fspath(file)
    if os.path.isdir(name) or name.lower().endswith(".foam") or os.path.basename(name) == "controlDict":  # OpenFOAM's.
        return True
    if name.endswith(".vdb") or name.lower().endswith(".json") or not os.path.isfile(name):
        return False
    with open(name, "rb") as stream:
        return stream.read(4096).lstrip()[:1] not in (b"{", b"/")


def programs():
    """The folder `bin` of the build folder, or of the prefix, that has this package; or that of another `tensorray`."""
    parent = os.path.dirname(os.path.abspath(_tensorray.__file__))
    while parent != os.path.dirname(parent):
        if os.path.exists(os.path.join(parent, "bin", "tensorray")):
            return os.path.join(parent, "bin")
        parent = os.path.dirname(parent)
    installed = shutil.which("tensorray")
    return os.path.dirname(installed) if installed else "/usr/bin"


def _run(command, report):
    """Runs tensorray-import. Returns its status, and the lines of its standard error."""
    with tempfile.TemporaryFile("w+", errors="surrogateescape") as errors:
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True,
                              errors="surrogateescape") as child:
            try:
                for line in child.stdout:
                    phase, *counts = line.rstrip().split("\t")
                    if report and len(counts) == 2 and int(counts[1]) > 0:
                        report(phase, int(counts[0]), int(counts[1]))
            except BaseException:
                child.terminate()
                raise
        errors.seek(0)
        return child.returncode, [line.removeprefix("tensorray: ") for line in errors.read().splitlines()]


def invariant(field: Field, name: str, *, progress: Progress = None) -> NDArray[np.float32]:
    """A number that describes the tensor at each voxel, whatever the axes: an array (nz, ny, nx) of float32.

    name  One of tr.INVARIANTS: "norm", "trace", "von_mises", "vorticity", ...

    Its unit is that of the tensor, to the power of the invariant's degree. Voxels without a tensor are NaN.
    """
    with shown(progress) as report:
        return _tensorray.invariant(module_field("invariant", field), name, report)
