"""Renders of scenes."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import tempfile
from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from . import _shards, _tensorray
from ._arguments import Changes, Executor, Path, Progress, Scene, request_of
from ._fields import Field, imported
from ._progress import shown

_PHOTON = np.dtype([("position", "f4", 3), ("direction", "f4", 3), ("origin", "f4", 3), ("wavelength", "f4"),
                    ("power", "f4")])


def render(scene: Scene | Field = None, field: Field | None = None, *, outputs: Path | Sequence[Path] = (),
           keep: str | Sequence[str] = (), changes: Changes = None, frame: int | str | None = None, seed: int | None = None,
           threads: int = 0, folder: Path | None = None, smooth: float | None = None,
           imports: Mapping[str, Any] | None = None, shards: int | None = None, executor: Executor | None = None,
           shard_folder: Path | None = None, progress: Progress = None, **choices: Any) -> Render:
    """Renders a scene, as `tensorray render` does.

    scene     A dictionary with the keys of a scene file (docs/scenes.md, tr.schema()), or the name of a scene file, of
              a field's file (.vdb) or of any file that tr.import_file reads; a list or tuple of names: files of one
              import. None: the light that `field` bends, on a plate.
    field     A Field, instead of the scene's own `field.file` or `field.generate`. Other keys of the scene's `field`
              (scale, smooth, eigenvalues, bounds) stay.
    outputs   Names of files to write: their endings say what they hold, as with -o. The bytes are those that the
              command line writes. Without them nothing is written, whatever the scene's `output` says.
    keep      What else the result holds, beside the picture: "spectral", "photons", and other keys of `output`.
    changes   Changes of the scene, as {"light.photons": 1e5, "integrator.type": "lens"}.
    frame     Number of the frame, if the scene has keyframes; # in names of files is this number ("flow.####.vdb").
    seed      Seed of all random numbers; None: the scene's.
    threads   Greatest number of threads, of each shard if there are such; 0: all. The result does not depend on it.
    folder    Relative paths in a dictionary are relative to this folder; None: the working folder.
    smooth    Deviation of the Gaussian that smooths the field first, voxels; None: the scene's `field.smooth`.
    choices   Arguments of tr.import_file, if `scene` is a file for it: tr.render("plate.vtu", order="vtk"). `imports`
              is a dictionary of them. A `frame` that is a word, as "fsl", is one, too.
    shards    Number of parts that the work is divided into, as by --shard of the command line; None: it is not divided.
              The result has the same bits.
    executor  What makes the shards: an object whose `submit` returns futures, as a ProcessPoolExecutor or Dask's
              Client. None: they are made here, one after the other. The first error, or Ctrl-C, ends all shards.
    shard_folder  A folder that all processes of the executor share: shards are files in it until the call ends. None:
              the folder for temporary files, which all processes of one machine share.
    progress  True or False: whether to show a bar; or a function of (phase, done, total); None: show a bar if standard
              error is a terminal, or in a notebook.

    Returns a Render. Several threads may render at once, also with one field.
    """
    if shards is None and not (executor is None and shard_folder is None):
        raise ValueError("executor, shard_folder: give the number of shards, too, as shards=4")
    if isinstance(scene, Field) and field is None:
        scene, field = None, scene
    files = [outputs] if isinstance(outputs, (str, os.PathLike)) else outputs
    scene, field, frame = imported("render", scene, field, frame, {**(imports or {}), **choices}, progress, files)
    if smooth is not None:
        changes = {**(changes or {}), "field.smooth": smooth}
    arguments = {"function": "render", "scene": scene, "field": field, "changes": changes, "frame": frame,
                 "folder": folder, "seed": seed, "outputs": [os.fspath(name) for name in files],
                 "keep": list(dict.fromkeys(["image", "exr", *([keep] if isinstance(keep, str) else keep)]))}
    with shown(progress) as report, contextlib.ExitStack() as stack:
        made = []
        if shards is not None:
            made = stack.enter_context(_shards.made(arguments, threads, shards=shards, executor=executor,
                                                    shard_folder=shard_folder, report=report))
        return Render(_tensorray.render(request_of(**arguments), made, threads, report))


class Render:
    """The result of `render`. Its arrays are read-only and are not copies; they may outlive it.

    A notebook shows it as its picture.
    """

    def __init__(self, rendered):
        self._rendered = rendered

    @functools.cached_property
    def linear(self) -> NDArray[np.float32]:
        """The picture in scene-linear light: float32, shape (height, width, 3), R, G, B of the working space, rows from
        the top. 1 is the undisturbed light."""
        return self._linear[:, :, :3]

    @functools.cached_property
    def alpha(self) -> NDArray[np.float32] | None:
        """Opacity, shape (height, width); None if the method's picture covers everything."""
        return self._linear[:, :, 3] if self.channels[3:4] == ["A"] else None

    @functools.cached_property
    def aovs(self) -> dict[str, NDArray[np.float32]]:
        """The other channels of the EXR file, by name: {"folds": array (height, width), ...}."""
        return {name: self._linear[:, :, i] for i, name in enumerate(self.channels) if name not in ("R", "G", "B", "A")}

    @functools.cached_property
    def display(self) -> NDArray[np.float32]:
        """The picture for a screen (sRGB, unless the scene says otherwise): float32 from 0 to 1, shape
        (height, width, 3), or 4 with opacity. For Matplotlib: plt.imshow(render.display)."""
        return np.clip(np.nan_to_num(self._rendered.display()), 0, 1)

    @property
    def channels(self) -> list[str]:
        """Names of the channels of the EXR file: R, G, B, perhaps A, and those of `aovs`."""
        return self._rendered.channels()

    @functools.cached_property
    def spectral(self) -> NDArray[np.float32] | None:
        """Spectral irradiance (of the polariscope, radiance), unit of the light's irradiance per nm: float32, shape (height, width, bands). Needs
        keep=["spectral"]; else None."""
        spectral = self._rendered.spectral()
        if spectral is None:
            return None
        bands, channels = len(self.wavelengths), spectral[0].shape[2]
        first = 3 if channels >= 3 + 4 * bands else channels - bands  # S0 of Stokes' parameters.
        return spectral[0][:, :, first:first + bands]

    @property
    def stokes(self) -> NDArray[np.float32] | None:
        """Stokes' parameters S0 to S3 of polariscope, shape (height, width, bands, 4), if the scene has `output.stokes`
        and the render keep=["spectral"]; else None."""
        spectral = self._rendered.spectral()
        bands = 0 if spectral is None else len(self.wavelengths)
        if spectral is None or len(spectral[1]) < 3 + 4 * bands:
            return None
        parts = [spectral[0][:, :, 3 + i * bands:3 + (i + 1) * bands] for i in range(4)]
        return np.stack(parts, axis=-1)

    @functools.cached_property
    def wavelengths(self) -> NDArray[np.float64] | None:
        """The middle wavelengths of the bands of `spectral`, nm: shape (bands,); None without them."""
        spectral = self._rendered.spectral()
        if spectral is None:
            return None
        names = [name for name in spectral[1] if name.startswith("S0.")]
        return np.array([float(name.split(".", 1)[1][:-2].replace(",", ".")) for name in names])

    @functools.cached_property
    def photons(self) -> NDArray[Any]:
        """The photons on the plate, a structured array with position, direction and origin (world), wavelength (nm) and
        power: photons["position"] has the shape (n, 3). Needs keep=["photons"]; else empty."""
        return self._rendered.photons().view(_PHOTON)[:, 0]

    @functools.cached_property
    def paths(self) -> list[dict[str, Any]]:
        """The paths of the method path_tracing, a list of dictionaries: position, direction, change (n, 3), tensor
        (n, 3, 3), length, in_field (n,); and flexibility, wavelength and end of each."""
        return self._rendered.paths()

    @functools.cached_property
    def statistics(self) -> dict[str, Any]:
        """What `--stats` writes: counts of photons by where they ended, power, steps, seconds; a dictionary."""
        return json.loads(self._rendered.statistics())

    @property
    def scene(self) -> dict[str, Any]:
        """The scene that was rendered, a dictionary, with all changes."""
        return json.loads(self._rendered.scene())

    @property
    def scale(self) -> float:
        """The scale of the field: chosen, where the scene leaves it open."""
        return self._rendered.scale()

    @property
    def notes(self) -> list[str]:
        """What was chosen or found while loading, one line each."""
        return self._rendered.notes()

    @property
    def warnings(self) -> list[str]:
        """Problems that the picture does not show by itself, one line each."""
        return self._rendered.warnings()

    def write(self, *files: Path) -> None:
        """Writes files as `outputs` of `render` does, later: either all are complete, or none has changed."""
        self._rendered.write([os.fspath(file) for file in files])

    @functools.cached_property
    def _linear(self):
        return self._rendered.linear()

    def _repr_png_(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "picture.png")
            self.write(file)
            with open(file, "rb") as stream:
                return stream.read()

    def __repr__(self):
        height, width = self._linear.shape[:2]
        return f"<tensorray.Render: {width} x {height} pixels, channels {', '.join(self.channels)}>"
