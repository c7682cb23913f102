"""C made from CasADi functions, the compiler's cache, and the predictor."""

from __future__ import annotations

import os
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softnlp.batch.compiled import cache_folder, compiler, library
from softnlp.batch.csource import WIDTH, Kernels, c_source
from softnlp.batch.grids import grid_level, whole_groups
from softnlp.batch.interpreted import Interpreted
from softnlp.batch.predictor import predicted
from softnlp.batch.shooting import Compiled, shooting

needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def every_operation() -> ca.Function:
    """Return a map of (a, b) in 0.1..0.9 that uses each operation that has a translation."""
    x = ca.SX.sym("x", 2)
    a, b = x[0], x[1]
    unary = ["exp", "expm1", "log", "log1p", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"]
    rows = [getattr(ca, name)(a) for name in (*unary, "asinh", "atanh", "erf", "sqrt", "fabs")]
    rows += [ca.acosh(1 + a), a + b, a - b, a * b, a / b, -a, a**2, 2 * a, 1 / b, a**b, a**2.7, ca.fmin(a, b)]
    rows += [ca.fmax(a, b), ca.if_else(a < b, a, 3.0), ca.if_else(ca.logic_not(a < b), b, -1.0)]
    return ca.Function("every", [x], [ca.vertcat(*rows)])


def decay() -> ca.Function:
    """Return a Runge-Kutta step of y' = -k y + s."""
    y, k, s, h = (ca.SX.sym(name) for name in "yksh")

    def rate(y: ca.SX, s: ca.SX) -> ca.SX:
        return -k * y + s

    k1 = rate(y, s)
    k2 = rate(y + h / 2 * k1, s + h / 2)
    k3 = rate(y + h / 2 * k2, s + h / 2)
    k4 = rate(y + h * k3, s + h)
    return ca.Function("decay", [y, k, s, h], [y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])


@needs_compiler
def test_every_operation_is_casadis_to_the_last_bit() -> None:
    every = every_operation()
    kernels = Kernels({}, {"every": every})
    made = shooting(kernels, build=True)
    assert isinstance(made, Compiled)
    x = np.random.default_rng(0).uniform(0.1, 0.9, (2, 11))
    expected = np.hstack([np.asarray(every(x[:, k])) for k in range(11)])
    assert np.array_equal(made.apply("every", x), expected)
    assert np.array_equal(Interpreted(kernels).apply("every", x), expected)


@pytest.mark.parametrize("interpreted", [True, pytest.param(False, marks=needs_compiler)])
def test_shooting_integrates_every_pose_on_its_own_grid(interpreted: bool) -> None:
    """Y' = -k y + s has a closed form; groups with more intervals are nearer to it by the method's order."""
    kernels = Kernels({"decay": decay()}, {})
    made = Interpreted(kernels) if interpreted else shooting(kernels, build=True)
    k = np.linspace(0.5, 2.0, 3 * WIDTH)[None, :]
    exact = np.exp(-k) * (1 + 1 / k**2) + 1 / k - 1 / k**2
    errors = []
    for factor in (1, 2):
        counts = factor * np.array([7, 20, 4])
        errors.append(np.abs(made.run("decay", counts, k, np.ones_like(k)) - exact))
    groups = (errors[0] / errors[1]).reshape(3, WIDTH)
    assert groups == pytest.approx(np.full((3, WIDTH), 16.0), rel=0.35)


def test_an_operation_without_translation_leaves_casadi_to_do_it() -> None:
    x = ca.SX.sym("x")
    kernels = Kernels({}, {"floor": ca.Function("floor", [x], [ca.floor(x)])})
    assert c_source(kernels) is None
    assert shooting(kernels, build=True).apply("floor", np.array([[1.5, 2.5]])).tolist() == [[1.0, 2.0]]


@needs_compiler
def test_what_was_compiled_is_found_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    source = c_source(Kernels({"decay": decay()}, {}))
    assert source is not None
    assert library(source, build=False) is None
    assert library(source) is not None
    assert len(list(tmp_path.rglob("*.so"))) == 1
    monkeypatch.setattr("softnlp.batch.compiled._build", lambda *_: pytest.fail("compiled again"))
    assert library(source, build=False) is not None


@pytest.mark.parametrize("command", ["no-such-compiler", "false"])
def test_without_a_working_compiler_there_is_no_library(monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    monkeypatch.setenv("CC", command)
    assert library("int x;") is None
    made = shooting(Kernels({"decay": decay()}, {}), build=True)
    assert isinstance(made, Interpreted)


@needs_compiler
def test_a_library_that_does_not_load_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    source = c_source(Kernels({"decay": decay()}, {}))
    assert source is not None
    with monkeypatch.context() as cut_short:
        cut_short.setattr("softnlp.batch.compiled._build", lambda _, __, path: path.write_bytes(b"half") > 0)
        assert library(source) is None
    assert library(source, build=False) is None
    assert library(source) is not None


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="no file modes")
def test_a_cache_that_others_may_write_to_is_not_used(tmp_path: Path) -> None:
    folder = cache_folder()
    assert folder is not None
    folder.chmod(0o777)
    assert cache_folder() is None


@pytest.mark.parametrize("reason", ["no folder", "switched off"])
def test_without_a_cache_or_leave_to_compile_casadi_does_it(
    reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if reason == "no folder":
        (tmp_path / "file").write_text("in the way")
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
        assert cache_folder() is None
    else:
        monkeypatch.setenv("SOFTNLP_COMPILE", "0")
        assert compiler() is None
    monkeypatch.setattr("softnlp.batch.compiled._build", lambda *_: pytest.fail("compiled"))
    assert library("int x;") is None
    assert isinstance(shooting(Kernels({"decay": decay()}, {}), build=True), Interpreted)


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
