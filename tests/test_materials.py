"""Stress-stretch laws against Table II, their derivatives, laws of the user's own, and what a file can get wrong."""

from __future__ import annotations

import copy
import math
import pickle
import re
import subprocess
import sys
import timeit
from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from softnlp.base.errors import MaterialError
from softnlp.model.materials import (
    LAWS,
    Constant,
    Law,
    Material,
    formula_law,
    function_law,
    load_materials,
    material,
    material_from_table,
)

MPA = 1e6


def I1(s: Any) -> Any:
    return s * s + 2 / s


# Table II again, by hand, in MPa, for numbers, arrays and complex numbers.
FORMULAS: dict[str, Callable[..., Any]] = {
    "linear": lambda s, E_l: E_l * (s - 1),
    "neo-hookean": lambda s, mu0: mu0 * (s - 1 / s**2),
    "mooney-rivlin": lambda s, C10, C01, C20: 2 * (s - 1 / s**2) * (C10 + 2 * C20 * (I1(s) - 3) + C01 / s),
    "yeoh": lambda s, C10, C20: 2 * (s - 1 / s**2) * (C10 + 2 * C20 * (I1(s) - 3)),
    "ogden": lambda s, mu1, b1, mu2, b2: (
        mu1 * (s ** (b1 - 1) - s ** (-b1 / 2 - 1)) + mu2 * (s ** (b2 - 1) - s ** (-b2 / 2 - 1))
    ),
}
TABLE_II: dict[str, dict[str, tuple[float, ...]]] = {
    "Dragon Skin 10": {
        "neo-hookean": (0.07980,),
        "mooney-rivlin": (0.01848, 0.02958, 0.001657),
        "yeoh": (0.04112, -0.0005151),
        "ogden": (1.413, 0.1295, 0.001185, 6.215),
    },
    "Ecoflex 00-50": {
        "neo-hookean": (0.03091,),
        "mooney-rivlin": (0.00376, 0.01558, 0.001047),
        "yeoh": (0.01569, -9.767e-5),
        "ogden": (-3.88e-5, 7.513, -0.01479, -5.983),
    },
    "Ecoflex 00-30": {
        "neo-hookean": (0.01971,),
        "mooney-rivlin": (0.003321, 0.009057, 0.0004978),
        "yeoh": (0.01025, -0.0001674),
        "ogden": (0.1186, 0.3701, 9.457e-5, 7.951),
    },
    "Ecoflex 00-20": {
        "neo-hookean": (0.01361,),
        "mooney-rivlin": (0.002731, 0.00553, 0.0003398),
        "yeoh": (0.006964, -6.619e-5),
        "ogden": (0.01257, 1.345, 0.01078, 1.349),
    },
    "Ecoflex 00-10": {
        "neo-hookean": (0.00964,),
        "mooney-rivlin": (-0.0009413, 0.007575, 0.0005407),
        "yeoh": (0.004857, -1.539e-5),
        "ogden": (342.3, 6.518e-5, 6.371e-5, 7.67),
    },
}
SECANTS_KPA = dict(zip(TABLE_II, (139.6, 55.1, 34.4, 24.0, 17.5), strict=True))
HYPERELASTIC = [(silicone, law) for silicone in TABLE_II for law in TABLE_II[silicone]]
EVERY = [(silicone, law) for silicone in TABLE_II for law in LAWS]
LIBRARY = load_materials()

stretches = st.floats(0.8, 2.5)
silicones = st.sampled_from(EVERY)
quantities = st.sampled_from(["engineering_stress", "true_stress", "tangent_modulus", "shear_modulus"])


def of(silicone: str, law: str) -> Material:
    return LIBRARY[silicone].models[law]


def error_of(action: Callable[[], object]) -> MaterialError:
    """Return the error of an action, after checking that it is one readable line."""
    with pytest.raises(MaterialError) as caught:
        action()
    line = str(caught.value)
    assert line
    assert line.isprintable()
    assert len(line) < 500
    return caught.value


# --- the numbers of the paper -----------------------------------------------------------------------------------------


def test_the_library_holds_the_published_silicones_and_laws() -> None:
    assert list(LIBRARY) == list(TABLE_II)
    for entry in LIBRARY.values():
        assert list(entry.models) == list(LAWS) == list(FORMULAS)
        assert dict(entry.derived) == {"linear": "secant of the Mooney-Rivlin curve at stretch 2"}
        assert "10.1109/TRO.2025.3626601" in entry.source
        for model in entry.models.values():
            assert model.density == 1070.0
            assert model.fitted_stretch == (1.0, 2.0)


@pytest.mark.parametrize(("silicone", "law"), HYPERELASTIC)
def test_stress_is_that_of_table_2(silicone: str, law: str) -> None:
    stretch = np.linspace(0.8, 2.5, 18)
    engineering = FORMULAS[law](stretch, *TABLE_II[silicone][law]) * MPA
    scale = abs(engineering).max()
    np.testing.assert_allclose(of(silicone, law).engineering_stress(stretch), engineering, rtol=0, atol=1e-10 * scale)
    np.testing.assert_allclose(
        of(silicone, law).true_stress(stretch), stretch * engineering, rtol=0, atol=3e-10 * scale
    )


@pytest.mark.parametrize(("silicone", "law"), HYPERELASTIC)
def test_tangent_modulus_is_the_derivative_of_true_stress(silicone: str, law: str) -> None:
    stretch = np.linspace(0.8, 2.5, 18)
    step = 1e-30  # a complex step has no cancellation, so it can be this small
    true_stress = FORMULAS[law](stretch + 1j * step, *TABLE_II[silicone][law]) * (stretch + 1j * step)
    expected = true_stress.imag / step * MPA
    modulus = of(silicone, law).tangent_modulus(stretch)
    np.testing.assert_allclose(modulus, expected, rtol=0, atol=1e-9 * abs(expected).max())
    np.testing.assert_allclose(
        of(silicone, law).shear_modulus(stretch), expected / 3, rtol=0, atol=1e-9 * expected.max()
    )


@pytest.mark.parametrize("silicone", TABLE_II)
def test_linear_modulus_is_the_secant_of_mooney_rivlin_at_stretch_2(silicone: str) -> None:
    linear = of(silicone, "linear")
    secant = FORMULAS["mooney-rivlin"](Decimal(2), *(Decimal(str(c)) for c in TABLE_II[silicone]["mooney-rivlin"]))
    assert linear.constants["E_l"] / MPA == pytest.approx(float(secant), rel=1e-12)
    assert linear.constants["E_l"] / 1e3 == pytest.approx(SECANTS_KPA[silicone], abs=0.05)
    # The linear law overrides Eq. (24): its modulus does not grow with the stretch.
    for stretch in (1.0, 1.5, 2.0):
        assert linear.tangent_modulus(stretch) == linear.constants["E_l"]
        assert linear.true_stress(stretch) == pytest.approx(stretch * (stretch - 1) * linear.constants["E_l"])


@pytest.mark.parametrize("silicone", TABLE_II)
def test_the_hyperelastic_laws_agree_where_they_were_fitted(silicone: str) -> None:
    def spread(stretch: Any) -> Any:
        stresses = np.array([of(silicone, law).engineering_stress(stretch) for law in TABLE_II[silicone]])
        return (stresses.max(axis=0) / stresses.min(axis=0) - 1).max()

    fitted = np.linspace(1.3, 2.0, 71)
    assert spread(fitted) < 0.10
    assert spread(np.array([1.1])) < 0.24
    linear = of(silicone, "linear").engineering_stress(fitted)
    assert 0.25 < abs(linear / of(silicone, "mooney-rivlin").engineering_stress(fitted) - 1).max() < 0.32


def test_moduli_are_positive_where_fitted_and_some_turn_negative_far_beyond() -> None:
    turning = {
        (silicone, law)
        for silicone, law in EVERY
        if (of(silicone, law).tangent_modulus(np.linspace(2.0, 6.0, 401)) < 0).any()
    }
    assert turning == {
        ("Dragon Skin 10", "yeoh"),
        ("Ecoflex 00-30", "yeoh"),
        ("Ecoflex 00-20", "yeoh"),
        ("Ecoflex 00-50", "ogden"),
    }
    for silicone, law in EVERY:
        assert (of(silicone, law).tangent_modulus(np.linspace(1.0, 2.0, 101)) > 0).all()


# --- numbers, arrays and symbols --------------------------------------------------------------------------------------


@given(
    silicones,
    quantities,
    hnp.arrays(float, hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4), elements=stretches),
)
def test_an_array_is_its_entries(which: tuple[str, str], quantity: str, stretch: Any) -> None:
    evaluate = getattr(of(*which), quantity)
    result = evaluate(stretch)
    assert np.shape(result) == stretch.shape
    if stretch.ndim:
        assert isinstance(result, np.ndarray)
        assert result.dtype == float
    expected = [evaluate(float(entry)) for entry in stretch.ravel()]
    assert np.ravel(result).tolist() == expected
    assert all(isinstance(entry, float) for entry in expected)


@given(silicones, quantities, stretches, st.sampled_from([ca.SX, ca.MX]))
def test_a_symbol_is_the_number_it_gets(which: tuple[str, str], quantity: str, stretch: float, kind: Any) -> None:
    model = of(*which)
    expected = getattr(model, quantity)(stretch)
    symbol = kind.sym("stretch")
    constants = {name: kind.sym(name) for name in model.constants}
    symbolic = replace(model, constants=constants)
    values = list(model.constants.values())
    cases = [
        ([symbol], getattr(model, quantity)(symbol), [stretch]),
        ([*constants.values()], getattr(symbolic, quantity)(stretch), values),
        ([symbol, *constants.values()], getattr(symbolic, quantity)(symbol), [stretch, *values]),
    ]
    for arguments, expression, numbers in cases:
        assert isinstance(expression, kind)
        assert float(ca.Function("f", arguments, [expression])(*numbers)) == pytest.approx(
            expected, rel=1e-13, abs=1e-9
        )


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_matrices_of_symbols_are_elementwise(kind: Any) -> None:
    model = of("Ecoflex 00-50", "ogden")
    numbers = np.linspace(1.0, 2.0, 6).reshape(2, 3)
    matrix, mu1 = kind.sym("stretch", 2, 3), kind.sym("mu1")
    symbolic = replace(model, constants={**model.constants, "mu1": mu1})
    function = ca.Function("f", [matrix, mu1], [symbolic.engineering_stress(matrix)])
    expected = model.engineering_stress(numbers)
    np.testing.assert_allclose(function(numbers, model.constants["mu1"]).full(), expected, rtol=1e-13, atol=1e-9)
    # Numbers in the stretch, a symbol in a constant.
    for array in (numbers, numbers[0]):
        mixed = ca.Function("f", [mu1], [symbolic.engineering_stress(array)])(model.constants["mu1"]).full()
        expected = model.engineering_stress(array)
        np.testing.assert_allclose(mixed.reshape(expected.shape), expected, rtol=1e-13, atol=1e-9)
    assert isinstance(model.engineering_stress(ca.DM(numbers)), ca.DM)
    with pytest.raises(ValueError, match="two axes"):
        symbolic.engineering_stress(np.ones((2, 2, 2)))
    with pytest.raises(ValueError, match="unlike shapes"):
        replace(model, constants={**model.constants, "mu1": kind.sym("mu1", 2)}).engineering_stress(matrix)


def test_constants_may_be_arrays() -> None:
    C10 = np.array([0.01, 0.02, 0.03]) * MPA
    many = Material("many", LAWS["yeoh"], {"C10": C10, "C20": 0.0})
    stretch = np.array([[1.2], [1.7]])
    expected = FORMULAS["yeoh"](stretch, C10, 0.0)
    np.testing.assert_allclose(many.engineering_stress(stretch), expected, rtol=1e-14)
    np.testing.assert_allclose(many.engineering_stress(1.2), expected[0], rtol=1e-14)
    assert "tangent modulus" in str(error_of(lambda: replace(many, constants={"C10": -C10, "C20": 0.0})))


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_expressions_can_be_differentiated_inside_a_larger_graph(kind: Any) -> None:
    model = of("Ecoflex 00-30", "mooney-rivlin")
    x, C10 = kind.sym("x"), kind.sym("C10")
    symbolic = replace(model, constants={**model.constants, "C10": C10})
    residual = symbolic.true_stress(1 + x**2) - 3 * x
    slope = ca.Function("slope", [x, C10], [ca.jacobian(residual, x), ca.jacobian(residual, C10)])
    by_x, by_C10 = (float(value) for value in slope(0.6, model.constants["C10"]))
    assert by_x == pytest.approx(model.tangent_modulus(1.36) * 1.2 - 3, rel=1e-12)
    assert by_C10 == pytest.approx(1.36 * 2 * (1.36 - 1.36**-2), rel=1e-12)


def test_a_scalar_rebuilds_nothing() -> None:
    built = 0

    def counted(stretch: Any, c: Any) -> Any:
        nonlocal built
        built += 1
        return c * (stretch - stretch**-2)

    model = Material("x", function_law("counted", counted, ["c"]), {"c": 0.03})
    for stretch in np.linspace(1.0, 2.0, 50):
        model.engineering_stress(float(stretch))
        replace(model, constants={"c": 0.04}).tangent_modulus(float(stretch))
    assert built == 1
    fast = of("Ecoflex 00-50", "ogden")
    assert min(timeit.repeat(lambda: fast.tangent_modulus(1.5), number=100, repeat=5)) / 100 < 1e-3


def test_materials_can_be_sent_to_another_process() -> None:
    own = Material("own", formula_law("mine", "c * (stretch - 1)", ["c"]), {"c": 0.05})
    local = Material("local", function_law("mine", lambda s, c: c * ca.log(s), ["c"]), {"c": 0.05})
    for model in (of("Ecoflex 00-50", "ogden"), own, local):
        for twin in (pickle.loads(pickle.dumps(model)), copy.deepcopy(model)):
            assert twin.tangent_modulus(1.4) == model.tangent_modulus(1.4)
            assert list(twin.constants.items()) == list(model.constants.items())


def test_constants_cannot_change_behind_the_checks() -> None:
    given_constants = {"mu0": 1e4}
    model = Material("x", LAWS["neo-hookean"], given_constants)
    given_constants["mu0"] = -1.0
    assert model.constants["mu0"] == 1e4
    with pytest.raises(TypeError):
        model.constants["mu0"] = -1.0  # type: ignore[index]
    with pytest.raises(TypeError):
        LAWS["mine"] = LAWS["yeoh"]  # type: ignore[index]


def test_importing_materials_is_cheap() -> None:
    heavy = {"simpleeval", "scipy", "matplotlib", "pydantic", "tomlkit", "xarray", "pandas"}
    code = "import sys, softnlp.model.materials as m; m.material('Ecoflex 00-50'); "
    code += f"print(sorted({heavy} & set(sys.modules)))"
    root = Path(__file__).parents[1]
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# --- laws of the user's own -------------------------------------------------------------------------------------------

AS_TEXT = {
    "linear": "E_l * (stretch - 1)",
    "neo-hookean": "mu0 * (stretch - stretch**-2)",
    "mooney-rivlin": "2*(stretch - stretch**-2) * (C10 + 2*C20*(stretch**2 + 2/stretch - 3) + C01/stretch)",
    "yeoh": "2*(stretch - 1/stretch**2) * (C10 + 2*C20*(stretch**2 + 2/stretch - 3))",
    "ogden": "mu1*(stretch**(b1 - 1) - stretch**(-b1/2 - 1)) + mu2*(stretch**(b2 - 1) - stretch**(-b2/2 - 1))",
}
AS_FUNCTION = {"ogden": FORMULAS["ogden"], "yeoh": FORMULAS["yeoh"], "neo-hookean": FORMULAS["neo-hookean"]}


@pytest.mark.parametrize(("silicone", "law"), HYPERELASTIC)
def test_a_built_in_law_written_as_text_or_function_is_the_same(silicone: str, law: str) -> None:
    built_in = of(silicone, law)
    values = dict(zip(built_in.constants, TABLE_II[silicone][law], strict=True))
    laws = [formula_law("mine", AS_TEXT[law], values)]
    if law in AS_FUNCTION:
        laws.append(function_law("mine", AS_FUNCTION[law], values))
    stretch = np.linspace(0.9, 2.2, 14)
    for mine in laws:
        own = Material(silicone, mine, values)
        for quantity in ("engineering_stress", "true_stress", "tangent_modulus"):
            expected = getattr(built_in, quantity)(stretch)
            tolerance = 1e-10 * abs(expected).max()
            np.testing.assert_allclose(getattr(own, quantity)(stretch), expected, rtol=0, atol=tolerance)


def test_an_own_law_that_is_linear_follows_equation_24() -> None:
    own = Material("x", formula_law("mine", AS_TEXT["linear"], ["E_l"]), {"E_l": 0.05})
    assert own.tangent_modulus(1.5) == pytest.approx(0.05e6 * (2 * 1.5 - 1))


def test_casadi_functions_work_in_a_function_law() -> None:
    law = function_law("fung", lambda s, a, b: a * (ca.exp(b * (s - 1)) - 1), ["a", "b"])
    own = Material("x", law, {"a": 0.02, "b": 1.5})
    assert own.engineering_stress(1.4) == pytest.approx(0.02e6 * math.expm1(0.6))
    assert own.tangent_modulus(1.0) == pytest.approx(0.03e6)


def _raises(stretch: Any, c: Any) -> Any:
    raise KeyError("two\nlines")


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        (lambda s, c: c * np.exp(s - 1) - c, "numpy function"),
        (lambda s, c: c * math.exp(s - 1) - c, "does not depend on the stretch"),
        (lambda s, c: c * math.sqrt(s) * (s - 1), "nan or inf"),
        (lambda s, c: c * (s - 1) if s > 1 else 0.0, "failed on symbols"),
        (lambda s, c: c * float(str(s)), "ValueError"),
        (lambda s, c: [c * (s - 1)], "expected one number"),
        (lambda s, c: (c, s), "expected one number"),
        (lambda s, c: ca.vertcat(s, c), "expected one number"),
        (lambda s, c: np.array([s, c]), "expected one number"),
        (lambda s, c: ca.MX.sym("m"), "expected one number"),
        (lambda s, c: ca.SX.sym("other") * (s - 1), "no argument: other"),
        (lambda s, c: None, "expected one number"),
        (lambda s, c: "c", "expected one number"),
        (lambda s, c: True, "expected one number"),
        (lambda s, c: c, "does not depend on the stretch"),
        (lambda s, c: 0.0, "does not depend on the stretch"),
        (lambda s: s - 1, "TypeError"),
        (lambda s, c, d: c * (s - 1), "TypeError"),
        (lambda s, c: 1 / 0, "ZeroDivisionError"),
        (_raises, "KeyError"),
    ],
)
def test_a_function_that_is_no_law_says_what_to_use(function: Callable[..., Any], reason: str) -> None:
    error = error_of(lambda: function_law("mine", function, ["c"]))
    assert re.search(reason, error.message)
    assert "'mine'" in error.message
    if not re.search("expected one number|no argument", reason):
        assert "casadi functions" in error.message


@pytest.mark.parametrize(
    ("formula", "reason"),
    [
        ("c * stretch", "stress at stretch 1 is 0.02 MPa; it must be 0"),
        ("c * (stretch - 1) + 1e-9", "must be 0"),
        ("c / (stretch - 1)", "stress at stretch 1 is not a finite number"),
        ("c * log(stretch - 1)", "stress at stretch 1 is not a finite number"),
        ("-c * (stretch - 1)", "tangent modulus at stretch 1 is -0.02 MPa; it must be positive"),
        ("c * (stretch - 1)**2", "tangent modulus at stretch 1 is 0 MPa"),
        ("c * sqrt(stretch - 1)", "tangent modulus at stretch 1 is inf MPa"),
        ("c * (stretch - 1) / sqrt(1.5 - stretch)", "stress at stretch 1.5 is not a finite number"),
        ("c * (stretch - 1) / (1.5 - stretch)", "stress at stretch 1.5 is not a finite number"),
        ("c * (stretch - 1) * exp(exp(exp(5 * stretch - 4)))", "is not a finite number"),
    ],
)
def test_a_law_that_is_no_material_says_which_and_why(formula: str, reason: str) -> None:
    text = error_of(lambda: Material("X", formula_law("mine", formula, ["c"]), {"c": 0.02})).message
    assert reason in text
    assert "law 'mine' of 'X'" in text


def test_a_narrower_fitted_range_is_all_that_is_checked() -> None:
    law = formula_law("mine", "c * (stretch - 1) / sqrt(1.5 - stretch)", ["c"])
    assert Material("X", law, {"c": 0.02}, fitted_stretch=(1.0, 1.4)).engineering_stress(1.3) > 0


@pytest.mark.parametrize(
    ("action", "reason"),
    [
        (lambda: formula_law("yeoh", "stretch - 1", []), "another name"),
        (lambda: formula_law("", "stretch - 1", []), "name of a law"),
        (lambda: formula_law(3, "stretch - 1", []), "name of a law"),  # type: ignore[arg-type]
        (lambda: formula_law("mine", "c * strech", ["c"]), "did you mean 'stretch'"),
        (lambda: formula_law("mine", "1/0 * c * stretch", ["c"]), "divides by zero"),
        (lambda: formula_law("mine", "c * stretch**9**9**9", ["c"]), "exponent"),
        (lambda: formula_law("mine", "c * (stretch - 1)", "c"), "list of names"),
        (lambda: formula_law("mine", "c * (stretch - 1)", 3), "list of names"),  # type: ignore[arg-type]
        (lambda: formula_law("mine", "c * (stretch - 1)", ["c", "c"]), "twice"),
        (lambda: formula_law("mine", "c * (stretch - 1)", ["c", "c d"]), "cannot name a constant"),
        (lambda: formula_law("mine", "c * (stretch - 1)", ["stretch"]), "cannot name a constant"),
        (lambda: function_law("mine", 3, ["c"]), "expected a function"),  # type: ignore[arg-type]
    ],
)
def test_an_own_law_that_cannot_be_is_an_error(action: Callable[[], object], reason: str) -> None:
    assert reason in error_of(action).message


def test_a_law_made_by_hand_is_checked_too() -> None:
    law = Law("by hand", (Constant("c", "MPa"),), lambda s, c: np.exp(c * s))
    assert "law 'by hand'" in error_of(lambda: Material("X", law, {"c": 1.0})).message


# --- constants from Python --------------------------------------------------------------------------------------------

YEOH = {"C10": 2e4, "C20": 1e2}


@pytest.mark.parametrize(
    ("constants", "key", "reason"),
    [
        ({"C10": 2e4}, "C20", "missing"),
        ({**YEOH, "C01": 1.0}, "C01", "unknown"),
        ({**YEOH, "C10": "2e4"}, "C10", "finite number"),
        ({**YEOH, "C10": True}, "C10", "finite number"),
        ({**YEOH, "C10": math.nan}, "C10", "finite number"),
        ({**YEOH, "C20": -math.inf}, "C20", "finite number"),
        ({**YEOH, "C20": 10**400}, "C20", "finite number"),
        ({**YEOH, "C20": 10**10_000}, "C20", "finite number"),
        ({**YEOH, "C20": None}, "C20", "finite number"),
        ({**YEOH, "C20": 1j}, "C20", "finite number"),
        ({**YEOH, "C20": np.array([1.0, math.nan])}, "C20", "finite number"),
        ({**YEOH, "C20": np.array(["a"])}, "C20", "finite number"),
        ({**YEOH, "C20": ca.DM([1.0, math.inf])}, "C20", "finite number"),
        ([1, 2], None, "expected a table"),
        ({**YEOH, "C10": -1e4}, None, "tangent modulus"),
    ],
)
def test_constants_that_a_law_cannot_have(constants: Any, key: str | None, reason: str) -> None:
    error = error_of(lambda: Material("X", LAWS["yeoh"], constants))
    assert error.key == key
    assert reason in error.message


def test_numbers_of_other_types_are_floats_inside() -> None:
    for number in (20_000, np.float32(20_000), np.int64(20_000), ca.DM(20_000)):
        model = Material("X", LAWS["neo-hookean"], {"mu0": number}, density=np.float64(1100))
        assert type(model.constants["mu0"]) is float
        assert type(model.density) is float
    assert isinstance(Material("X", LAWS["neo-hookean"], {"mu0": 1e4}, density=ca.SX.sym("rho")).density, ca.SX)


@pytest.mark.parametrize("density", [0, -1.0, math.nan, math.inf, "1070", False, [1070]])
def test_density_is_positive(density: Any) -> None:
    error = error_of(lambda: material("Ecoflex 00-50", density=density))
    assert error.key == "density"
    assert "positive number" in error.message


@pytest.mark.parametrize(
    "bounds", [(2.0, 1.0), (1.5, 1.5), (0.5, 0.9), (0.0, 2.0), (1.0, math.inf), (1.0,), 2.0, "12", (1, "2")]
)
def test_a_fitted_range_is_a_range(bounds: Any) -> None:
    assert error_of(lambda: Material("X", LAWS["yeoh"], YEOH, fitted_stretch=bounds)).key == "fitted_stretch"


# --- names, tables and files ------------------------------------------------------------------------------------------


def test_five_line_use() -> None:
    model = material("Ecoflex 00-50")
    assert model.law is LAWS["mooney-rivlin"]
    assert dict(model.constants) == pytest.approx({"C10": 3760.0, "C01": 15580.0, "C20": 1047.0})
    assert material("Ecoflex 00-50", "ogden", density=1200).density == 1200.0


@pytest.mark.parametrize(
    ("arguments", "key", "reason"),
    [
        (("Ecoflex 00-51",), "name", "did you mean 'Ecoflex 00-50'"),
        (("dragonskin 10",), "name", "did you mean 'Dragon Skin 10'"),
        (("steel",), "name", "known: Dragon Skin 10, Ecoflex 00-50"),
        ((3,), "name", "unknown silicone 3"),
        ((["a"],), "name", "unknown silicone"),
        (("Ecoflex 00-50", "mooney"), "model", "did you mean 'mooney-rivlin'"),
        (("Ecoflex 00-50", "gent"), "model", "unknown law 'gent'"),
        (("Ecoflex 00-50", None), "model", "unknown law None"),
        (("Ecoflex 00-50", ["ogden"]), "model", "unknown law ['ogden']"),
    ],
)
def test_an_unknown_name_gets_the_nearest_one(arguments: tuple[Any, ...], key: str, reason: str) -> None:
    error = error_of(lambda: material(*arguments))
    assert error.key == key
    assert reason in error.message


INLINE = {"name": "X", "model": "yeoh", "constants": {"C10_MPa": 0.02, "C20_MPa": 1e-4}}
OWN = {"name": "X", "model": "mine", "formula": "c * (stretch - stretch**-2)", "constants": {"c": 0.02}}


def test_a_table_with_constants_of_its_own() -> None:
    model = material_from_table({**INLINE, "density_kg_m3": 1100, "fitted_stretch": [1, 1.8]})
    assert (model.name, model.law, model.density, model.fitted_stretch) == ("X", LAWS["yeoh"], 1100.0, (1.0, 1.8))
    assert dict(model.constants) == pytest.approx({"C10": 2e4, "C20": 100.0})
    linear = material_from_table({"name": "X", "model": "linear", "constants": {"E_l_MPa": 0.05}})
    assert linear.engineering_stress(1.5) == pytest.approx(0.025e6)
    assert linear.tangent_modulus(1.5) == pytest.approx(0.05e6)
    ogden = {"mu1_MPa": 0.01, "b1": 2.0, "mu2_MPa": 0.0, "b2": -3.0}
    assert dict(material_from_table({"name": "X", "model": "ogden", "constants": ogden}).constants) == pytest.approx(
        {"mu1": 1e4, "b1": 2.0, "mu2": 0.0, "b2": -3.0}
    )


def test_a_table_with_a_law_of_its_own() -> None:
    model = material_from_table(OWN)
    assert model.law.name == "mine"
    assert model.engineering_stress(1.5) == pytest.approx(0.02e6 * (1.5 - 1 / 2.25))
    without = material_from_table({"name": "X", "model": "mine", "formula": "0.02 * (stretch - 1)"})
    assert without.engineering_stress(1.5) == pytest.approx(0.01e6)


def test_a_table_that_names_a_silicone(tmp_path: Path) -> None:
    model = material_from_table({"name": "Ecoflex 00-10", "model": "ogden", "density_kg_m3": 990})
    assert (model.name, model.law, model.density) == ("Ecoflex 00-10", LAWS["ogden"], 990.0)
    (tmp_path / "mine.toml").write_text("[Mine]\ndensity_kg_m3 = 1234\n[Mine.neo-hookean]\nmu0_MPa = 0.04\n")
    table = {"name": "Mine", "model": "neo-hookean", "file": "mine.toml"}
    assert material_from_table(table, folder=tmp_path).density == 1234.0
    error = error_of(lambda: material_from_table({**table, "name": "Mini"}, folder=tmp_path))
    assert (error.table, error.key) == ("material", "name")
    assert "mine.toml; did you mean 'Mine'" in error.message
    error = error_of(lambda: material_from_table({**table, "model": "yeoh"}, folder=tmp_path))
    assert (error.table, error.key) == ("material", "model")
    assert "Mine has no constants of law 'yeoh'" in error.message
    (tmp_path / "mine.toml").write_text("[Mine.neo-hookean]\nmu0_MPa = 'soft'\n")
    error = error_of(lambda: material_from_table(table, folder=tmp_path))
    assert (error.source, error.table, error.key) == (str(tmp_path / "mine.toml"), "Mine.neo-hookean", "mu0_MPa")
    (tmp_path / "mine.toml").write_text("[Mine")
    error = error_of(lambda: material_from_table(table, folder=tmp_path))
    assert (error.source, error.table, error.key) == (str(tmp_path / "mine.toml"), None, None)


@pytest.mark.parametrize(
    ("table", "place", "reason"),
    [
        (3, ("material", None), "expected a table"),
        ({}, ("material", "name"), "missing"),
        ({"name": "Ecoflex 00-50"}, ("material", "model"), "missing"),
        ({"name": "Ecoflex 00-50", "model": 3}, ("material", "model"), "expected text"),
        ({"name": "", "model": "yeoh"}, ("material", "name"), "expected text"),
        ({"name": "Ecoflex 00-5", "model": "yeoh"}, ("material", "name"), "did you mean"),
        ({"name": "Ecoflex 00-50", "modl": "yeoh"}, ("material", "modl"), "did you mean 'model'"),
        ({"name": "Ecoflex 00-50", "model": "yeo"}, ("material", "model"), "did you mean 'yeoh'"),
        ({"name": "E", "model": "yeoh", "file": "none.toml"}, (None, None), "no such file"),
        ({"name": "E", "model": "yeoh", "file": "."}, (None, None), "directory"),
        ({"name": "E", "model": "yeoh", "file": "a\0b"}, (None, None), "not a possible file name"),
        ({"name": "E", "model": "yeoh", "file": 3}, ("material", "file"), "expected text"),
        ({**INLINE, "file": "mine.toml"}, ("material", "file"), "not from both"),
        ({**INLINE, "density": 1000}, ("material", "density"), "did you mean 'density_kg_m3'"),
        ({**INLINE, "density_kg_m3": "1000"}, ("material", "density_kg_m3"), "positive number"),
        ({**INLINE, "density_kg_m3": True}, ("material", "density_kg_m3"), "positive number"),
        ({**INLINE, "fitted_stretch": [2.0, 1.0]}, ("material", "fitted_stretch"), "low and a high"),
        ({**INLINE, "model": "yeo"}, ("material", "model"), "did you mean 'yeoh'? (a law of your own needs a formula)"),
        ({**INLINE, "formula": "stretch"}, ("material", "formula"), "built-in"),
        ({**INLINE, "constants": [1, 2]}, ("material.constants", None), "expected a table"),
        ({**INLINE, "constants": {"C10_MPa": 0.02}}, ("material.constants", "C20_MPa"), "missing"),
        ({**INLINE, "constants": {"C10": 0.02, "C20": 0}}, ("material.constants", "C10"), "did you mean 'C10_MPa'"),
        ({**INLINE, "constants": {"C10_MPa": "0", "C20_MPa": 0}}, ("material.constants", "C10_MPa"), "finite"),
        ({**INLINE, "constants": {"C10_MPa": 1, "C20_MPa": [0]}}, ("material.constants", "C20_MPa"), "finite"),
        ({**INLINE, "constants": {"C10_MPa": 1, "C20_MPa": math.inf}}, ("material.constants", "C20_MPa"), "finite"),
        ({**INLINE, "constants": {"C10_MPa": 1, "a\nb": 0}}, ("material.constants", '"a\\nb"'), "unknown"),
        ({**INLINE, "constants": {"C10_MPa": -1, "C20_MPa": 0}}, ("material.constants", None), "tangent modulus"),
        ({**OWN, "formula": 3}, ("material", "formula"), "must be text"),
        ({**OWN, "formula": "x" * 1_000_000}, ("material", "formula"), "at most"),
        ({**OWN, "formula": "c * __import__('os')"}, ("material", "formula"), "not allowed"),
        ({**OWN, "formula": "c * stretch"}, ("material", "formula"), "it must be 0"),
        ({**OWN, "constants": {}}, ("material", "formula"), "unknown name 'c'"),
        ({**OWN, "constants": {"c": 1, "d": 2}}, ("material", "formula"), "does not use 'd'"),
        ({**OWN, "constants": {"c": "1"}}, ("material.constants", "c"), "finite"),
        ({**OWN, "constants": {"c d": 1}}, ("material.constants", '"c d"'), "cannot name a constant"),
    ],
)
def test_a_table_that_is_wrong_is_one_line_with_its_place(
    table: Any, place: tuple[str | None, str | None], reason: str
) -> None:
    error = error_of(lambda: material_from_table(table))
    assert (error.table, error.key) == place
    assert reason in error.message


def test_a_file_of_ones_own(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    text = """
    ["Soft 1"]
    density_kg_m3 = 1100
    fitted_stretch = [1, 1.8]
    source = "tensile test"
    ["Soft 1".linear]
    E_l_MPa = 0.05
    ["Soft 1".exponential]
    formula = '''
      a * (exp(b * (stretch - 1)) - 1)
      / stretch'''
    constants = { a = 0.05, b = 0.6 }
    derived = "a guess"
    """
    for prefix, newline in ((b"", "\n"), (b"\xef\xbb\xbf", "\r\n")):  # as editors on Windows write it, too
        path.write_bytes(prefix + text.replace("\n", newline).encode())
        entry = load_materials(path)["Soft 1"]
        assert (entry.name, entry.source, dict(entry.derived)) == ("Soft 1", "tensile test", {"exponential": "a guess"})
        own = material("Soft 1", "exponential", file=str(path))
        assert (own.density, own.fitted_stretch) == (1100.0, (1.0, 1.8))
        assert own.engineering_stress(1.5) == pytest.approx(0.05e6 * math.expm1(0.3) / 1.5)
        assert own.tangent_modulus(1.5) == pytest.approx(0.05e6 * 0.6 * math.exp(0.3))


BROKEN_FILES = [
    (b"", None, None, "empty"),
    (b"# nothing\n", None, None, "empty"),
    (b"\xff\xfe\x00binary", None, None, "binary"),
    (bytes(range(1, 128)), None, None, "not valid TOML"),
    ("[Soft]\nname = 'é'".encode("latin-1"), None, None, "expected UTF-8"),
    (b"[Soft\n", None, None, "not valid TOML"),
    (b"[Soft]\n[Soft]\n", None, None, "not valid TOML"),
    (b"a = " + b"[" * 100_000, None, None, "nested at most 16"),
    (b"a = " + b"9" * 100_000, None, None, "not valid TOML"),
    (b"#" * 1_000_001, None, None, "too large"),
    (b"a = 1", None, "a", "expected a table of a silicone"),
    (b'"a\\nb" = 1', None, '"a\\nb"', "expected a table of a silicone"),
    (b"[[Soft]]\n[[Soft.yeoh]]\n", None, "Soft", "expected a table of a silicone"),
    (b"[Soft]\n", "Soft", None, "expected the table of a law"),
    (b"[Soft]\ndensity = 1\n", "Soft", "density", "did you mean 'density_kg_m3'"),
    (b"[Soft]\ndensity_kg_m3 = -1\n[Soft.linear]\nE_l_MPa = 1", "Soft", "density_kg_m3", "positive number"),
    (b"[Soft]\ndensity_kg_m3 = nan\n[Soft.linear]\nE_l_MPa = 1", "Soft", "density_kg_m3", "positive number"),
    (b"[Soft]\ndensity_kg_m3 = {}\n[Soft.linear]\nE_l_MPa = 1", "Soft", "density_kg_m3", "positive number"),
    (b"[Soft]\nsource = 3\n[Soft.linear]\nE_l_MPa = 1", "Soft", "source", "expected text"),
    (b"[Soft]\nfitted_stretch = [1]\n[Soft.linear]\nE_l_MPa = 1", "Soft", "fitted_stretch", "two stretches"),
    (b"[Soft]\nlinear = 0.05\n", "Soft", "linear", "unknown key"),
    (b"[Soft.linear]\n", "Soft.linear", "E_l_MPa", "missing"),
    (b"[Soft.linear]\nE_l = 1", "Soft.linear", "E_l", "did you mean 'E_l_MPa'"),
    (b"[Soft.linear]\nE_l_MPa = true", "Soft.linear", "E_l_MPa", "finite number"),
    (b"[Soft.linear]\nE_l_MPa = inf", "Soft.linear", "E_l_MPa", "finite number"),
    (b"[Soft.linear]\nE_l_MPa = 0x" + b"f" * 9000, "Soft.linear", "E_l_MPa", "finite number"),
    (b"[Soft.linear]\nE_l_MPa = -1", "Soft.linear", None, "tangent modulus"),
    (b"[Soft.linear]\nE_l_MPa = 1\nderived = 3", "Soft.linear", "derived", "expected text"),
    (b"[Soft.linear]\nE_l_MPa = 1\nformula = 'stretch - 1'", "Soft.linear", "formula", "unknown constant"),
    (b'["So ft".yeo]\nC10_MPa = 1', '"So ft".yeo', None, "did you mean 'yeoh'"),
    (b"[S.mine]\nformula = 'c*(stretch-1)'", "S.mine", "formula", "unknown name 'c'"),
    (b"[S.mine]\nformula = 'stretch-1'\nc = 1", "S.mine", "c", "unknown key"),
    (b"[S.mine]\nformula = 'c*(stretch-1)'\nconstants = 1", "S.mine.constants", None, "expected a table"),
    (b"[S.mine]\nformula = 'c*(stretch-1)'\nconstants = {c = nan}", "S.mine.constants", "c", "finite number"),
    (b"[S.mine]\nformula = 'c*stretch'\nconstants = {c = 1}", "S.mine", "formula", "law 'mine' of 'S'"),
    (b"[S.mine]\nformula = 'stretch.__class__'", "S.mine", "formula", "not allowed"),
    (b"[S.mine]\nformula = '" + b"stretch+" * 100_000 + b"1'", "S.mine", "formula", "at most"),
]


@pytest.mark.parametrize(("content", "table", "key", "reason"), BROKEN_FILES, ids=range(len(BROKEN_FILES)))
def test_a_broken_file_is_one_line_with_its_place(
    tmp_path: Path, content: bytes, table: str | None, key: str | None, reason: str
) -> None:
    path = tmp_path / "mine.toml"
    path.write_bytes(content)
    error = error_of(lambda: load_materials(path))
    assert (error.source, error.table, error.key) == (str(path), table, key)
    assert reason in error.message


def test_a_file_that_cannot_be_opened(tmp_path: Path) -> None:
    assert "no such file" in error_of(lambda: load_materials(tmp_path / "none.toml")).message
    assert "directory" in error_of(lambda: load_materials(tmp_path)).message
    assert "device" in error_of(lambda: load_materials("/dev/zero")).message
    assert "too long" in error_of(lambda: load_materials("a" * 300)).message
    assert "path of a TOML file" in error_of(lambda: load_materials(3)).message  # type: ignore[arg-type]
    assert error_of(lambda: load_materials(tmp_path)).source == str(tmp_path)
