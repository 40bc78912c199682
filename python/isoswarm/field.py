"""A field F(x, q): immutable, made of shapes, formulas and functions, with all its derivatives."""

from __future__ import annotations

import html
import os
import pickle
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, SupportsFloat

import numpy as np
import numpy.typing as npt

from isoswarm import _core
from isoswarm._arrays import Floats, as_bounds, as_points
from isoswarm.errors import ConvergenceError

__all__ = ["Field", "Operand", "Parameter", "Parameters", "node"]


@dataclass(frozen=True)
class Parameter:
    """One number of a model that can be changed.

    Attributes
    ----------
    value : float
        Present value.
    frozen : bool
        Whether fits and pins leave it alone.
    bounds : pair of float
        Smallest and largest value; infinite where there is none.
    scale : float
        A typical change, against which steps are measured.
    discrete : bool
        A whole number, not differentiated.
    unit : str
        ``"length"``, ``"angle"``, …; empty for a pure number.

    """

    value: float
    frozen: bool
    bounds: tuple[float, float]
    scale: float
    discrete: bool
    unit: str


class Parameters(Mapping[str, Parameter]):
    """Path to :class:`Parameter`, in the order of q. Read-only: see :meth:`Field.with_parameters`."""

    def __init__(self, rows: list[tuple[str, float, bool, float, float, float, bool, str]]) -> None:
        self._rows = {
            path: Parameter(value, frozen, (lo, hi), scale, discrete, unit)
            for path, value, frozen, lo, hi, scale, discrete, unit in rows
        }

    def __getitem__(self, path: str) -> Parameter:
        return self._rows[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def values_array(self) -> Floats:
        """The values, (m,)."""
        return np.array([p.value for p in self._rows.values()], dtype=np.float64)

    def __repr__(self) -> str:
        rows = [f"  {path} = {p.value:g}{' (frozen)' * p.frozen}" for path, p in list(self._rows.items())[:20]]
        more = [f"  … and {len(self) - len(rows)} more"] if len(self) > len(rows) else []
        return "\n".join([f"{len(self)} parameter{'s' * (len(self) != 1)}", *rows, *more])


class Field:
    """A field F(x, q), with F < 0 inside. Immutable.

    Made by :func:`isoswarm.parse`, the shapes and operators, the coordinates of :func:`isoswarm.xyz`,
    :func:`isoswarm.from_function` or :func:`isoswarm.load`.

    Fields combine: ``a | b`` union, ``a & b`` intersection, ``~a`` complement, ``a - b`` difference where both
    are solids (shapes, operators and deformations) and subtraction otherwise, ``+ * / **`` arithmetic; NumPy's
    elementary functions such as ``np.sqrt(x)`` work too.

    Examples
    --------
    >>> import isoswarm as iso, numpy as np
    >>> x, y, z = iso.xyz()
    >>> ring = (np.sqrt(x**2 + y**2) - 1) ** 2 + z**2 - 0.3**2
    >>> ring.value([[1.0, 0.0, 0.0], [1.3, 0.0, 0.0]]).round(3).tolist()
    [-0.09, 0.0]

    """

    __array_priority__ = 1000.0
    __slots__ = ("_model",)
    _model: _core.Model

    def __init__(self, core: _core.Model) -> None:
        """Not for users: see the functions above."""
        if not isinstance(core, _core.Model):
            raise TypeError("make a Field with iso.parse, iso.xyz, a shape, iso.from_function or iso.load")
        self._model = core

    # What it is -----------------------------------------------------------------------------------------------

    @property
    def kind(self) -> str:
        """Kind of the outermost node, such as ``"sphere"`` or ``"union"``."""
        return self._model.kind

    @property
    def name(self) -> str | None:
        """Name given with :meth:`named`."""
        return self._model.name

    @property
    def axes(self) -> int:
        """Number of coordinates: 3 for surfaces in space, 2 for curves in the plane."""
        return self._model.axes

    @property
    def is_solid(self) -> bool:
        """Whether ``-`` means difference: shapes, operators, deformations."""
        return self._model.is_solid

    @property
    def bounds(self) -> tuple[Floats, Floats] | None:
        """A box (lo, hi) that contains the whole surface; None where it is infinite or cannot be found."""
        box = self._model.bounds()
        return None if box is None else (np.array(box[0]), np.array(box[1]))

    def require_bounds(self) -> tuple[Floats, Floats]:
        """:attr:`bounds`, or a ValueError that asks for them."""
        box = self.bounds
        if box is None:
            raise ValueError(
                "bounds: none were given and none can be found for this field (the surface may be infinite); "
                "pass bounds=((x0, y0, z0), (x1, y1, z1)), or bounds=b for the box from -b to b"
            )
        return box

    @property
    def parameters(self) -> Parameters:
        """All parameters by path, in the order of q."""
        return Parameters(self._model.parameters())

    def with_parameters(self, values: Mapping[str, SupportsFloat] | None = None, **more: SupportsFloat) -> Field:
        """The same field with other values of some parameters.

        Parameters
        ----------
        values : mapping
            Path to value; in a path ``*`` stands for anything.
        **more
            The same, for paths that are names.

        Raises
        ------
        UnknownParameterError
            No parameter has that path.
        ValueError
            A value outside what the kind accepts.

        """
        core = self._model
        for path, value in {**(values or {}), **more}.items():
            core = core.with_value(path, float(value))
        return Field(core)

    def freeze(self, *paths: str) -> Field:
        """The same field with these parameters frozen (``*`` stands for anything; none given: all)."""
        return self._each(paths, lambda core, path: core.with_frozen(path, True))

    def release(self, *paths: str) -> Field:
        """The same field with these parameters free (``*`` stands for anything; none given: all)."""
        return self._each(paths, lambda core, path: core.with_frozen(path, False))

    def with_limits(self, path: str, lowest: float, highest: float) -> Field:
        """The same field with other bounds of the parameters that fit `path`."""
        return Field(self._model.with_bounds(path, lowest, highest))

    def with_scale(self, path: str, scale: float) -> Field:
        """The same field with another scale of the parameters that fit `path`."""
        return Field(self._model.with_scale(path, scale))

    def named(self, name: str) -> Field:
        """The same field under a name, which appears in the paths of its parameters."""
        return Field(self._model.named(name))

    def _each(self, paths: tuple[str, ...], change: Any) -> Field:
        core = self._model
        for path in paths or ("*",):
            core = change(core, path)
        return Field(core)

    # What it gives --------------------------------------------------------------------------------------------

    def value(self, X: npt.ArrayLike) -> Floats:
        """F at each point.

        Parameters
        ----------
        X : array_like, (n, 3)
            Points; (n, 2) for curves in the plane.

        Returns
        -------
        ndarray, (n,)

        """
        return self._model.value(as_points(X, self.axes))

    __call__ = value

    def gradient(self, X: npt.ArrayLike) -> Floats:
        """∂F/∂x at each point, (n, 3); the third component is 0 for curves in the plane."""
        return self._model.value_gradient(as_points(X, self.axes))[1]

    def value_gradient(self, X: npt.ArrayLike) -> tuple[Floats, Floats]:
        """F, (n,), and ∂F/∂x, (n, 3), in one go."""
        return self._model.value_gradient(as_points(X, self.axes))

    def parameter_gradient(self, X: npt.ArrayLike) -> Floats:
        """∂F/∂q at each point, (n, m), a column for each parameter that is free and not discrete, in their order."""
        return self._model.parameter_gradient(as_points(X, self.axes))

    def hessian(self, X: npt.ArrayLike) -> Floats:
        """∂²F/∂x² at each point, (n, 3, 3)."""
        return self._model.hessian(as_points(X, self.axes))

    def interval(self, lo: npt.ArrayLike, hi: npt.ArrayLike) -> tuple[float, float]:
        """Numbers that no value of F in the box from `lo` to `hi` is below or above.

        Raises
        ------
        ValueError
            The field has no intervals, because it contains a function that cannot be looked into.

        """
        low, high = as_bounds((lo, hi), self.axes, "lo, hi")
        found = self._model.interval(tuple(low), tuple(high))
        if found is None:
            raise ValueError("this field has no intervals: it contains a function made with iso.from_function")
        return found

    def project(self, X: npt.ArrayLike) -> Floats:
        """The points moved onto the surface F = 0 along the gradient, (n, 3).

        Raises
        ------
        ConvergenceError
            Some point does not reach the surface: the gradient vanishes on the way, or there is none nearby.

        """
        points = as_points(X, self.axes)
        box = self.bounds or (points.min(axis=0, initial=np.inf), points.max(axis=0, initial=-np.inf))
        size = float(np.linalg.norm(box[1] - box[0])) if len(points) else 1.0
        moved, left = _core.project(self._model, points, size or np.inf)
        missed = left > 1e-9 * max(size, float(np.abs(moved).max(initial=0.0)))
        if missed.any():
            i = int(np.argmax(missed))
            raise ConvergenceError(
                f"{int(missed.sum())} of {len(points)} points do not reach the surface, first X[{i}] = "
                f"{points[i].tolist()} (still {left[i]:.2g} off): start closer to it"
            )
        return moved

    # Moved ---------------------------------------------------------------------------------------------------

    def translate(self, x: Operand = 0.0, y: Operand = 0.0, z: Operand = 0.0) -> Field:
        """The field moved by (x, y, z)."""
        return node("translate", self, x=x, y=y, z=z)

    def rotate(self, angle: Operand, axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> Field:
        """The field turned by `angle` (radians) about `axis`, counter-clockwise seen from its tip."""
        ax, ay, az = axis
        return node("rotate", self, angle=angle, ax=ax, ay=ay, az=az)

    def scale(self, s: Operand) -> Field:
        """The field made larger by the factor `s`."""
        return node("scale", self, s=s)

    # Operators ------------------------------------------------------------------------------------------------

    def __or__(self, other: Operand) -> Field:
        return node("union", self, other)

    def __ror__(self, other: Operand) -> Field:
        return node("union", other, self)

    def __and__(self, other: Operand) -> Field:
        return node("intersection", self, other)

    def __rand__(self, other: Operand) -> Field:
        return node("intersection", other, self)

    def __invert__(self) -> Field:
        return node("complement", self)

    def __sub__(self, other: Operand) -> Field:
        solids = self.is_solid and isinstance(other, Field) and other.is_solid
        return node("difference" if solids else "sub", self, other)

    def __rsub__(self, other: Operand) -> Field:
        return node("sub", other, self)

    def __add__(self, other: Operand) -> Field:
        return node("add", self, other)

    def __radd__(self, other: Operand) -> Field:
        return node("add", other, self)

    def __mul__(self, other: Operand) -> Field:
        return node("mul", self, other)

    def __rmul__(self, other: Operand) -> Field:
        return node("mul", other, self)

    def __truediv__(self, other: Operand) -> Field:
        return node("div", self, other)

    def __rtruediv__(self, other: Operand) -> Field:
        return node("div", other, self)

    def __mod__(self, other: Operand) -> Field:
        return node("mod", self, other)

    def __rmod__(self, other: Operand) -> Field:
        return node("mod", other, self)

    def __pow__(self, other: Operand) -> Field:
        return node("pow", self, other)

    def __rpow__(self, other: Operand) -> Field:
        return node("pow", other, self)

    def __neg__(self) -> Field:
        return node("neg", self)

    def __pos__(self) -> Field:
        return self

    def __abs__(self) -> Field:
        return node("abs", self)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        kind = UFUNCS.get(ufunc.__name__)
        if kind is None or method != "__call__" or options:
            known = ", ".join(sorted(UFUNCS))
            raise TypeError(f"np.{ufunc.__name__} does not work on fields; those that do: {known}")
        if any(np.ndim(a) != 0 for a in inputs if not isinstance(a, Field)):
            raise TypeError(f"np.{ufunc.__name__}: a field combines with fields and numbers, not with arrays")
        if kind == "sub":
            first, second = inputs
            return first - second if isinstance(first, Field) else second.__rsub__(first)
        return node(kind, *inputs)

    def __bool__(self) -> bool:
        raise TypeError(
            "a field is neither true nor false; combine with |, & and ~, and take np.minimum and np.maximum"
        )

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        """Whether both are the same tree with the same values."""
        return self._model == other._model if isinstance(other, Field) else NotImplemented

    # Files ---------------------------------------------------------------------------------------------------

    def to_text(self) -> str:
        """The field as a formula; functions appear by name, and names of nodes are lost."""
        return self._model.to_text()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model to a file, whole or not at all; :func:`isoswarm.load` reads it back.

        Parameters
        ----------
        path : str or path
            Ends in ``.iso.json``, which keeps everything, or ``.vm``, a plain tape without parameters.

        Raises
        ------
        ValueError
            Another ending; for ``.vm``, a field with functions that cannot be looked into.
        OSError
            The file cannot be written; what stood there before is unchanged.
        """
        file = Path(path)
        if file.name.lower().endswith(".iso.json"):
            text = self._model.to_json()
        elif file.name.lower().endswith(".vm"):
            text = self._model.to_vm()
        else:
            raise ValueError(f"{file}: expected a file that ends in .iso.json or .vm")
        _core.write_bytes(file, text.encode())

    # A field never changes: it is its own copy.

    def __copy__(self) -> Field:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Field:
        return self

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        """For pickling: as in a file."""
        if self._model.is_opaque:
            raise pickle.PicklingError(
                f"{self!r} calls a Python function, which cannot be pickled with it: send the function and build the "
                "field there, with iso.from_function"
            )
        return _unpickled, (self._model.to_json(),)

    # For people -----------------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        names = list(self.parameters)
        shown = ", ".join(names[:4]) + ", …" * (len(names) > 4)
        name = f" {self.name!r}" if self.name else ""
        return f"<Field{name}: {self.kind}, {self.axes} axes, {len(names)} parameters{f' ({shown})' * bool(names)}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td style='text-align:left'>{html.escape(path)}</td><td>{p.value:g}</td>"
            f"<td>{'frozen' if p.frozen else ''}</td></tr>"
            for path, p in list(self.parameters.items())[:30]
        )
        return f"<div><code>{html.escape(repr(self))}</code><table>{rows}</table></div>"


Operand = Field | SupportsFloat
"""What combines with a field: another field, or a number."""

UFUNCS = {
    "negative": "neg",
    "absolute": "abs",
    "fabs": "abs",
    "add": "add",
    "subtract": "sub",
    "multiply": "mul",
    "divide": "div",
    "power": "pow",
    "float_power": "pow",
    "minimum": "min",
    "maximum": "max",
    "fmin": "min",
    "fmax": "max",
    "sqrt": "sqrt",
    "square": "square",
    "hypot": "hypot",
    "cbrt": "cbrt",
    "exp": "exp",
    "exp2": "exp2",
    "log": "ln",
    "log2": "log2",
    "log10": "log10",
    "sin": "sin",
    "cos": "cos",
    "tan": "tan",
    "arcsin": "asin",
    "arccos": "acos",
    "arctan": "atan",
    "arctan2": "atan2",
    "sinh": "sinh",
    "cosh": "cosh",
    "tanh": "tanh",
    "arcsinh": "asinh",
    "arccosh": "acosh",
    "arctanh": "atanh",
    "sign": "sign",
    "floor": "floor",
    "ceil": "ceil",
    "trunc": "trunc",
    "rint": "round",
    "remainder": "mod",
}
"""NumPy's elementary functions and the kinds of node that they make."""


def node(kind: str, *arguments: Operand, **parameters: Operand) -> Field:
    """A node of a kind: operands first, then parameters in order or by keyword."""
    positional = [_argument(a) for a in arguments]
    return Field(_core.Model.node(kind, positional, {key: _argument(a) for key, a in parameters.items()}))


def _unpickled(text: str) -> Field:
    """A field from what :meth:`Field.__reduce__` wrote."""
    return Field(_core.Model.from_json(text, []))


def _argument(value: Any) -> Any:
    """A field or number as the core takes it."""
    if isinstance(value, Field):
        return value._model
    number: Any = value
    if isinstance(value, bool | np.bool_) or not isinstance(value, SupportsFloat) or np.ndim(number) != 0:
        raise TypeError(f"expected a field or a number, given {value!r:.60}")
    return float(value)
