"""How a step can end, in words that say what to do next."""

from __future__ import annotations

from enum import StrEnum


class Status(StrEnum):
    """The named outcome of one step. `solved` and `no_contact` carry numbers; every other carries none."""

    SOLVED = "solved"
    NO_CONTACT = "no_contact"
    NO_EQUILIBRIUM = "no_equilibrium"
    UNSTABLE_MATERIAL = "unstable_material"
    DIVERGED = "diverged"
    INACCURATE = "inaccurate"
    FOLD = "fold"
    OUT_OF_REACH = "out_of_reach"
    NOT_OPTIMAL = "not_optimal"
    DISPUTED = "disputed"

    @property
    def has_solution(self) -> bool:
        """Whether a step that ended so carries a solution."""
        return self in (Status.SOLVED, Status.NO_CONTACT)

    @property
    def advice(self) -> str:
        """One sentence: what it means and what to do next."""
        return _ADVICE[self]


_ADVICE = {
    Status.SOLVED: "every equation holds within the tolerance",
    Status.NO_CONTACT: "the free shape does not reach the wall, so the force is 0",
    Status.NO_EQUILIBRIUM: "the stretch balance has no root on the branch from zero pressure; lower the pressure",
    Status.UNSTABLE_MATERIAL: (
        "a stiffness would lose its sign; lower the pressure, or choose a law fitted further or smaller chambers"
    ),
    Status.DIVERGED: (
        "neither a direct solve nor continuation in pressure and load reached it; take smaller steps or lower the load"
    ),
    Status.INACCURATE: (
        "solved on the finest grid allowed, but its discretisation error is above the accuracy asked for; "
        "loosen [solver] accuracy or set intervals"
    ),
    Status.FOLD: "the branch followed from zero pressure turns back before this step",
    Status.OUT_OF_REACH: "no pressure within the bounds reaches the target",
    Status.DISPUTED: (
        "IPOPT, started at the solution of Newton's method, does not confirm it; set [solver] intervals or accuracy, "
        'or look at both with the engines "ipopt" and "newton"'
    ),
    Status.NOT_OPTIMAL: (
        "every equation holds, but the point is not shown to be a minimum; start nearer, free less, or allow more steps"
    ),
}
