"""Which of IPOPT's options a scenario may set, and what they take; nothing that names a file or a library."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any

from softnlp.base.errors import InputError
from softnlp.base.reading import did_you_mean, shown


@dataclass(frozen=True)
class Option:
    """One option: a number of a range, a whole one where `whole`, or one of some words; and what it does."""

    meaning: str
    words: tuple[str, ...] = ()
    least: float = 0.0
    most: float = inf
    whole: bool = False

    @property
    def expected(self) -> str:
        """What it takes, in words."""
        if self.words:
            return " or ".join(f'"{word}"' for word in self.words)
        kind = "a whole number" if self.whole else "a number"
        return f"{kind} from {self.least:g}" + (f" to {self.most:g}" if isfinite(self.most) else "")

    def takes(self, value: Any) -> bool:
        """Whether it takes a value."""
        if self.words:
            return isinstance(value, str) and value in self.words
        if isinstance(value, bool) or not isinstance(value, int if self.whole else int | float):
            return False
        return self.least <= value <= self.most and isfinite(value)

    def refusal(self, value: Any) -> str:
        """Say what it takes in place of a value."""
        return f"expected {self.expected}, got {shown(value)}"


_YES_NO = ("yes", "no")
IPOPT_OPTIONS: Mapping[str, Option] = {
    "tol": Option("largest error of the conditions at a solution", least=1e-14, most=1.0),
    "constr_viol_tol": Option("largest violation of a row at a solution", least=1e-14, most=1.0),
    "dual_inf_tol": Option("largest dual infeasibility at a solution", least=1e-14, most=1e3),
    "compl_inf_tol": Option("largest complementarity at a solution", least=1e-14, most=1e3),
    "acceptable_tol": Option("error that is acceptable after some iterations", least=1e-14, most=1.0),
    "acceptable_iter": Option("acceptable iterations in a row that end a solve; 0 never", most=1000, whole=True),
    "max_iter": Option("most iterations", most=100_000, whole=True),
    "max_cpu_time": Option("most processor time [s]", least=1e-3, most=86_400),
    "max_wall_time": Option("most time [s]", least=1e-3, most=86_400),
    "mu_strategy": Option("how the barrier parameter falls", words=("monotone", "adaptive")),
    "mu_init": Option("first barrier parameter", least=1e-14, most=1e3),
    "mu_target": Option("barrier parameter at the solution", most=1.0),
    "barrier_tol_factor": Option("error of a barrier problem, over its parameter", least=1e-3, most=1e3),
    "mu_linear_decrease_factor": Option("linear decrease of the barrier parameter", least=1e-3, most=0.999),
    "mu_superlinear_decrease_power": Option("superlinear decrease of the barrier parameter", least=1.001, most=1.999),
    "nlp_scaling_method": Option("how the problem is scaled", words=("none", "gradient-based")),
    "nlp_scaling_max_gradient": Option("largest gradient after scaling", least=1e-6, most=1e6),
    "obj_scaling_factor": Option("factor on the objective", least=1e-12, most=1e12),
    "bound_push": Option("least distance of a start from a bound", least=1e-16, most=1.0),
    "bound_frac": Option("least relative distance of a start from a bound", least=1e-16, most=0.5),
    "bound_relax_factor": Option("relaxation of the bounds", most=1e-3),
    "honor_original_bounds": Option("whether a solution lies within the bounds", words=_YES_NO),
    "warm_start_init_point": Option("whether a start is taken as it is", words=_YES_NO),
    "warm_start_bound_push": Option("as bound_push, of a warm start", least=1e-16, most=1.0),
    "warm_start_bound_frac": Option("as bound_frac, of a warm start", least=1e-16, most=0.5),
    "warm_start_mult_bound_push": Option("least multiplier of a warm start", least=1e-16, most=1.0),
    "linear_solver": Option("what solves the linear systems", words=("mumps",)),
    "print_level": Option("how much of the log is printed", most=12, whole=True),
}
_FILES = ("file", "lib", "dir", "path")


def checked_options(given: Mapping[str, Any]) -> tuple[tuple[str, Any], ...]:
    """Return options by name, in order, if each is known and takes its value.

    Raises
    ------
    InputError
        On one line, with the option as its key.
    """
    for name, value in given.items():
        if name not in IPOPT_OPTIONS:
            why = "a scenario names no file or library" if any(part in name.lower() for part in _FILES) else "not known"
            near = did_you_mean(name, IPOPT_OPTIONS)
            raise InputError(f"this option of IPOPT cannot be set here: {why}{near}", key=name)
        if not IPOPT_OPTIONS[name].takes(value):
            raise InputError(IPOPT_OPTIONS[name].refusal(value), key=name)
    return tuple(sorted(given.items()))
