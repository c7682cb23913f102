"""Shapes, bending angle and elongation of the README's scenario."""

from softnlp import load_scenario, run_scenario
from softnlp.plots import run_figure
from softnlp.results import view_of_run


def figure():
    """Draw the run."""
    return run_figure(view_of_run(run_scenario(load_scenario("scenarios/D25L60_one_set.toml"))))
