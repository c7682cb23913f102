"""Stress-stretch laws of incompressible silicones in uniaxial tension (model section 2).

A law is one formula of engineering stress; its true stress and tangent modulus are derived by CasADi. Everything is in
Pa; only a person's own law is written in MPa, as files hold it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from numbers import Real
from types import MappingProxyType
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from softnlp.base.errors import MaterialError
from softnlp.base.units import MEGAPASCAL
from softnlp.model.formula import check_constant_name, parse_formula, shown

SYMBOLS = (ca.SX, ca.MX)
_ADVICE = "use operators and casadi functions such as casadi.exp, no numpy or math functions, no branch on a value"


@dataclass(frozen=True)
class Constant:
    """A constant of a law; in Pa or 1 inside the package.

    Attributes
    ----------
    name
        As the law's formula has it.
    unit
        The one it has in files, "MPa" or "1".
    """

    name: str
    unit: str

    @property
    def file_key(self) -> str:
        """Key in files, with the unit as suffix: `C10_MPa`, but `b1`."""
        return self.name if self.unit == "1" else f"{self.name}_{self.unit}"

    @property
    def scale(self) -> float:
        """SI value of one file unit, [Pa] or [1]."""
        return 1.0 if self.unit == "1" else MEGAPASCAL


class LawFunctions(NamedTuple):
    """`casadi.Function`s of (stretch, constants in law order); each argument is a scalar.

    Attributes
    ----------
    engineering_stress, true_stress
        Stress, a number [Pa].
    tangent_modulus
        E_t, a number [Pa].
    """

    engineering_stress: Any
    true_stress: Any
    tangent_modulus: Any


@dataclass(frozen=True, eq=False)
class Law:
    """A stress-stretch law.

    Attributes
    ----------
    name
        As files and scenarios call it.
    constants
        In the order in which its functions take them.
    formula
        formula(stretch, **constants) -> engineering stress [Pa], of operators and casadi functions only.
    modulus
        modulus(stretch, **constants) -> tangent modulus [Pa], for a law where it is not that of Eq. (24),
        d(true stress)/d(stretch).
    """

    name: str
    constants: tuple[Constant, ...]
    formula: Callable[..., Any]
    modulus: Callable[..., Any] | None = None

    @property
    def told(self) -> tuple[str, ...]:
        """Name, constants and formula in words, which do not change with CasADi; a built-in formula by its name."""
        text = getattr(self.formula, "text", None) or getattr(self.formula, "__qualname__", "")
        return self.name, *(constant.file_key for constant in self.constants), str(text)

    @cached_property
    def functions(self) -> LawFunctions:
        """Built on first use. Raises `MaterialError` where the formula is not an expression of the stretch."""
        with _naming(self.name):
            return _build_functions(self)


def _linear(stretch: Any, E_l: Any) -> Any:
    return E_l * (stretch - 1)


def _linear_modulus(stretch: Any, E_l: Any) -> Any:
    return E_l


def _neo_hookean(stretch: Any, mu0: Any) -> Any:
    return mu0 * (stretch - stretch**-2)


def _mooney_rivlin(stretch: Any, C10: Any, C01: Any, C20: Any) -> Any:
    I1 = stretch**2 + 2 / stretch
    return 2 * (stretch - stretch**-2) * (C10 + 2 * C20 * (I1 - 3) + C01 / stretch)


def _yeoh(stretch: Any, C10: Any, C20: Any) -> Any:
    I1 = stretch**2 + 2 / stretch
    return 2 * (stretch - stretch**-2) * (C10 + 2 * C20 * (I1 - 3))


def _ogden(stretch: Any, mu1: Any, b1: Any, mu2: Any, b2: Any) -> Any:
    terms = [mu * (stretch ** (b - 1) - stretch ** (-b / 2 - 1)) for mu, b in ((mu1, b1), (mu2, b2))]
    return terms[0] + terms[1]


def _moduli(*names: str) -> tuple[Constant, ...]:
    return tuple(Constant(name, "MPa") for name in names)


_OGDEN = (Constant("mu1", "MPa"), Constant("b1", "1"), Constant("mu2", "MPa"), Constant("b2", "1"))
LAWS: Mapping[str, Law] = MappingProxyType(
    {
        law.name: law
        for law in (
            Law("linear", _moduli("E_l"), _linear, _linear_modulus),
            Law("neo-hookean", _moduli("mu0"), _neo_hookean),
            Law("mooney-rivlin", _moduli("C10", "C01", "C20"), _mooney_rivlin),
            Law("yeoh", _moduli("C10", "C20"), _yeoh),
            Law("ogden", _OGDEN, _ogden),
        )
    }
)


@dataclass(frozen=True)
class _InPascal:
    """A person's formula or function, in MPa, as a law's, in Pa. A class, so that a law can be pickled."""

    function: Callable[..., Any]

    @property
    def text(self) -> str:
        """That of a formula."""
        return str(getattr(self.function, "text", ""))

    def __call__(self, stretch: Any, **constants: Any) -> Any:
        return MEGAPASCAL * _single(self.function(stretch, **constants))


@dataclass(frozen=True)
class _Traced:
    """A person's function as CasADi traced it, in Pa: any process can be sent it, wherever the function was defined.

    text : its operations, with every number in full.
    """

    text: str
    stress: Any = field(compare=False)

    def __call__(self, stretch: Any, **constants: Any) -> Any:
        return self.stress(stretch, *constants.values())


def formula_law(name: str, formula: str, constants: Iterable[str]) -> Law:
    """Return a law from text such as `"c * (stretch - stretch**-2)"`.

    Parameters
    ----------
    name
        Of the law; not that of a built-in one.
    formula
        Engineering stress in MPa; `softnlp.model.formula` says what it may hold.
    constants
        The names that the text uses beside `stretch`; their values go in as the text means them (unit "1").

    Returns
    -------
    Law
        In Pa, as every law.

    Raises
    ------
    MaterialError
        With the key "formula" where it is not a formula of these names.
    """
    names = _own_names(name, constants)
    try:
        with _naming(name):
            parsed = parse_formula(formula, names)
        return _own_law(name, parsed, names)
    except MaterialError as error:
        raise error.located(key="formula") from None


def function_law(name: str, function: Callable[..., Any], constants: Iterable[str]) -> Law:
    """Return a law from a Python function, which is called once, with symbols.

    Parameters
    ----------
    name
        Of the law; not that of a built-in one.
    function
        function(stretch, **constants) -> engineering stress in MPa, of operators and casadi functions.
    constants
        The names of its other arguments, as in `formula_law`.

    Returns
    -------
    Law
        In Pa, as every law.

    Raises
    ------
    MaterialError
        For a function that is no expression of the stretch.
    """
    names = _own_names(name, constants)
    with _naming(name):
        if not callable(function):
            raise MaterialError(f"expected a function, got {shown(function)}")
    law = _own_law(name, function, names)
    stress = law.functions.engineering_stress
    return replace(law, formula=_Traced(_listed(stress), stress))


def _own_law(name: str, function: Callable[..., Any], names: tuple[str, ...]) -> Law:
    law = Law(name, tuple(Constant(constant, "1") for constant in names), _InPascal(function))
    _ = law.functions  # built now, so that a function that cannot be used is known now
    return law


def _own_names(name: Any, constants: Iterable[str]) -> tuple[str, ...]:
    """Return the names of a new law's constants; raise `MaterialError` where it or they cannot be called so."""
    if not isinstance(name, str) or not name.strip():
        raise MaterialError(f"expected the name of a law, got {shown(name)}")
    if name in LAWS:
        raise MaterialError(f"'{name}' is a built-in law; a law of your own needs another name")
    with _naming(name):
        if isinstance(constants, str) or not isinstance(constants, Iterable):
            raise MaterialError(f"expected a list of names of constants, got {shown(constants)}")
        names = tuple(constants)
        for index, constant in enumerate(names):
            check_constant_name(constant)
            if constant in names[:index]:
                raise MaterialError(f"the constant '{constant}' is named twice")
    return names


@contextmanager
def _naming(law: str) -> Iterator[None]:
    """Put the law's name before the text of a `MaterialError` that passes."""
    try:
        yield
    except MaterialError as error:
        raise MaterialError(f"law {shown(law)}: {error.message}") from None


def _build_functions(law: Law) -> LawFunctions:
    """Trace the law once on symbols of its own."""
    stretch = ca.SX.sym("stretch")
    constants = {c.name: ca.SX.sym(c.name) for c in law.constants}
    arguments = [stretch, *constants.values()]
    try:
        with warnings.catch_warnings():
            # Only a warning in casadi; what a numpy function does to a symbol changes between its versions.
            warnings.filterwarnings("error", r"\s*casadi: a numpy function", FutureWarning)
            stress = ca.SX(_single(law.formula(stretch, **constants)))
    except MaterialError:
        raise
    except FutureWarning:
        raise MaterialError(f"the function calls a numpy function on symbols; {_ADVICE}") from None
    except Exception as error:  # a person's function may raise anything
        reason = next(iter(str(error).strip().splitlines()), "no reason given")
        raise MaterialError(
            f"the function failed on symbols ({type(error).__name__}: {reason[:200]}); {_ADVICE}"
        ) from None
    engineering = ca.Function("engineering_stress", arguments, [stress], {"allow_free": True})
    if engineering.has_free():
        raise MaterialError(f"the stress holds symbols that are no argument: {', '.join(engineering.get_free())}")
    if not ca.depends_on(stress, stretch):
        raise MaterialError(f"the stress does not depend on the stretch; {_ADVICE}")
    if not np.isfinite(_literals(engineering)).all():
        raise MaterialError(f"the stress holds a number that is nan or inf; {_ADVICE}")
    true = stretch * stress
    tangent = ca.jacobian(true, stretch) if law.modulus is None else law.modulus(stretch, **constants)
    return LawFunctions(
        engineering,
        ca.Function("true_stress", arguments, [true]),
        ca.Function("tangent_modulus", arguments, [tangent]),
    )


def _single(value: Any) -> Any:
    """Return a law's result if it is one number or scalar expression, else raise `MaterialError`."""
    if isinstance(value, ca.SX) and value.is_scalar():
        return value
    if isinstance(value, Real) and not isinstance(value, bool):
        return value
    raise MaterialError(f"expected one number or casadi expression as the stress, got {shown(value)}")


def _literals(function: Any) -> list[float]:
    """Return the numbers that stand in an SX function's expression graph."""
    instructions = range(function.n_instructions())
    return [function.instruction_constant(k) for k in instructions if function.instruction_id(k) == ca.OP_CONST]


def _listed(function: Any) -> str:
    """Return the operations of an SX function as text, its numbers in full."""
    names = {number: name for name, number in vars(ca).items() if name.startswith("OP_")}
    lines = []
    for k in range(function.n_instructions()):
        number = function.instruction_id(k)
        value = float(function.instruction_constant(k)).hex() if number == ca.OP_CONST else ""
        lines.append(f"{names[number]} {function.instruction_input(k)} {function.instruction_output(k)} {value}")
    return "\n".join(lines)


def evaluate(function: Any, *arguments: Any) -> Any:
    """Evaluate a function of scalars elementwise; kinds and shapes as `softnlp.model.materials.Material` says."""
    if all(isinstance(value, (float, int)) for value in arguments):
        return float(function(*arguments))
    if not any(isinstance(value, (*SYMBOLS, ca.DM)) for value in arguments):
        arrays = np.broadcast_arrays(*(np.asarray(value, float) for value in arguments))
        if arrays[0].size == 0:
            return np.zeros(arrays[0].shape)
        # A row for a scalar argument makes casadi evaluate the function for each entry.
        result = function(*(array.reshape(1, -1) for array in arrays)).full().reshape(arrays[0].shape)
        return result if result.ndim else float(result)
    if any(value.ndim > 2 for value in arguments if isinstance(value, np.ndarray)):
        raise ValueError("an array beside casadi values can have two axes at most, as a casadi matrix has")
    values = [value if isinstance(value, SYMBOLS) else ca.DM(value) for value in arguments]
    shape = next((value.shape for value in values if not value.is_scalar()), None)
    if shape is None:
        return function(*values)
    if any(value.shape != shape for value in values if not value.is_scalar()):
        raise ValueError(f"stretch and constants of unlike shapes: {[value.shape for value in values]}")
    rows = [value if value.is_scalar() else ca.reshape(ca.densify(value), 1, -1) for value in values]
    return ca.reshape(function(*rows), *shape)
