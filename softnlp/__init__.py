"""Statics of pneumatic soft manipulators with thread-reinforced chambers, as multiple-shooting nonlinear programs.

The names below are the Python interface; they are imported where first used, so that `import softnlp` costs nothing.
Numbers are SI: `BAR`, `MILLIMETRE`, `NEWTON_MILLIMETRE`, `DEGREE` convert.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from softnlp.base.old_paths import install as install_old_paths

if TYPE_CHECKING:
    from softnlp.base.errors import IllPosedError as IllPosedError
    from softnlp.base.errors import InputError as InputError
    from softnlp.base.errors import MaterialError as MaterialError
    from softnlp.base.errors import RobotError as RobotError
    from softnlp.base.errors import SoftnlpError as SoftnlpError
    from softnlp.base.quantity import Quantity as Quantity
    from softnlp.base.quantity import quantity as quantity
    from softnlp.base.status import Status as Status
    from softnlp.base.units import BAR as BAR
    from softnlp.base.units import DEGREE as DEGREE
    from softnlp.base.units import MILLIMETRE as MILLIMETRE
    from softnlp.base.units import NEWTON_MILLIMETRE as NEWTON_MILLIMETRE
    from softnlp.dynamics.simulation import Dynamics as Dynamics
    from softnlp.model.body import Body as Body
    from softnlp.model.body import Segment as Segment
    from softnlp.model.contact_settings import Closure as Closure
    from softnlp.model.contact_settings import ClosureWeights as ClosureWeights
    from softnlp.model.contact_settings import ContactSettings as ContactSettings
    from softnlp.model.conventions import AS_PRINTED as AS_PRINTED
    from softnlp.model.conventions import COEFFICIENT_SETS as COEFFICIENT_SETS
    from softnlp.model.conventions import REPRODUCTION as REPRODUCTION
    from softnlp.model.conventions import Coefficients as Coefficients
    from softnlp.model.conventions import Conventions as Conventions
    from softnlp.model.laws import formula_law as formula_law
    from softnlp.model.laws import function_law as function_law
    from softnlp.model.load import Load as Load
    from softnlp.model.materials import Material as Material
    from softnlp.model.materials import load_materials as load_materials
    from softnlp.model.materials import material as material
    from softnlp.model.numerics import Numerics as Numerics
    from softnlp.model.obstacles import Capsule as Capsule
    from softnlp.model.obstacles import Cylinder as Cylinder
    from softnlp.model.obstacles import Plane as Plane
    from softnlp.model.obstacles import Sphere as Sphere
    from softnlp.model.obstacles import Trocar as Trocar
    from softnlp.model.obstacles import Tube as Tube
    from softnlp.model.robot import ROBOTS as ROBOTS
    from softnlp.model.robot import Robot as Robot
    from softnlp.model.robot import robot as robot
    from softnlp.model.rod import Loads as Loads
    from softnlp.model.section import Section as Section
    from softnlp.model.section import SectionRadii as SectionRadii
    from softnlp.model.section import SectionState as SectionState
    from softnlp.model.segments import segmented_robot as segmented_robot
    from softnlp.nlp.constraint import Constraint as Constraint
    from softnlp.nlp.transcription import Collocation as Collocation
    from softnlp.nlp.transcription import MultipleShooting as MultipleShooting
    from softnlp.results import save as save
    from softnlp.results import to_dataset as to_dataset
    from softnlp.results import to_json as to_json
    from softnlp.rings.section_values import ENERGY as ENERGY
    from softnlp.scenario.design import run_design as run_design
    from softnlp.scenario.read import load_scenario as load_scenario
    from softnlp.scenario.run import run_scenario as run_scenario
    from softnlp.scenario.workspace import run_sweep as run_sweep
    from softnlp.statics.answer import Answer as Answer
    from softnlp.statics.answer import follow as follow
    from softnlp.statics.answer import solve as solve
    from softnlp.statics.case import case as case
    from softnlp.statics.posed import Problem as Problem
    from softnlp.statics.posed import problem as problem
    from softnlp.statics.step import Run as Run
    from softnlp.statics.step import Step as Step
    from softnlp.studies.blocked_force import blocked_force as blocked_force
    from softnlp.studies.blocked_force import constrained_pose as constrained_pose
    from softnlp.studies.blocked_force import force_against_offset as force_against_offset
    from softnlp.studies.compare import compare as compare
    from softnlp.studies.design import Design as Design
    from softnlp.studies.design import design as design
    from softnlp.studies.design_task import DesignTask as DesignTask
    from softnlp.studies.design_task import PressureSteps as PressureSteps
    from softnlp.studies.design_task import Range as Range
    from softnlp.studies.design_task import at_least as at_least
    from softnlp.studies.design_task import at_most as at_most
    from softnlp.studies.dynamic import dynamic as dynamic
    from softnlp.studies.ellipsoids import compliance_ellipsoid as compliance_ellipsoid
    from softnlp.studies.ellipsoids import manipulability as manipulability
    from softnlp.studies.ellipsoids import stiffness_ellipsoid as stiffness_ellipsoid
    from softnlp.studies.force_inversion import pressure_for_force as pressure_for_force
    from softnlp.studies.forward import forward as forward
    from softnlp.studies.identify import identify as identify
    from softnlp.studies.inverse import inverse as inverse
    from softnlp.studies.measurements import Measurements as Measurements
    from softnlp.studies.modes import modes as modes
    from softnlp.studies.registration import Registration as Registration
    from softnlp.studies.report import sensitivity_report as sensitivity_report
    from softnlp.studies.sensitivity import sensitivities as sensitivities
    from softnlp.studies.sensitivity import tip_compliance as tip_compliance
    from softnlp.studies.sensitivity import tip_jacobian as tip_jacobian
    from softnlp.studies.tensile import fit_tensile as fit_tensile
    from softnlp.studies.tolerances import error_bars as error_bars
    from softnlp.studies.tolerances import monte_carlo as monte_carlo
    from softnlp.studies.trajectory import trajectory as trajectory
    from softnlp.studies.variants import Variant as Variant
    from softnlp.studies.weight_sensitivity import weight_sensitivity as weight_sensitivity

_HOMES = {
    "base.errors": ("IllPosedError", "InputError", "MaterialError", "RobotError", "SoftnlpError"),
    "base.quantity": ("Quantity", "quantity"),
    "base.status": ("Status",),
    "base.units": ("BAR", "DEGREE", "MILLIMETRE", "NEWTON_MILLIMETRE"),
    "dynamics.simulation": ("Dynamics",),
    "model.body": ("Body", "Segment"),
    "model.contact_settings": ("Closure", "ClosureWeights", "ContactSettings"),
    "model.conventions": ("AS_PRINTED", "COEFFICIENT_SETS", "REPRODUCTION", "Coefficients", "Conventions"),
    "model.laws": ("formula_law", "function_law"),
    "model.load": ("Load",),
    "model.materials": ("Material", "load_materials", "material"),
    "model.numerics": ("Numerics",),
    "model.robot": ("ROBOTS", "Robot", "robot"),
    "model.segments": ("segmented_robot",),
    "model.obstacles": ("Capsule", "Cylinder", "Plane", "Sphere", "Trocar", "Tube"),
    "model.rod": ("Loads",),
    "model.section": ("Section", "SectionRadii", "SectionState"),
    "nlp.constraint": ("Constraint",),
    "nlp.transcription": ("Collocation", "MultipleShooting"),
    "results": ("save", "to_dataset", "to_json"),
    "rings.section_values": ("ENERGY",),
    "scenario.read": ("load_scenario",),
    "scenario.run": ("run_scenario",),
    "scenario.design": ("run_design",),
    "scenario.workspace": ("run_sweep",),
    "statics.answer": ("Answer", "follow", "solve"),
    "statics.case": ("case",),
    "statics.posed": ("Problem", "problem"),
    "statics.step": ("Run", "Step"),
    "studies.blocked_force": ("blocked_force", "constrained_pose", "force_against_offset"),
    "studies.compare": ("compare",),
    "studies.design": ("Design", "design"),
    "studies.design_task": ("DesignTask", "PressureSteps", "Range", "at_least", "at_most"),
    "studies.dynamic": ("dynamic",),
    "studies.ellipsoids": ("compliance_ellipsoid", "manipulability", "stiffness_ellipsoid"),
    "studies.force_inversion": ("pressure_for_force",),
    "studies.forward": ("forward",),
    "studies.identify": ("identify",),
    "studies.inverse": ("inverse",),
    "studies.measurements": ("Measurements",),
    "studies.modes": ("modes",),
    "studies.registration": ("Registration",),
    "studies.report": ("sensitivity_report",),
    "studies.sensitivity": ("sensitivities", "tip_compliance", "tip_jacobian"),
    "studies.tensile": ("fit_tensile",),
    "studies.tolerances": ("error_bars", "monte_carlo"),
    "studies.trajectory": ("trajectory",),
    "studies.variants": ("Variant",),
    "studies.weight_sensitivity": ("weight_sensitivity",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = sorted([*_HOME_OF, "__version__"])


class _Package(ModuleType):
    """The package: `robot` stays the function when the module that had this name is imported, in whatever order."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in _HOME_OF or not isinstance(value, ModuleType):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
install_old_paths()


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
