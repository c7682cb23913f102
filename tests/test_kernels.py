"""Machine code made from CasADi functions, the same interpreted, and the predictor."""

from __future__ import annotations

import sys

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softnlp.batch.grids import grid_level, whole_groups
from softnlp.batch.predictor import predicted
from softnlp.native.interpreted import Interpreted
from softnlp.native.ir import llvm_text
from softnlp.native.ir_functions import LIBRARY
from softnlp.native.jit import can_compile, compiled
from softnlp.native.kernels import WIDTH, Kernels, Step
from softnlp.native.shooting import Compiled, shooting

needs_compiler = pytest.mark.skipif(not can_compile(), reason="no llvmlite")


def every_operation() -> ca.Function:
    """Return a map of (a, b) in 0.1..0.9 that uses each operation that has a translation."""
    x = ca.SX.sym("x", 2)
    a, b = x[0], x[1]
    unary = ["exp", "expm1", "log", "log1p", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"]
    rows = [getattr(ca, name)(a) for name in (*unary, "asinh", "atanh", "erf", "sqrt", "fabs")]
    rows += [ca.acosh(1 + a), a + b, a - b, a * b, a / b, -a, a**2, 2 * a, 1 / b, a**b, a**2.7, ca.fmin(a, b)]
    rows += [ca.fmax(a, b), ca.if_else(a < b, a, 3.0), ca.if_else(ca.logic_not(a < b), b, -1.0)]
    return ca.Function("every", [x], [ca.vertcat(*rows)])


def decay() -> Step:
    """Return a step of y' = -k y + s."""
    y, k, s = (ca.SX.sym(name) for name in "yks")
    return Step(ca.Function("decay", [y, k, s], [-k * y + s]))


def counted() -> Step:
    """Return the same step of a state that counts its steps, sums their lengths and has y first."""
    y, k, s, h, n, far = (ca.SX.sym(name) for name in ("y", "k", "s", "h", "n", "far"))
    before, x = ca.vertcat(y, n, far), ca.SX.sym("x", 2)
    return Step(
        rates=ca.Function("rates", [x, k, s], [ca.vertcat(-k * x[0] + s, 1.0)]),
        begin=ca.Function("begin", [before, k, s], [ca.vertcat(y, 0.0)]),
        end=ca.Function("end", [before, x, k, s, h], [ca.vertcat(x[0], n + 1, ca.fmax(far, s + x[1]))]),
    )


@needs_compiler
def test_every_operation_is_casadis_to_the_last_bit() -> None:
    every = every_operation()
    kernels = Kernels({}, {"every": every})
    made = shooting(kernels)
    assert isinstance(made, Compiled)
    x = np.random.default_rng(0).uniform(0.1, 0.9, (2, 11))
    expected = np.hstack([np.asarray(every(x[:, k])) for k in range(11)])
    assert np.array_equal(made.apply("every", x), expected)
    assert np.array_equal(Interpreted(kernels).apply("every", x), expected)


@pytest.mark.parametrize("interpreted", [True, pytest.param(False, marks=needs_compiler)])
def test_shooting_integrates_every_pose_on_its_own_grid(interpreted: bool) -> None:
    """Y' = -k y + s has a closed form; groups with more intervals are nearer to it by the method's order."""
    kernels = Kernels({"decay": decay()}, {})
    made = Interpreted(kernels) if interpreted else shooting(kernels)
    k = np.linspace(0.5, 2.0, 3 * WIDTH)[None, :]
    exact = np.exp(-k) * (1 + 1 / k**2) + 1 / k - 1 / k**2
    errors = []
    for factor in (1, 2):
        counts = factor * np.array([7, 20, 4])
        errors.append(np.abs(made.run("decay", counts, k, np.ones_like(k)) - exact))
    groups = (errors[0] / errors[1]).reshape(3, WIDTH)
    assert groups == pytest.approx(np.full((3, WIDTH), 16.0), rel=0.35)


@pytest.mark.parametrize("interpreted", [True, pytest.param(False, marks=needs_compiler)])
def test_a_step_may_keep_more_than_it_integrates(interpreted: bool) -> None:
    kernels = Kernels({"decay": decay(), "counted": counted()}, {})
    made = Interpreted(kernels) if interpreted else shooting(kernels)
    k, counts = np.linspace(0.5, 2.0, 2 * WIDTH)[None, :], np.array([5, 9])
    state = np.vstack([np.ones_like(k), np.zeros((2, k.size))])
    found = made.run("counted", counts, k, state)
    assert np.array_equal(found[0], made.run("decay", counts, k, np.ones_like(k))[0])
    assert np.array_equal(found[1], np.repeat(counts, WIDTH))
    assert found[2] == pytest.approx(1.0, abs=1e-15)


@needs_compiler
def test_a_step_is_the_same_compiled_to_the_last_bit() -> None:
    kernels = Kernels({"counted": counted()}, {})
    rng = np.random.default_rng(1)
    k, state, counts = rng.uniform(0.5, 2, (1, 5 * WIDTH)), rng.uniform(0, 1, (3, 5 * WIDTH)), np.array([3, 1, 8, 5, 5])
    made = shooting(kernels)
    assert isinstance(made, Compiled)
    assert np.array_equal(made.run("counted", counts, k, state), Interpreted(kernels).run("counted", counts, k, state))


def test_an_operation_without_translation_leaves_casadi_to_do_it() -> None:
    x = ca.SX.sym("x")
    kernels = Kernels({}, {"ceil": ca.Function("ceil", [x], [ca.ceil(x)])})
    assert llvm_text(kernels) is None
    assert shooting(kernels).apply("ceil", np.array([[1.5, 2.5]])).tolist() == [[2.0, 3.0]]


@needs_compiler
def test_the_same_kernels_are_compiled_once() -> None:
    text = [llvm_text(Kernels({"decay": decay()}, {})) for _ in range(2)]
    assert text[0] == text[1]
    assert text[0] is not None
    assert compiled(text[0], LIBRARY) is compiled(text[0], LIBRARY)


@pytest.mark.parametrize("reason", ["switched off", "no llvmlite"])
def test_without_machine_code_numpy_does_it(reason: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if reason == "switched off":
        monkeypatch.setenv("SOFTNLP_COMPILE", "0")
    else:
        monkeypatch.setitem(sys.modules, "llvmlite.binding", None)
    assert not can_compile()
    assert isinstance(shooting(Kernels({"decay": decay()}, {})), Interpreted)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 3), st.integers(0, 2**31))
def test_a_quadratic_is_predicted_exactly(columns: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x = rng.uniform(-1, 1, (80, columns))
    Q = rng.normal(size=(columns, columns))
    values = np.vstack([1 + x.sum(axis=1), np.einsum("ki,ij,kj->k", x, Q, x)])
    known = np.arange(0, 80, 2)
    assert predicted(x, known, values[:, known]) == pytest.approx(values, abs=1e-9)


def test_without_known_poses_the_prediction_is_nothing() -> None:
    assert not predicted(np.ones((4, 2)), np.zeros(0, int), np.zeros((3, 0))).any()


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0, 300), min_size=1, max_size=40))
def test_groups_hold_every_pose_on_a_grid_that_is_fine_enough(wanted: list[float]) -> None:
    grids = grid_level(np.array(wanted))
    assert (grids >= np.array(wanted)).all()
    slots, counts = whole_groups(grids)
    assert slots.size == WIDTH * counts.size
    assert set(slots) == set(range(len(wanted)))
    assert (grids[slots] == np.repeat(counts, WIDTH)).all()
