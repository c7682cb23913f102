"""A formula that a person wrote as text, as a callable on numbers or CasADi expressions. It is never executed as code.

The text is parsed to a syntax tree; every node must be on a short list, and only such a tree is evaluated, with
`simpleeval`. Length, nesting and exponents are bounded, so any text is at once either a formula or one clear error.
"""

from __future__ import annotations

import ast
import math
import operator
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from keyword import iskeyword
from types import MappingProxyType
from typing import Any

import casadi as ca

from softnlp.base.errors import MaterialError, nearest

MAX_LENGTH = 1000  # characters
MAX_NESTING = 64  # levels of the syntax tree; each costs three stack frames in simpleeval
MAX_EXPONENT = 100.0  # of a number as exponent

FUNCTIONS: Mapping[str, Callable[[Any], Any]] = MappingProxyType(
    {
        name: getattr(ca, name)
        for name in (
            *("exp", "expm1", "log", "log1p", "log10", "sqrt", "sin", "cos", "tan", "asin", "acos", "atan"),
            *("sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "erf"),
        )
    }
)
VARIABLE = "stretch"
_ALLOWED = f"numbers, the names, + - * / **, parentheses and {', '.join(FUNCTIONS)}"
_FOREIGN_CHARACTER = re.compile(r"[^A-Za-z0-9_+\-*/(). ]")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def _power(base: Any, exponent: Any) -> Any:
    """Return base ** exponent with a bounded exponent, without the complex numbers of Python."""
    if isinstance(exponent, float):
        if not abs(exponent) <= MAX_EXPONENT:
            raise MaterialError(f"the exponent {exponent:g} in the formula is too large; at most {MAX_EXPONENT:g}")
        if isinstance(base, float) and base < 0 and not exponent.is_integer():
            raise MaterialError(f"the power ({base:g})**{exponent:g} in the formula is not a real number")
    return base**exponent


_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = MappingProxyType(
    {
        ast.Add: operator.add,
        ast.Sub: operator.sub,
        ast.Mult: operator.mul,
        ast.Div: operator.truediv,
        ast.Pow: _power,
        ast.USub: operator.neg,
    }
)


def shown(value: Any) -> str:
    """Return how an error shows a value that a person gave: its repr, cut at 80 characters."""
    try:
        text = repr(value)
    except Exception:  # an integer of 10,000 digits has none, and a person's object may do anything
        return f"a value of type {type(value).__name__}"
    return text if len(text) <= 80 else f"{text[:77]}..."


def check_constant_name(name: Any) -> None:
    """Raise `MaterialError` unless a formula can use this name: ASCII letters, digits and _, a letter first."""
    if not isinstance(name, str) or not _NAME.fullmatch(name) or len(name) > MAX_LENGTH or iskeyword(name):
        raise MaterialError(
            f"{shown(name)} cannot name a constant; expected letters a to z, digits and _, a letter first"
        )
    if name == VARIABLE or name in FUNCTIONS:
        raise MaterialError(f"'{name}' cannot name a constant; formulas use the name already")


@dataclass(frozen=True)
class Formula:
    """A checked formula of `stretch` and of `constants`, which are names. Made by `parse_formula`."""

    text: str
    constants: tuple[str, ...]

    def __call__(self, stretch: Any, **constants: Any) -> Any:
        """Return the value of the formula, a number or a CasADi expression as the arguments are.

        Raises `MaterialError` where plain numbers divide by zero, overflow or have no real power. On expressions these
        give inf or nan where the result is evaluated.
        """
        # Imported late: whoever has no formula does not pay for it.
        from simpleeval import InvalidExpression, SimpleEval

        # Integers of Python have no largest value, so 9**9**9 would not end; floats overflow.
        values = {VARIABLE: stretch, **constants}
        values = {name: float(value) if isinstance(value, int) else value for name, value in values.items()}
        evaluator = SimpleEval(operators=dict(_OPERATORS), functions=dict(FUNCTIONS), names=values)
        # A second wall behind `_check_node`: without a handler, simpleeval cannot evaluate an attribute or a subscript.
        handlers = {kind: evaluator.nodes[kind] for kind in (ast.Name, ast.UnaryOp, ast.BinOp, ast.Call)}
        evaluator.nodes = {**handlers, ast.Constant: lambda node: float(node.value)}
        try:
            return evaluator.eval(self.text, previously_parsed=_tree(self.text))
        except ZeroDivisionError:
            raise MaterialError(f"the formula {shown(self.text)} divides by zero") from None
        except (OverflowError, InvalidExpression) as error:
            raise MaterialError(f"the formula {shown(self.text)} cannot be evaluated: {error}") from None


def parse_formula(text: Any, constants: Iterable[str]) -> Formula:
    """Return the formula in `text`, which must use `stretch`, every one of `constants`, and no other name.

    Raises
    ------
    MaterialError
        The text is not a formula, or a name in it is unknown, or one it should use is missing.
    """
    if not isinstance(text, str):
        raise MaterialError(f"a formula must be text, got {shown(text)}")
    if len(text) > MAX_LENGTH:
        raise MaterialError(f"a formula has at most {MAX_LENGTH} characters, got {len(text)}")
    text = " ".join(text.split())
    if not text:
        raise MaterialError("the formula is empty")
    if foreign := _FOREIGN_CHARACTER.search(text):
        hint = "; a power is written **" if foreign[0] == "^" else f"; allowed: {_ALLOWED}"
        raise MaterialError(f"{foreign[0]!a} is not allowed in a formula{hint}")
    constants = tuple(constants)
    known = (VARIABLE, *constants)
    used = set()
    for node in _nodes_within_limit(_tree(text)):
        _check_node(node, text, known)
        if isinstance(node, ast.Name):
            used.add(node.id)
    if unused := [name for name in known if name not in used]:
        raise MaterialError(f"the formula {shown(text)} does not use '{unused[0]}'")
    return Formula(text, constants)


def _tree(text: str) -> ast.expr:
    """Return the syntax tree of one expression; parsing runs nothing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # text like "1if" only warns
            return ast.parse(text, mode="eval").body
    except SyntaxError as error:
        raise MaterialError(f"{shown(text)} is not a formula: {error.msg}") from None
    except (ValueError, RecursionError, MemoryError):
        raise MaterialError(f"{shown(text)} is not a formula: nested too deeply") from None


def _nodes_within_limit(root: ast.expr) -> Iterator[ast.AST]:
    """Yield every node of the tree, without recursion; raise at the first one nested too deeply."""
    pending: list[tuple[ast.AST, int]] = [(root, 1)]
    while pending:
        node, depth = pending.pop()
        if depth > MAX_NESTING:
            raise MaterialError(
                f"the formula is nested too deeply: at most {MAX_NESTING} levels, where each term of a long sum or "
                "product is one"
            )
        yield node
        children: Iterable[ast.AST] = ast.iter_child_nodes(node)
        if isinstance(node, ast.Call):
            children = node.args  # `_check_node` has judged its name
        below = [(child, depth + 1) for child in children if isinstance(child, ast.expr)]
        pending += reversed(below)


def _check_node(node: ast.AST, text: str, known: tuple[str, ...]) -> None:
    """Raise `MaterialError` unless this node, its children aside, may stand in a formula."""
    match node:
        case ast.Name(id=name):
            if name in FUNCTIONS:
                raise MaterialError(f"the function '{name}' needs an argument in parentheses")
            if name not in known:
                raise MaterialError(f"unknown name {shown(name)} in the formula{nearest(name, known)}")
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            if not _is_finite(value):
                raise MaterialError("a number in the formula is too large")
        case ast.BinOp(op=op) | ast.UnaryOp(op=op) if type(op) in _OPERATORS:
            pass
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=keywords):
            if name in known:
                raise MaterialError(f"'{name}' is not a function; a product is written '{name} * (...)'")
            if name not in FUNCTIONS:
                raise MaterialError(f"unknown function {shown(name)} in the formula{nearest(name, FUNCTIONS)}")
            if keywords or len(arguments) != 1 or isinstance(arguments[0], ast.Starred):
                raise MaterialError(f"the function '{name}' takes one argument")
        case _:
            # The text is one line of ASCII, so columns are characters.
            excerpt = text[getattr(node, "col_offset", 0) : getattr(node, "end_col_offset", None)]
            raise MaterialError(f"{shown(excerpt)} is not allowed in a formula; allowed: {_ALLOWED}")


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(float(value))
    except OverflowError:  # an integer beyond the largest float
        return False
