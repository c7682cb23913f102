"""Formulas that people write: what they mean, and that no text runs code, hangs or ends in anything but one line."""

from __future__ import annotations

import math
import pickle
import time

import casadi as ca
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from softnlp.base.errors import MaterialError
from softnlp.model.formula import (
    FUNCTIONS,
    MAX_EXPONENT,
    MAX_LENGTH,
    MAX_NESTING,
    Formula,
    check_constant_name,
    parse_formula,
)

STRETCHES = (0.7, 1.0, 1.3, 1.9)


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("c * (stretch - stretch**-2)", lambda s, c: c * (s - s**-2)),
        ("-stretch**2 + c", lambda s, c: -(s**2) + c),
        ("2**-c**2 * stretch", lambda s, c: 2 ** (-(c**2)) * s),
        ("1/2/c - stretch - 3", lambda s, c: 0.5 / c - s - 3),
        ("7/2 * stretch + 10 * c", lambda s, c: 3.5 * s + 10 * c),
        ("exp(-c*stretch) + log(stretch) * sqrt(c)", lambda s, c: math.exp(-c * s) + math.log(s) * math.sqrt(c)),
        ("1e-3*c +\n\t.5 * tanh( stretch )", lambda s, c: 1e-3 * c + 0.5 * math.tanh(s)),
        ("stretch ** c - 0x10", lambda s, c: s**c - 16),
    ],
)
def test_a_formula_means_what_python_means(text: str, meaning: object) -> None:
    formula = parse_formula(text, ["c"])
    s, c = ca.SX.sym("s"), ca.SX.sym("c")
    symbolic = ca.Function("f", [s, c], [formula(s, c=c)])
    for stretch in STRETCHES:
        expected = meaning(stretch, 0.8)  # type: ignore[operator]
        assert formula(stretch, c=0.8) == pytest.approx(expected, rel=1e-14)
        assert float(symbolic(stretch, 0.8)) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_every_function_is_the_one_of_its_name(name: str) -> None:
    argument = 1.5 if name == "acosh" else 0.5
    value = parse_formula(f"{name}(stretch)", [])(argument)
    assert value == pytest.approx(getattr(math, name)(argument), rel=1e-14)


def test_integers_are_floats_so_nothing_grows_without_end() -> None:
    formula = parse_formula("c**c**c * stretch", ["c"])
    with pytest.raises(MaterialError, match="exponent"):
        formula(9, c=9)


def test_a_formula_survives_pickling() -> None:
    formula = pickle.loads(pickle.dumps(parse_formula("exp(c) * stretch", ["c"])))
    assert formula(2.0, c=0.0) == 2.0


# Text, and what the error must say.
REFUSED = [
    ("", "empty"),
    ("  \n ", "empty"),
    ("__import__('os').system('true')", "not allowed"),
    ("__import__(stretch)", "unknown function"),
    ("eval(stretch)", "unknown function"),
    ("open(stretch)", "unknown function"),
    ("stretch.__class__", "not allowed"),
    ("stretch.real + 1", "not allowed"),
    ("(1).__class__", "not allowed"),
    ("exp.__globals__", "not allowed"),
    ("stretch.sin()", "not allowed"),
    ("exp(stretch).T", "not allowed"),
    ("lambda: stretch", "not allowed"),
    ("(lambda)(stretch)", "not a formula"),
    ("[stretch for c in c]", "not allowed"),
    ("{stretch}", "not allowed"),
    ("stretch[0]", "not allowed"),
    ("'stretch'", "not allowed"),
    ('f"{stretch}"', "not allowed"),
    ("b'1' * stretch", "not allowed"),
    ("stretch if stretch else c", "not allowed"),
    ("stretch and c", "not allowed"),
    ("not stretch", "not allowed"),
    ("stretch > c", "not allowed"),
    ("stretch is c", "not allowed"),
    ("c := stretch", "not allowed"),
    ("c = stretch", "not allowed"),
    ("stretch; c", "not allowed"),
    ("import os", "not a formula"),
    ("await stretch", "not allowed"),
    ("(yield stretch)", "not allowed"),
    ("stretch // c", "not allowed"),
    ("stretch % c", "not allowed"),
    ("stretch ^ 2", r"a power is written \*\*"),
    ("~stretch", "not allowed"),
    ("+stretch", "not allowed"),
    ("stretch @ c", "not allowed"),
    ("stretch, c", "not allowed"),
    ("()", "not allowed"),
    ("...", "not allowed"),
    ("True * stretch", "not allowed"),
    ("None", "not allowed"),
    ("2j * stretch", "not allowed"),
    ("stretch # a comment", "not allowed"),
    ("stretch * c \\", "not allowed"),
    ("exp(*stretch)", "one argument"),
    ("exp(**stretch)", "one argument"),
    ("exp(x=stretch)", "not allowed"),
    ("exp(stretch c)", "not a formula"),
    ("exp()", "one argument"),
    ("exp * stretch", "needs an argument"),
    ("c(stretch - 1)", r"a product is written 'c \* \(\.\.\.\)'"),
    ("exp(stretch)(c)", "not allowed"),
    ("2stretch", "not a formula"),
    ("1if stretch else c", "not a formula"),
    ("stretch c", "not a formula"),
    ("c * strech", "did you mean 'stretch'"),
    ("c * sqr(stretch)", "did you mean 'sqrt'"),
    ("c * (stretch - 1", "not a formula"),
    ("c * (stretch - 1))", "not a formula"),
    ("c * ", "not a formula"),
    ("c * stretch + nan", "unknown name"),
    ("c * stretch + inf", "unknown name"),
    ("c * stretch * 1e999", "too large"),
    ("c * stretch * 1" + "0" * 400, "too large"),
    ("c * stretch**λ", "not allowed"),
    ("c * ｓtretch", "not allowed"),  # full-width s, which Python would read as s
    ("c * stretсh", "not allowed"),  # Cyrillic es
    ("c * stretch\u202e", "not allowed"),  # right-to-left override
    ("c * stretch\x00", "not allowed"),
    ("c * stretch\ud800", "not allowed"),  # half of a surrogate pair
    ("stretch", "does not use 'c'"),
    ("c * 2", "does not use 'stretch'"),
    ("c * stretch" + " " * MAX_LENGTH, "at most"),
    ("c * stretch" + "+1" * 500_000, "at most"),
    ("(" * 150 + "c*stretch" + ")" * 150 + "*" * 3, "not a formula"),
    ("(" * 490 + "1" + ")" * 490, "not a formula"),
    ("-" * 900 + "stretch", "nested too deeply"),
    ("c*stretch" + "+1" * MAX_NESTING, "nested too deeply"),
    ("stretch" + "**stretch" * 100, "nested too deeply"),
    ("exp(" * 70 + "stretch" + ")" * 70, "nested too deeply"),
]


@pytest.mark.parametrize(("text", "reason"), REFUSED, ids=[repr(text)[:40] for text, _ in REFUSED])
def test_a_text_that_is_no_formula_is_one_clear_line_at_once(
    text: str, reason: str, recwarn: pytest.WarningsRecorder
) -> None:
    start = time.process_time()
    with pytest.raises(MaterialError, match=reason) as caught:
        parse_formula(text, ["c"])
    assert time.process_time() - start < 1.0
    line = str(caught.value)
    assert "\n" not in line
    assert line.isprintable()
    assert len(line) < 400
    assert not recwarn.list


@pytest.mark.parametrize("text", [None, 3, b"stretch", ["stretch"], 10**10_000], ids=lambda value: type(value).__name__)
def test_a_formula_must_be_text(text: object) -> None:
    with pytest.raises(MaterialError, match="must be text"):
        parse_formula(text, [])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("stretch * 9**9**9", "exponent"),
        ("stretch * 9.0**9.0**9.0", "exponent"),
        ("stretch ** (9*9*9)", "exponent"),
        ("stretch ** -101", "exponent"),
        ("stretch ** (1e308*10)", "exponent"),
        ("stretch ** (1e308*10 - 1e308*10)", "exponent"),  # nan
        ("stretch * 1e300**2", "cannot be evaluated"),
        ("stretch * (-2)**0.5", "not a real number"),
        ("stretch / 0", "divides by zero"),
        ("stretch * 0**-1", "divides by zero"),
    ],
)
def test_numbers_that_cannot_be_evaluated_are_an_error_at_once(text: str, reason: str) -> None:
    formula = parse_formula(text, [])
    start = time.process_time()
    for stretch in (1.5, ca.SX.sym("s"), ca.MX.sym("s")):
        if text == "stretch / 0" and not isinstance(stretch, float):
            continue  # inf where it is evaluated
        with pytest.raises(MaterialError, match=reason):
            formula(stretch)
    assert time.process_time() - start < 1.0


def test_the_limits_themselves_are_allowed() -> None:
    check_constant_name("c" * MAX_LENGTH)
    assert parse_formula("stretch + 0**0.5", [])(1.0) == 1.0  # a root of 0 is real
    deepest = parse_formula("stretch" + "+1" * (MAX_NESTING - 1), [])
    assert deepest(1.0) == MAX_NESTING
    longest = "+".join(["(stretch+1+1)"] * 40) + " " * (MAX_LENGTH - 40 * 14 + 1)
    assert len(longest) == MAX_LENGTH
    assert parse_formula(longest, [])(1.0) == 120.0
    assert parse_formula(f"stretch**{MAX_EXPONENT:g}", [])(1.0) == 1.0


@pytest.mark.parametrize("text", ["stretch.real", "stretch[0]", "eval(stretch)", "[stretch]", "stretch // 2", "other"])
def test_a_formula_made_without_its_parser_still_runs_no_code(text: str) -> None:
    with pytest.raises(MaterialError, match="cannot be evaluated"):
        Formula(text, ())(1.5)


def value_or_line(text: str) -> object:
    try:
        return parse_formula(text, ["c"])(1.25, c=0.5)
    except MaterialError as error:
        return str(error)


@given(st.one_of(st.text(alphabet="stretchc019.+-*/() _eE,\n", max_size=40), st.text(max_size=30)))
@example("1_0*stretch*c")
@example("0o7*stretch*c")
@example("stretch**-c")
def test_any_text_is_a_formula_or_one_line(text: str) -> None:
    result = value_or_line(text)
    assert isinstance(result, float) or (isinstance(result, str) and "\n" not in result)


@pytest.mark.parametrize("name", ["c", "C10", "b1", "mu_inf", "C10_MPa", "E"])
def test_names_of_constants(name: str) -> None:
    check_constant_name(name)
    assert parse_formula(f"{name} * stretch", [name])(3.0, **{name: 2.0}) == 6.0


@pytest.mark.parametrize(
    "name",
    ["", "1c", "c d", "c-d", "μ", "__class__", "_c", "lambda", "None", "True", "stretch", "exp", 3, None, "c" * 2000],
)
def test_names_that_no_constant_can_have(name: object) -> None:
    with pytest.raises(MaterialError, match="cannot name a constant"):
        check_constant_name(name)
