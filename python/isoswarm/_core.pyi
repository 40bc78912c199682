from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

__version__: str

Floats = npt.NDArray[np.float64]
Corner = tuple[float, ...]

class Model:
    @staticmethod
    def parse(source: str, names: list[tuple[str, float]], axes: int) -> Model: ...
    @staticmethod
    def node(kind: str, positional: list[Model | float], keyword: dict[str, Model | float]) -> Model: ...
    @staticmethod
    def function(
        name: str,
        parameters: list[tuple[str, float]],
        value: Callable[[Floats, Sequence[float]], Floats],
        gradient: Callable[[Floats, Sequence[float]], Floats] | None,
        parameter_gradient: Callable[[Floats, Sequence[float]], Floats] | None,
        bounds: tuple[Corner, Corner] | None,
    ) -> Model: ...
    @staticmethod
    def from_vm(source: str) -> Model: ...
    @staticmethod
    def from_json(source: str, functions: list[tuple[str, Model]]) -> Model: ...
    def to_json(self) -> str: ...
    def to_vm(self) -> str: ...
    def to_text(self) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def name(self) -> str | None: ...
    @property
    def is_solid(self) -> bool: ...
    @property
    def is_opaque(self) -> bool: ...
    @property
    def operations(self) -> int: ...
    @property
    def axes(self) -> int: ...
    def bounds(self) -> tuple[Corner, Corner] | None: ...
    def parameters(self) -> list[tuple[str, float, bool, float, float, float, bool, str]]: ...
    def with_value(self, path: str, value: float) -> Model: ...
    def with_frozen(self, path: str, frozen: bool) -> Model: ...
    def with_bounds(self, path: str, lowest: float, highest: float) -> Model: ...
    def with_scale(self, path: str, scale: float) -> Model: ...
    def named(self, name: str) -> Model: ...
    def value(self, points: Floats) -> Floats: ...
    def value_gradient(self, points: Floats) -> tuple[Floats, Floats]: ...
    def parameter_gradient(self, points: Floats) -> Floats: ...
    def hessian(self, points: Floats) -> Floats: ...
    def interval(self, lo: Corner, hi: Corner) -> tuple[float, float]: ...

Columns = tuple[Floats, Floats, Floats, npt.NDArray[np.uint64]]

class Scene:
    def __new__(cls, model: Model, settings: str) -> Scene: ...
    @staticmethod
    def from_json(source: str, functions: list[tuple[str, Model]]) -> Scene: ...
    def to_json(self) -> str: ...
    def apply(
        self,
        command: str,
        progress: Callable[[int, int, float, int, Columns, tuple[Floats, Floats], Model], bool] | None,
        every: int | None,
    ) -> dict[str, Any]: ...
    def learn(self, model: Model) -> None: ...
    def model(self) -> Model: ...
    def parameters(self) -> list[tuple[str, float, bool, float, float, float, bool, str]]: ...
    def nodes(self) -> list[tuple[str, str, str | None, int, int]]: ...
    def settings(self) -> str: ...
    @property
    def axes(self) -> int: ...
    @property
    def clock(self) -> int: ...
    @property
    def spacing(self) -> float: ...
    @property
    def is_held(self) -> bool: ...
    @property
    def history(self) -> tuple[int, int]: ...
    @property
    def bounds(self) -> tuple[Corner, Corner]: ...
    @property
    def given(self) -> int: ...
    def floaters(self) -> Columns: ...
    def pins(self) -> list[dict[str, Any]]: ...
    def pin_names(self) -> list[tuple[int, str | None]]: ...
    def marks(self) -> tuple[Floats, Floats]: ...
    def log(self) -> str: ...
    def transfer(self) -> dict[str, Any] | None: ...
    def adapter(self) -> tuple[str, str] | None: ...
    def adapted(self) -> Model | None: ...

class Cloud:
    def __new__(
        cls,
        points: Floats,
        normals: Floats | None = None,
        radii: Floats | None = None,
        areas: Floats | None = None,
        curvatures: Floats | None = None,
        colors: Floats | None = None,
    ) -> Cloud: ...
    def save(self, path: Path) -> None: ...
    def png(
        self,
        *,
        width: int,
        height: int,
        azimuth: float,
        elevation: float,
        style: str,
        coloring: str,
        transparent: bool,
        disc_scale: float | None,
        supersampling: int,
        frame: Floats | None = None,
        ground: bool = True,
    ) -> bytes: ...

class Solid:
    def __new__(
        cls,
        model: Model,
        lo: tuple[float, ...],
        hi: tuple[float, ...],
        *,
        planes: list[tuple[tuple[float, float, float], float]],
        capped: bool,
        opacity: float,
        section: str,
        values: Model | None = None,
    ) -> Solid: ...

class Triangles:
    def __new__(
        cls,
        points: Floats,
        faces: npt.NDArray[np.int64],
        style: str,
        *,
        normals: Floats | None = None,
        curvatures: Floats | None = None,
        colors: Floats | None = None,
    ) -> Triangles: ...

def render(
    cloud: Cloud | None,
    solids: list[Solid],
    meshes: list[Triangles],
    *,
    width: int,
    height: int,
    azimuth: float,
    elevation: float,
    up: tuple[float, ...],
    field_of_view: float,
    projection: str,
    style: str,
    coloring: str,
    transparent: bool,
    disc_scale: float | None,
    supersampling: int,
    ground: bool,
    shadow: float,
    ambient_occlusion: float,
    frame: Floats | None = None,
    progress: Callable[[float], object] | None = None,
) -> tuple[bytes, npt.NDArray[np.uint8], bool, bool]: ...
def colors(values: Floats, map: str) -> Floats: ...
def surface_velocity(
    model: Model, points: Floats, rates: list[tuple[str, float]], spin: tuple[float, ...]
) -> Floats: ...
def kinds() -> str: ...
def sample(
    model: Model,
    *,
    n: int | None,
    spacing: float | None,
    lo: Corner,
    hi: Corner,
    method: str,
    density: Callable[[Floats, Sequence[float]], Floats] | str | None,
    creases: bool,
    seed: int,
    start: Floats | None,
    most: int,
    steps: int | None,
    time_limit: float | None,
    progress: Callable[[str, float, int, int], object] | None,
) -> dict[str, Any]: ...
def mesh(
    model: Model,
    *,
    n: int | None,
    spacing: float | None,
    error: float | None,
    lo: Corner,
    hi: Corner,
    rule: str,
    density: Callable[[Floats, Sequence[float]], Floats] | str | None,
    creases: bool,
    smoothing: int | None,
    intersections: bool,
    seed: int,
    most: int,
    time_limit: float | None,
    progress: Callable[[str, float, int, int], object] | None,
    proof: tuple[Corner, Corner, int] | None,
) -> dict[str, Any]: ...
def mesh_samples(
    model: Model,
    points: Floats,
    normals: Floats,
    radii: Floats,
    creases: Creases | None,
    *,
    components: int,
    unmet: str,
    lo: Corner,
    hi: Corner,
    rule: str,
    smoothing: int | None,
    intersections: bool,
) -> dict[str, Any]: ...

class Creases:
    points: Floats
    corners: npt.NDArray[np.int64]
    certified: bool
    warnings: list[str]
    def edges(self) -> list[tuple[npt.NDArray[np.int64], bool, float]]: ...

class LiveMesh:
    def __new__(cls, lo: Corner, hi: Corner) -> LiveMesh: ...
    def update(
        self, points: Floats, normals: Floats, ids: npt.NDArray[np.uint64], spacing: float
    ) -> dict[str, Any]: ...

def triangle_quality(points: Floats, faces: npt.NDArray[np.int64]) -> tuple[dict[str, Floats], dict[str, Any]]: ...
def format_of(text: str) -> str | None: ...
def read_script(text: str) -> list[tuple[int | None, str]]: ...
def animate(frames: list[bytes], seconds: float) -> bytes: ...
def save_mesh(
    path: Path,
    points: Floats,
    faces: npt.NDArray[np.int64],
    normals: Floats | None = None,
    curvatures: Floats | None = None,
    ids: npt.NDArray[np.uint64] | None = None,
    *,
    corner_normals: Floats | None = None,
    sharp: bool | None = None,
) -> None: ...
def write_bytes(path: Path, content: bytes) -> None: ...
def measure(points: Floats, normals: Floats, bounds: tuple[Corner, ...] | None, axes: int) -> dict[str, float]: ...
def project(model: Model, points: Floats, size: float) -> tuple[Floats, Floats]: ...
def measures(
    model: Model,
    *,
    n: int | None,
    spacing: float | None,
    samples: tuple[Floats, Floats, Floats, int] | None,
    lo: Corner,
    hi: Corner,
    seed: int,
    tolerance: float,
    most: int,
    curvature: bool,
    integrands: list[Callable[[Floats], Floats]],
) -> dict[str, Any]: ...
def certify(model: Model, *, lo: Corner, hi: Corner, boxes: int) -> dict[str, Any]: ...
def patch(
    model: Model,
    *,
    lo: tuple[float, float],
    hi: tuple[float, float],
    wraps: tuple[str, ...],
    n: int | None,
    spacing: float | None,
    seed: int,
    most: int,
    faces: bool,
) -> dict[str, Any]: ...
