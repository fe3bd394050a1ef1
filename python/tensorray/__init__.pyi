from os import PathLike
from typing import Any, Callable, Dict, List, Literal, Mapping, Optional, Protocol, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Path = Union[str, PathLike[str]]
_Progress = Union[None, bool, Callable[[str, int, int], object]]
_Scene = Union[None, _Path, Mapping[str, Any]]
_Eigenvalues = Literal["auto", "raw", "absolute", "positive"]
_Method = Literal["auto", "splitting", "splitting4", "euler", "rk4", "bs23", "dopri5"]
_Interpolation = Literal["cubic", "linear"]
_Border = Literal["fade", "extend"]

__version__: str
RAY_ENDS: Tuple[str, ...]
INVARIANTS: Tuple[str, ...]

class _Executor(Protocol):
    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Any: ...

class SceneError(ValueError): ...

class Field:
    def __init__(self, T: ArrayLike, voxel_size: ArrayLike = ..., origin: ArrayLike = ..., *,
                 to_world: Optional[ArrayLike] = ..., name: str = ...) -> None: ...
    @property
    def tensors(self) -> NDArray[Any]: ...
    @property
    def to_world(self) -> NDArray[np.float64]: ...
    @property
    def name(self) -> str: ...
    @property
    def metadata(self) -> Dict[str, str]: ...
    @property
    def bounds(self) -> NDArray[np.float64]: ...
    def write(self, file: _Path, *, half: bool = ..., progress: _Progress = ...) -> None: ...

def read_vdb(file: _Path, name: str = ..., *, derive: Literal["none", "gradient", "hessian"] = ...,
             progress: _Progress = ...) -> Field: ...
def make(kind: str, resolution: Union[None, int, Sequence[int]] = ..., *, min: Optional[ArrayLike] = ...,
         max: Optional[ArrayLike] = ..., progress: _Progress = ..., **parameters: Any) -> Field: ...
def import_file(*files: _Path, array: Optional[str] = ..., gradient_of: Optional[str] = ...,
                strain_of: Optional[str] = ..., cells: Optional[str] = ..., order: Optional[str] = ...,
                frame: Optional[str] = ...,
                resolution: Union[None, int, Sequence[int]] = ...,
                voxel_size: Union[None, float, Sequence[float]] = ...,
                origin: Optional[Sequence[float]] = ..., bounds: Optional[Sequence[float]] = ...,
                thickness: Optional[float] = ...,
                step: Union[None, int, str] = ..., boundary: Optional[_Path] = ..., name: Optional[str] = ...,
                units: Optional[str] = ..., progress: _Progress = ...) -> Field: ...
def invariant(field: Field, name: str, *, progress: _Progress = ...) -> NDArray[np.float32]: ...
def schema() -> Dict[str, Any]: ...

class Render:
    @property
    def linear(self) -> NDArray[np.float32]: ...
    @property
    def alpha(self) -> Optional[NDArray[np.float32]]: ...
    @property
    def aovs(self) -> Dict[str, NDArray[np.float32]]: ...
    @property
    def display(self) -> NDArray[np.float32]: ...
    @property
    def channels(self) -> List[str]: ...
    @property
    def spectral(self) -> Optional[NDArray[np.float32]]: ...
    @property
    def wavelengths(self) -> Optional[NDArray[np.float64]]: ...
    @property
    def photons(self) -> NDArray[Any]: ...
    @property
    def paths(self) -> List[Dict[str, Any]]: ...
    @property
    def statistics(self) -> Dict[str, Any]: ...
    @property
    def scene(self) -> Dict[str, Any]: ...
    @property
    def scale(self) -> float: ...
    @property
    def notes(self) -> List[str]: ...
    @property
    def warnings(self) -> List[str]: ...
    def write(self, *files: _Path) -> None: ...

def render(scene: Union[_Scene, Field] = ..., field: Optional[Field] = ..., *,
           outputs: Union[_Path, Sequence[_Path]] = ..., keep: Union[str, Sequence[str]] = ...,
           changes: Optional[Mapping[str, Any]] = ..., frame: Optional[int] = ..., seed: Optional[int] = ...,
           threads: int = ..., folder: Optional[_Path] = ..., shards: Optional[int] = ...,
           executor: Optional[_Executor] = ..., shard_folder: Optional[_Path] = ...,
           progress: _Progress = ...) -> Render: ...

class Plate:
    center: ArrayLike
    normal: ArrayLike
    size: ArrayLike
    up: ArrayLike
    def __init__(self, center: ArrayLike, normal: ArrayLike = ..., size: ArrayLike = ...,
                 up: ArrayLike = ...) -> None: ...

class Trace:
    positions: NDArray[np.float64]
    directions: NDArray[np.float64]
    lengths: NDArray[np.float64]
    ends: NDArray[np.uint8]
    steps: NDArray[np.uint32]
    along: Optional[NDArray[np.float64]]
    position_jacobians: Optional[NDArray[np.float64]]
    direction_jacobians: Optional[NDArray[np.float64]]
    ways: Optional[List[NDArray[np.float64]]]
    @property
    def landed(self) -> NDArray[np.bool_]: ...

def trace(field: Field, positions: ArrayLike, directions: ArrayLike, s: ArrayLike, *, scale: float = ...,
          plate: Optional[Plate] = ..., jacobians: bool = ..., along: Optional[ArrayLike] = ...,
          turning: Optional[ArrayLike] = ..., ways: bool = ..., method: _Method = ..., step: Optional[float] = ...,
          max_steps: int = ..., max_length: Optional[float] = ..., eigenvalues: _Eigenvalues = ..., smooth: float = ...,
          interpolation: _Interpolation = ..., border: _Border = ..., threads: int = ...,
          progress: _Progress = ...) -> Trace: ...

class Landings:
    starts: NDArray[np.float64]
    landings: NDArray[np.float32]
    ends: NDArray[np.uint8]
    flexibilities: NDArray[np.float64]
    triangles: NDArray[np.uint32]
    areas: NDArray[np.float64]
    center: NDArray[np.float64]
    right: NDArray[np.float64]
    up: NDArray[np.float64]
    size: Tuple[float, float]
    resolution: Tuple[int, int]
    def world(self) -> NDArray[np.float64]: ...

def landings(scene: _Scene = ..., field: Optional[Field] = ..., s: Optional[ArrayLike] = ..., *,
             tolerance: float = ..., changes: Optional[Mapping[str, Any]] = ..., frame: Optional[int] = ...,
             threads: int = ..., folder: Optional[_Path] = ..., progress: _Progress = ...) -> Landings: ...
