"""Single rays, and the landings of a scene's light."""

from __future__ import annotations

import dataclasses
import math
import sys
from typing import Any, Literal, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tensorray
from ._arguments import Changes, Eigenvalues, Method, Path, Progress, Scene, module_field, request_of
from ._fields import Field, imported
from ._progress import shown


@dataclasses.dataclass
class Plate:
    """A rectangle on which rays end. Any side of it collects light.

    center  Its middle, world. normal: any length. size: width and height, world units. up: its upper edge.
    """

    center: ArrayLike
    normal: ArrayLike = (0, 0, 1)
    size: ArrayLike = (1, 1)
    up: ArrayLike = (0, 0, 1)


@dataclasses.dataclass
class Trace:
    """The result of `trace`: arrays with one row a ray."""

    positions: NDArray[np.float64]  #: Where rays ended, world: (n, 3). Rays that missed: where they left the volume.
    directions: NDArray[np.float64]  #: Unit directions there: (n, 3).
    lengths: NDArray[np.float64]  #: Lengths of the ways, world units: (n,).
    ends: NDArray[np.uint8]  #: Why they ended, numbers for tr.RAY_ENDS: (n,); 0 is on the plate.
    steps: NDArray[np.uint32]  #: Numbers of steps: (n,).
    along: NDArray[np.float64] | None = None  #: The vectors along which starts were moved: (n, 3, 2).
    position_jacobians: NDArray[np.float64] | None = None  #: Derivatives of `positions` along them: (n, 3, 2).
    direction_jacobians: NDArray[np.float64] | None = None  #: Derivatives of `directions` along them: (n, 3, 2).
    ways: list[NDArray[np.float64]] | None = None  #: A polyline a ray: a list of arrays (points, 3).
    eigenvalues: str = "raw"  #: How the field's were preprocessed: what "auto" has chosen.
    notes: list[str] = dataclasses.field(default_factory=list)  #: What was found while loading, one line each.

    @property
    def landed(self) -> NDArray[np.bool_]:
        """Whether each ray ended on the plate: (n,) of bool."""
        return self.ends == _tensorray.ray_ends.index("plate")


def trace(field: Field, positions: ArrayLike, directions: ArrayLike, s: ArrayLike, *, scale: float = 1.0,
          plate: Plate | None = None, jacobians: bool = False, along: ArrayLike | None = None,
          turning: ArrayLike | None = None, ways: bool = False, method: Method = "auto", step: float | None = None,
          max_steps: int = 20000, max_length: float | None = None, eigenvalues: Eigenvalues = "auto",
          smooth: float = 0.0, interpolation: Literal["cubic", "linear"] = "cubic",
          border: Literal["auto", "fade", "extend"] = "auto", bounds: Literal["auto", "none"] = "auto",
          threads: int = 0, progress: Progress = None) -> Trace:
    """Follows single rays through a field.

    positions    Starts, world: (n, 3), or (3,) for one ray or for all.
    directions   Directions there, of any length but zero: (n, 3), or (3,) for all.
    s            Flexibilities: a number for all, or (n,).
    scale        Factor on s; 1: s T is in 1/length. `Render.scale` is the one that a scene has chosen.
    plate        A Plate that rays end on. Without one they end where they leave the volume.
    jacobians    Whether to compute the derivatives of the ends along two vectors for each start.
    along        These vectors, world: (n, 3, 2), or (3, 2) for all. Default: two unit vectors across the ray.
    turning      How the directions change along them: the same shapes; default: not at all (parallel light).
    ways         Whether to record the way of each ray.
    method       auto (splitting4 if cubic, splitting if linear), splitting, splitting4, euler, rk4, bs23 or dopri5.
    step         Voxels a step; None: chosen along the ray.
    max_steps    Steps after which a ray is given up.
    max_length   Length after which a ray ends, world units; None: no limit.
    eigenvalues  Preprocessing: auto (absolute where the field is symmetric and not negated, else raw; it is printed
                 which), raw, absolute or positive.
    smooth       Standard deviation of a Gaussian that smooths the field first, voxels; 0: none.
    interpolation
                 What the field is between its voxels: cubic (smooth) or linear.
    border       cubic: whether inactive voxels fade to zero or extend the values of active ones; auto extends them
                 where the field has a surface.
    bounds       auto: light is straight outside the field's surface, if it has one; none: outside the box alone.
    threads      Greatest number of threads; 0: all. The result does not depend on it.

    Returns a Trace. The light of a small area about a start fills |J0 x J1| times that area on the plate, where J0, J1
    are the columns of its position's Jacobian: where this is zero there is a caustic.
    """
    starts, headings, flexibilities = _rays(positions, directions, s)
    if jacobians or along is not None or turning is not None:
        along = _across(headings) if along is None else _for_all(along, len(starts))
        turning = None if turning is None else _for_all(turning, len(starts))
    if plate is not None:
        plate = _tensorray.Plate(*(np.asarray(part, float).ravel() for part in
                                   (plate.center, plate.normal, plate.up, plate.size)))
    request = _tensorray.TraceRequest(
        starts, headings, flexibilities, along, turning, plate, eigenvalues, interpolation, border, bounds,
        float(smooth), method, float(scale), float(step or 0), int(max_steps),
        math.inf if max_length is None else float(max_length), ways)
    with shown(progress) as report:
        traced = Trace(**_tensorray.trace(module_field("trace", field), request, threads, report), along=along)
    if eigenvalues == "auto" and progress is not False:
        print(f"trace: eigenvalues {traced.eigenvalues}", file=sys.stderr)
    return traced


def _rays(positions, directions, s):
    headings = np.atleast_2d(np.asarray(directions, float))
    starts = np.atleast_2d(np.asarray(positions, float))
    flexibilities = np.atleast_1d(np.asarray(s, float))
    if starts.shape[-1] != 3 or headings.shape[-1] != 3 or starts.ndim != 2 or headings.ndim != 2:
        raise ValueError("trace: positions and directions must have the shape (n, 3)")
    count = max(len(starts), len(headings), len(flexibilities))
    try:
        starts = np.broadcast_to(starts, (count, 3))
        headings = np.broadcast_to(headings, (count, 3))
        flexibilities = np.broadcast_to(flexibilities, (count,))
    except ValueError:
        raise ValueError("trace: positions, directions and s must be for the same number of rays") from None
    lengths = np.linalg.norm(headings, axis=1, keepdims=True)
    return starts, np.divide(headings, lengths, out=np.zeros_like(headings), where=lengths > 0), flexibilities


def _for_all(vectors, count):
    return np.ascontiguousarray(np.broadcast_to(np.asarray(vectors, float), (count, 3, 2)))


def _across(directions):
    """Two unit vectors across each direction, as columns: (n, 3, 2)."""
    helper = np.where(np.abs(directions[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(helper, directions)
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-300)
    return np.stack([first, np.cross(directions, first)], axis=2)


@dataclasses.dataclass
class Landings:
    """The result of `landings`: where the light of a scene lands on its plate, as a mesh over its starts."""

    starts: NDArray[np.float64]  #: Where light starts, world: (n, 3).
    landings: NDArray[np.float32]  #: Where it lands, for each flexibility, in pixels from the plate's top left: (n, k, 2).
    ends: NDArray[np.uint8]  #: Why it ended, numbers for tr.RAY_ENDS: (n, k); landings are valid where this is 0.
    flexibilities: NDArray[np.float64]  #: (k,)
    triangles: NDArray[np.uint32]  #: Indices of neighbouring starts: (m, 3). They cover the beam once.
    areas: NDArray[np.float64]  #: Area of the beam in each triangle, world units squared: (m,).
    center: NDArray[np.float64]  #: Middle of the plate, world.
    right: NDArray[np.float64]  #: Unit vector along its width.
    up: NDArray[np.float64]  #: Unit vector along its height.
    size: tuple[float, float]  #: Width and height, world units.
    resolution: tuple[int, int]  #: Pixels along both.

    def world(self) -> NDArray[np.float64]:
        """The landings in the world: (n, k, 3)."""
        x = (self.landings[..., :1] / self.resolution[0] - 0.5) * self.size[0]
        y = (0.5 - self.landings[..., 1:] / self.resolution[1]) * self.size[1]
        return self.center + x * self.right + y * self.up


def landings(scene: Scene = None, field: Field | None = None, s: ArrayLike | None = None, *, tolerance: float = 0.5,
             changes: Changes = None, frame: int | str | None = None, threads: int = 0, folder: Path | None = None,
             imports: Mapping[str, Any] | None = None, progress: Progress = None, **choices: Any) -> Landings:
    """Where the light of a scene lands on its plate: the map whose light `photon_distribution` draws.

    scene, field, changes, frame, threads, folder, imports, progress, choices    As those of `render`.
    s          Flexibilities: a number or several. None: those of the scene's light, evenly spaced between its ends.
    tolerance  Wanted error of landings between starts, pixels. Where the map bends or folds, starts are closer.

    Returns Landings.
    """
    scene, field, frame = imported("landings", scene, field, frame, {**(imports or {}), **choices}, progress)
    request = request_of("landings", scene, field, changes=changes, frame=frame, folder=folder)
    flexibilities = [] if s is None else [float(value) for value in np.atleast_1d(s)]
    if not np.isfinite(flexibilities).all():
        raise ValueError("landings: s must be finite")
    with shown(progress) as report:
        return Landings(**_tensorray.landings(request, flexibilities, float(tolerance), threads, report))
