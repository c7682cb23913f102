"""What a person reads whose silicone, law or formula is wrong: the whole line, as it stands on the screen."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from softnlp.base.errors import MaterialError
from softnlp.model.formula import Formula, parse_formula, shown
from softnlp.model.laws import LAWS, formula_law, function_law
from softnlp.model.materials import Material, load_materials, material, material_from_table

ADVICE = "use operators and casadi functions such as casadi.exp, no numpy or math functions, no branch on a value"
ALLOWED = (
    "allowed: numbers, the names, + - * / **, parentheses and exp, expm1, log, log1p, log10, sqrt, sin, cos, tan, "
    "asin, acos, atan, sinh, cosh, tanh, asinh, acosh, atanh, erf"
)


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("s.toml").write_text("[S.linear]\nE_l_MPa = 1\n")


def line_of(call: Callable[[], Any]) -> str:
    with pytest.raises(MaterialError) as caught:
        call()
    return str(caught.value)


FILES = [
    ("", 'it is empty; expected a table for each silicone, such as ["Ecoflex 00-50"]'),
    (b"\xff", "expected UTF-8 text, got byte 0xff on line 1"),
    (b"#" * 1_000_001, "too large: expected at most 1 MB, got a file of 1.000001 MB"),
    ("a = 1", "a: expected a table of a silicone, got 1"),
    ("[S]", "[S]: expected the table of a law, such as [S.mooney-rivlin]"),
    (
        "[S]\nlinear = 1",
        "[S] linear: unknown key; known: density_kg_m3, fitted_stretch, source, test, rate, date, set, sets",
    ),
    ("[S.yeo]\nC10_MPa = 1", "[S.yeo]: unknown law 'yeo'; did you mean 'yeoh'? (a law of your own needs a formula)"),
    ("[S.linear]\nE_l = 1", "[S.linear] E_l: unknown constant of law 'linear'; did you mean 'E_l_MPa'?"),
    ("[S.linear]", "[S.linear] E_l_MPa: missing constant of law 'linear'; expected E_l_MPa"),
    ('["é ü".linear]', "[\"é ü\".linear] E_l_MPa: missing constant of law 'linear'; expected E_l_MPa"),
    ('["a\\nb".linear]', "[\"a\\nb\".linear] E_l_MPa: missing constant of law 'linear'; expected E_l_MPa"),
    ('["\\u202eb".linear]', "[\"\\u202eb\".linear] E_l_MPa: missing constant of law 'linear'; expected E_l_MPa"),
    ("[S]\nsource = 3\n[S.linear]\nE_l_MPa = 1", "[S] source: expected text, got 3"),
    ("[S.linear]\nE_l_MPa = 1\nderived = ' '", "[S.linear] derived: expected text, got ' '"),
    ("[S.m]\nformula = 'c*(stretch-1)'\nconstants = 1", "[S.m.constants]: expected a table of constants, got 1"),
    (
        "[S.m]\nformula = 'c*(stretch-1)'\nconstants = {'é' = 1}",
        "[S.m.constants] \"é\": 'é' cannot name a constant; expected letters a to z, digits and _, a letter first",
    ),
    (
        "[S.m]\nformula = 'stretch-1'\nnote = 1",
        "[S.m] note: unknown key; known: formula, constants, derived",
    ),
    (
        "[S]\nfitted_stretch = [1]\n[S.linear]\nE_l_MPa = 1",
        "[S] fitted_stretch: expected two stretches such as [1.0, 2.0], got [1]",
    ),
    (
        "[S]\nfitted_stretch = [2, 1]\n[S.linear]\nE_l_MPa = 1",
        "[S] fitted_stretch: expected a low and a high stretch, the high above 1, got [2, 1]",
    ),
    (
        "[S]\nfitted_stretch = [0.5, 1]\n[S.linear]\nE_l_MPa = 1",
        "[S] fitted_stretch: expected a low and a high stretch, the high above 1, got [0.5, 1]",
    ),
    ("[S]\ndensity_kg_m3 = 0\n[S.linear]\nE_l_MPa = 1", "[S] density_kg_m3: expected a positive number, got 0"),
    (
        "[S.linear]\nE_l_MPa = -1",
        "[S.linear]: law 'linear' of 'S': its tangent modulus at stretch 1 is -1 MPa; it must be positive and finite",
    ),
    (
        "[S.m]\nformula = '0.1*stretch'",
        "[S.m] formula: law 'm' of 'S': its stress at stretch 1 is 0.1 MPa; it must be 0",
    ),
]


@pytest.mark.parametrize(("content", "line"), FILES, ids=range(len(FILES)))
def test_the_line_of_a_materials_file(content: str | bytes, line: str) -> None:
    Path("m.toml").write_bytes(content if isinstance(content, bytes) else content.encode())
    assert line_of(lambda: load_materials("m.toml")) == f"m.toml: {line}"


def test_a_file_of_the_largest_size_is_read() -> None:
    text = b"[S.linear]\nE_l_MPa = 1\n"
    Path("m.toml").write_bytes(text + b"#" * (1_000_000 - len(text)))
    assert list(load_materials("m.toml")) == ["S"]


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (3, "3: expected the path of a TOML file"),
        ("folder", "folder: expected a file, got a directory"),
        ("none.toml", "none.toml: no such file"),
        (Path("none.toml"), "none.toml: no such file"),
        ("no\nne.toml", "'no\\nne.toml': no such file"),
        ("/dev/null", "/dev/null: expected a file, got a device"),
        ("a" * 300, "a" * 300 + ": cannot be read: File name too long"),
    ],
    ids=str,
)
def test_the_line_of_a_path(path: Any, line: str) -> None:
    assert line_of(lambda: load_materials(path)) == line


YEOH = {"name": "S", "model": "yeoh", "constants": {"C10_MPa": 0.01, "C20_MPa": 0.0}}
TABLES: list[tuple[Any, str]] = [
    (3, "expected a table, got 3"),
    ({**YEOH, "file": "x"}, "file: constants come from a file or from this table, not from both"),
    ({**YEOH, "model": "yeo"}, "model: unknown law 'yeo'; did you mean 'yeoh'? (a law of your own needs a formula)"),
    ({**YEOH, "formula": "stretch"}, "formula: the built-in law 'yeoh' has its formula; name yours otherwise"),
    ({**YEOH, "modle": 1}, "modle: unknown key; did you mean 'model'?"),
    ({"name": "S"}, "model: missing key; expected name, model"),
    ({"name": " ", "model": "yeoh"}, "name: expected text, got ' '"),
    ({"name": "Ecoflex", "model": "yeoh"}, "name: unknown silicone 'Ecoflex'; did you mean 'Ecoflex 00-50'?"),
    ({"name": "Ecoflex 00-50", "model": "yeohh"}, "model: unknown law 'yeohh'; did you mean 'yeoh'?"),
]


@pytest.mark.parametrize(("table", "line"), TABLES, ids=range(len(TABLES)))
def test_the_line_of_a_table(table: Any, line: str) -> None:
    place = "[material] " if ": " in line else "[material]: "
    assert line_of(lambda: material_from_table(table)) == f"{place}{line}"


def failing(stretch: Any) -> Any:
    raise ValueError


CALLS: list[tuple[Callable[[], Any], str]] = [
    (lambda: material_from_table({"name": "S", "model": "yeoh", "file": "none"}), "none: no such file"),
    (lambda: material("S", "yeoh", file="s.toml"), "model: S has no constants of law 'yeoh' in s.toml; known: linear"),
    (lambda: material("T", file="s.toml"), "name: unknown silicone 'T' in s.toml; known: S"),
    (lambda: material("S", 3, file="s.toml"), "model: unknown law 3 in s.toml; known: linear"),
    (
        lambda: material(3),
        "name: unknown silicone 3; known: Dragon Skin 10, Ecoflex 00-50, Ecoflex 00-30, Ecoflex 00-20, Ecoflex 00-10",
    ),
    (lambda: Material("S", LAWS["linear"], {}), "E_l: missing constant of law 'linear'; expected E_l"),
    (lambda: Material("S", LAWS["linear"], {"E_l": 1, "x": 2}), "x: unknown constant of law 'linear'; known: E_l"),
    (lambda: Material("S", LAWS["linear"], {"E_l": True}), "E_l: expected a finite number, got True"),
    (
        lambda: Material("S", LAWS["linear"], {"E_l": 10**400}),
        "E_l: expected a finite number, got " + "1" + "0" * 76 + "...",
    ),
    (lambda: Material("S", LAWS["linear"], {"E_l": 1}, density=0), "density: expected a positive number, got 0"),
    (
        lambda: Material("S", formula_law("m", "c*(stretch-1)/(stretch-1.5)", ["c"]), {"c": -0.1}),
        "law 'm' of 'S': its stress at stretch 1.5 is not a finite number",
    ),
    (
        lambda: Material("S", formula_law("m", "c*log(stretch-1)", ["c"]), {"c": 0.1}),
        "law 'm' of 'S': its stress at stretch 1 is not a finite number; it must be 0",
    ),
    (lambda: formula_law("yeoh", "stretch", []), "'yeoh' is a built-in law; a law of your own needs another name"),
    (lambda: formula_law(" ", "stretch", []), "expected the name of a law, got ' '"),
    (lambda: formula_law("m", "stretch", "c"), "law 'm': expected a list of names of constants, got 'c'"),
    (lambda: formula_law("m", "c*stretch", ["c", "c"]), "law 'm': the constant 'c' is named twice"),
    (lambda: formula_law("m", "stretch+", []), "formula: law 'm': 'stretch+' is not a formula: invalid syntax"),
    (
        lambda: formula_law("m", "c*stretch", ["1c"]),
        "law 'm': '1c' cannot name a constant; expected letters a to z, digits and _, a letter first",
    ),
    (
        lambda: formula_law("m", "stretch", ["exp"]),
        "law 'm': 'exp' cannot name a constant; formulas use the name already",
    ),
    (lambda: function_law("m", 3, []), "law 'm': expected a function, got 3"),
    (
        lambda: function_law("m", lambda s: [1], []),
        "law 'm': expected one number or casadi expression as the stress, got [1]",
    ),
    (lambda: function_law("m", lambda s: 3.0, []), f"law 'm': the stress does not depend on the stretch; {ADVICE}"),
    (
        lambda: function_law("m", lambda s: s * np.inf, []),
        f"law 'm': the stress holds a number that is nan or inf; {ADVICE}",
    ),
    (lambda: function_law("m", np.exp, []), f"law 'm': the function calls a numpy function on symbols; {ADVICE}"),
    (
        lambda: function_law("m", lambda s: 1 / 0, []),
        f"law 'm': the function failed on symbols (ZeroDivisionError: division by zero); {ADVICE}",
    ),
    (
        lambda: function_law("m", failing, []),
        f"law 'm': the function failed on symbols (ValueError: no reason given); {ADVICE}",
    ),
    (
        lambda: function_law("m", lambda s: s * ca.SX.sym("q") * ca.SX.sym("r"), []),
        "law 'm': the stress holds symbols that are no argument: q, r",
    ),
]


@pytest.mark.parametrize(("call", "line"), CALLS, ids=range(len(CALLS)))
def test_the_line_of_a_material_or_law(call: Callable[[], Any], line: str) -> None:
    assert line_of(call) == line


FORMULAS: list[tuple[Any, str]] = [
    (3, "a formula must be text, got 3"),
    ("", "the formula is empty"),
    ("x" * 1001, "a formula has at most 1000 characters, got 1001"),
    ("stretch^2", "'^' is not allowed in a formula; a power is written **"),
    ("stretch;", f"';' is not allowed in a formula; {ALLOWED}"),
    ("é*stretch", f"'\\xe9' is not allowed in a formula; {ALLOWED}"),
    ("1 + stretch//2 + 1", f"'stretch//2' is not allowed in a formula; {ALLOWED}"),
    ("stretch*c", "unknown name 'c' in the formula; known: stretch, a"),
    ("2*a", "the formula '2*a' does not use 'stretch'"),
    ("exp*stretch", "the function 'exp' needs an argument in parentheses"),
    ("a(stretch)", "'a' is not a function; a product is written 'a * (...)'"),
    ("sqr(stretch)", "unknown function 'sqr' in the formula; did you mean 'sqrt'?"),
    ("exp()*stretch", "the function 'exp' takes one argument"),
    ("stretch*1e999", "a number in the formula is too large"),
    ("(", "'(' is not a formula: '(' was never closed"),
    (
        "-" * 70 + "stretch",
        "the formula is nested too deeply: at most 64 levels, where each term of a long sum or product is one",
    ),
]


@pytest.mark.parametrize(("text", "line"), FORMULAS, ids=range(len(FORMULAS)))
def test_the_line_of_a_formula(text: Any, line: str) -> None:
    assert line_of(lambda: parse_formula(text, ["a"])) == line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("stretch/0", "the formula 'stretch/0' divides by zero"),
        ("stretch**101", "the exponent 101 in the formula is too large; at most 100"),
        ("stretch*(-2)**0.5", "the power (-2)**0.5 in the formula is not a real number"),
        (
            "stretch*1e300**2",
            "the formula 'stretch*1e300**2' cannot be evaluated: (34, 'Numerical result out of range')",
        ),
    ],
)
def test_the_line_of_a_value(text: str, line: str) -> None:
    assert line_of(lambda: parse_formula(text, [])(1.0)) == line


def test_what_a_material_is_given_is_kept_as_floats() -> None:
    made = Material("S", LAWS["linear"], {"E_l": 1}, density=1000, fitted_stretch=[1, 3])  # type: ignore[arg-type]
    assert (made.fitted_stretch, made.density, dict(made.constants)) == ((1.0, 3.0), 1000.0, {"E_l": 1.0})
    assert [type(x) for x in (made.fitted_stretch, made.density, made.constants["E_l"])] == [tuple, float, float]


def test_a_formula_keeps_the_names_of_its_constants() -> None:
    assert parse_formula(" b *  stretch + a", ["a", "b"]) == Formula("b * stretch + a", ("a", "b"))


def test_a_law_of_ones_own_takes_its_constants_as_they_are_written() -> None:
    law = formula_law("m", "c * (stretch - 1)", ["c"])
    assert [(c.name, c.unit, c.file_key, c.scale) for c in law.constants] == [("c", "1", "c", 1.0)]
    entry = load_materials("s.toml")["S"]
    assert (entry.source, dict(entry.derived)) == ("", {})


def test_a_long_reason_is_cut() -> None:
    def long(stretch: Any) -> Any:
        raise ValueError("b" * 300)

    assert f"(ValueError: {'b' * 200}); use" in line_of(lambda: function_law("m", long, []))


def test_what_is_shown_is_short() -> None:
    assert shown("a" * 78) == "'" + "a" * 78 + "'"
    assert shown("a" * 79) == "'" + "a" * 76 + "..."
    assert shown(10**10_000) == "a value of type int"
