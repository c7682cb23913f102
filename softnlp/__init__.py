"""Statics of pneumatic soft manipulators with thread-reinforced chambers, as multiple-shooting nonlinear programs.

The names below are the Python interface; they are imported where first used, so that `import softnlp` costs nothing.
Numbers are SI: `BAR`, `MILLIMETRE`, `NEWTON_MILLIMETRE`, `DEGREE` convert.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softnlp.contact_settings import Closure as Closure
    from softnlp.contact_settings import ClosureWeights as ClosureWeights
    from softnlp.contact_settings import ContactSettings as ContactSettings
    from softnlp.conventions import AS_PRINTED as AS_PRINTED
    from softnlp.conventions import COEFFICIENT_SETS as COEFFICIENT_SETS
    from softnlp.conventions import REPRODUCTION as REPRODUCTION
    from softnlp.conventions import Coefficients as Coefficients
    from softnlp.conventions import Conventions as Conventions
    from softnlp.errors import IllPosedError as IllPosedError
    from softnlp.errors import InputError as InputError
    from softnlp.errors import MaterialError as MaterialError
    from softnlp.errors import RobotError as RobotError
    from softnlp.errors import SoftnlpError as SoftnlpError
    from softnlp.evaluation.compare import compare as compare
    from softnlp.evaluation.variants import Variant as Variant
    from softnlp.laws import formula_law as formula_law
    from softnlp.laws import function_law as function_law
    from softnlp.materials import Material as Material
    from softnlp.materials import load_materials as load_materials
    from softnlp.materials import material as material
    from softnlp.numerics import Numerics as Numerics
    from softnlp.results import save as save
    from softnlp.results import to_dataset as to_dataset
    from softnlp.results import to_json as to_json
    from softnlp.robot import ROBOTS as ROBOTS
    from softnlp.robot import Robot as Robot
    from softnlp.robot import robot as robot
    from softnlp.rod import Loads as Loads
    from softnlp.runner import run_scenario as run_scenario
    from softnlp.runner_design import run_design as run_design
    from softnlp.runner_workspace import run_sweep as run_sweep
    from softnlp.scenario import load_scenario as load_scenario
    from softnlp.status import Status as Status
    from softnlp.studies.blocked_force import blocked_force as blocked_force
    from softnlp.studies.blocked_force import constrained_pose as constrained_pose
    from softnlp.studies.blocked_force import force_against_offset as force_against_offset
    from softnlp.studies.design import Design as Design
    from softnlp.studies.design import design as design
    from softnlp.studies.design_task import DesignTask as DesignTask
    from softnlp.studies.design_task import PressureSteps as PressureSteps
    from softnlp.studies.design_task import Range as Range
    from softnlp.studies.design_task import at_least as at_least
    from softnlp.studies.design_task import at_most as at_most
    from softnlp.studies.ellipsoids import compliance_ellipsoid as compliance_ellipsoid
    from softnlp.studies.ellipsoids import manipulability as manipulability
    from softnlp.studies.ellipsoids import stiffness_ellipsoid as stiffness_ellipsoid
    from softnlp.studies.force_inversion import pressure_for_force as pressure_for_force
    from softnlp.studies.forward import forward as forward
    from softnlp.studies.identify import identify as identify
    from softnlp.studies.inverse import inverse as inverse
    from softnlp.studies.measurements import Measurements as Measurements
    from softnlp.studies.report import sensitivity_report as sensitivity_report
    from softnlp.studies.sensitivity import sensitivities as sensitivities
    from softnlp.studies.sensitivity import tip_compliance as tip_compliance
    from softnlp.studies.sensitivity import tip_jacobian as tip_jacobian
    from softnlp.studies.step import Run as Run
    from softnlp.studies.step import Step as Step
    from softnlp.studies.tensile import fit_tensile as fit_tensile
    from softnlp.studies.tolerances import error_bars as error_bars
    from softnlp.studies.tolerances import monte_carlo as monte_carlo
    from softnlp.studies.weight_sensitivity import weight_sensitivity as weight_sensitivity
    from softnlp.units import BAR as BAR
    from softnlp.units import DEGREE as DEGREE
    from softnlp.units import MILLIMETRE as MILLIMETRE
    from softnlp.units import NEWTON_MILLIMETRE as NEWTON_MILLIMETRE

_HOMES = {
    "contact_settings": ("Closure", "ClosureWeights", "ContactSettings"),
    "conventions": ("AS_PRINTED", "COEFFICIENT_SETS", "REPRODUCTION", "Coefficients", "Conventions"),
    "errors": ("IllPosedError", "InputError", "MaterialError", "RobotError", "SoftnlpError"),
    "evaluation.compare": ("compare",),
    "evaluation.variants": ("Variant",),
    "laws": ("formula_law", "function_law"),
    "materials": ("Material", "load_materials", "material"),
    "numerics": ("Numerics",),
    "results": ("save", "to_dataset", "to_json"),
    "robot": ("ROBOTS", "Robot", "robot"),
    "rod": ("Loads",),
    "runner": ("run_scenario",),
    "runner_design": ("run_design",),
    "scenario": ("load_scenario",),
    "status": ("Status",),
    "studies.blocked_force": ("blocked_force", "constrained_pose", "force_against_offset"),
    "studies.design": ("Design", "design"),
    "studies.design_task": ("DesignTask", "PressureSteps", "Range", "at_least", "at_most"),
    "studies.ellipsoids": ("compliance_ellipsoid", "manipulability", "stiffness_ellipsoid"),
    "studies.force_inversion": ("pressure_for_force",),
    "studies.forward": ("forward",),
    "studies.identify": ("identify",),
    "studies.inverse": ("inverse",),
    "studies.measurements": ("Measurements",),
    "studies.report": ("sensitivity_report",),
    "studies.sensitivity": ("sensitivities", "tip_compliance", "tip_jacobian"),
    "studies.step": ("Run", "Step"),
    "studies.tensile": ("fit_tensile",),
    "studies.tolerances": ("error_bars", "monte_carlo"),
    "studies.weight_sensitivity": ("weight_sensitivity",),
    "units": ("BAR", "DEGREE", "MILLIMETRE", "NEWTON_MILLIMETRE"),
    "runner_workspace": ("run_sweep",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = sorted([*_HOME_OF, "__version__"])


class _Package(ModuleType):
    """The package: `robot` stays the function when the submodule of that name is imported, in whatever order."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in _HOME_OF or not isinstance(value, ModuleType):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("softnlp")
    if name not in _HOME_OF:
        raise AttributeError(f"module 'softnlp' has no attribute '{name}'")
    value = getattr(import_module(f"softnlp.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return list(__all__)
