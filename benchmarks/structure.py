"""How the package is built, counted from its sources and from three calls.

    python -m benchmarks.structure

Prints a table: files, lines, how deep imports go, who solves and who iterates, and how many of the package's own frames
lie between a call of the interface and the first linear system that it solves.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

import softnlp
from softnlp.cli.console import say
from softnlp.native.jit import Machine

PACKAGE = Path(softnlp.__file__).parent
_MAY_ITERATE = ("nlp", "batch")


@cache
def trees() -> dict[str, ast.Module]:
    """Return the parsed modules by name, "statics.solver"; a package has the name of its folder."""
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        parts = file.relative_to(PACKAGE).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name or "softnlp"] = ast.parse(file.read_text())
    return found


def lines() -> int:
    """Return the lines of all modules."""
    return sum(len(file.read_text().splitlines()) for file in PACKAGE.rglob("*.py"))


@cache
def imports() -> dict[str, frozenset[str]]:
    """Return the modules of this package that each of them imports when it is loaded."""
    names = trees().keys()
    found = {}
    for name, tree in trees().items():
        others = set()
        for node in tree.body:
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("softnlp."):
                module = str(node.module).removeprefix("softnlp.")
                within = {f"{module}.{alias.name}" for alias in node.names} & names
                others |= within or ({module} & names)
        found[name] = frozenset(others - {name})
    return found


def floors(package: str = "") -> int:
    """Return the longest chain of modules that import one another, of one package or of all."""

    @cache
    def height(module: str) -> int:
        below = [m for m in imports()[module] if m.startswith(f"{package}." if package else "")]
        return 1 + max((height(m) for m in below), default=0)

    return max(height(m) for m in imports() if m.startswith(f"{package}." if package else ""))


def functions(tree: ast.AST) -> Iterator[ast.FunctionDef]:
    """Yield every function of a module."""
    yield from (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))


def solvers() -> list[str]:
    """Return the classes with a method `solve`."""
    return [
        f"{name}.{node.name}"
        for name, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
        and any(isinstance(item, ast.FunctionDef) and item.name == "solve" for item in node.body)
    ]


def iterating() -> list[str]:
    """Return the modules, outside those whose task it is, with a loop that ends on what it has computed.

    Such a loop takes a limited number of steps or goes on for ever, has a `break` or `return` under a condition, and
    computes the name that it begins with anew: Newton's method, secants, bisection, trust regions.
    """
    found = []
    for name, tree in trees().items():
        if name.split(".")[0] in (*_MAY_ITERATE, "base", "app", "cli"):
            continue
        if any(_searches(node) for node in ast.walk(tree) if isinstance(node, ast.For | ast.While)):
            found.append(name)
    return found


def _searches(loop: ast.For | ast.While) -> bool:
    over = getattr(loop, "iter", None)
    counted = isinstance(over, ast.Call) and isinstance(over.func, ast.Name) and over.func.id == "range"
    if isinstance(loop, ast.For) and not counted:
        return False
    inside = [node for statement in loop.body for node in ast.walk(statement)]
    ends = isinstance(loop, ast.While) or any(isinstance(node, ast.Break | ast.Return) for node in inside)
    made = {t.id for n in inside if isinstance(n, ast.Assign | ast.AugAssign) for t in _targets(n)}
    used = {node.id for node in inside if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    return ends and bool(made & used) and any(isinstance(node, ast.Call) for node in inside)


def _targets(node: ast.Assign | ast.AugAssign) -> list[ast.Name]:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return [n for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)]


def frames(call: Callable[[], Any]) -> int:
    """Return how many frames of this package are open when a call first solves a linear system."""
    deepest: list[int] = []
    real = np.linalg.solve

    real_call = Machine.call

    def note(frame: FrameType | None) -> None:
        if not deepest:
            count = 0
            while frame is not None:
                count += str(PACKAGE) in frame.f_code.co_filename
                frame = frame.f_back
            deepest.append(count)

    def noted(*given: Any) -> Any:
        note(sys._getframe(1))
        return real(*given)

    def called(machine: Machine, name: str, *given: Any) -> None:
        if name.startswith("solve_"):  # Newton's method in machine code
            note(sys._getframe(1))
        real_call(machine, name, *given)

    np.linalg.solve = noted
    Machine.call = called  # type: ignore[method-assign,assignment]
    try:
        call()
    finally:
        np.linalg.solve = real
        Machine.call = real_call  # type: ignore[method-assign]
    return deepest[0] if deepest else 0


def calls() -> dict[str, Callable[[], Any]]:
    """Return one call of each study that is counted: forward with a load, blocked force, inverse kinematics."""
    body, silicone = softnlp.robot("D25L60"), softnlp.material("Ecoflex 00-50")
    P, load = np.array([0.3, 0.0, 0.0]) * softnlp.BAR, softnlp.Loads(tip_force=(0.0, 0.0, -0.02))
    by_newton = softnlp.Numerics(engine="newton")
    return {
        "forward": lambda: softnlp.forward(body, silicone, P, loads=load, numerics=by_newton),
        "blocked": lambda: softnlp.blocked_force(body, silicone, P, numerics=by_newton),
        "inverse": lambda: softnlp.inverse(
            body, silicone, positions=[(-0.01, 0.0, 0.061)], loads=load, numerics=by_newton
        ),
    }


def main() -> None:
    """Print the table."""
    root = sum(1 for name in trees() if "." not in name and not (PACKAGE / name).is_dir())
    say(f"files at the package's root            {root}")
    say(f"package lines                          {lines()}")
    say(f"floors of imports / inside studies     {floors()} / {floors('studies')}")
    say(f"frames to linear algebra               {', '.join(f'{k} {frames(c)}' for k, c in calls().items())}")
    say(f"classes with .solve                    {len(solvers())}: {', '.join(solvers())}")
    say(f"loops that search, not in nlp or batch {len(iterating())}: {', '.join(iterating())}")


if __name__ == "__main__":
    main()
