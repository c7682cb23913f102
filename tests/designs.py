"""Robots, silicones and states of loading drawn at random, and the same ones as the witness knows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from witness_section import LAWS, Body, Choices, NoRoot, Rubber, Section, Unstable, balance_pressure, section

from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material, load_materials
from softnlp.model.robot import Robot, violations
from softnlp.model.rod import Loads

SILICONES = ("Dragon Skin 10", "Ecoflex 00-50", "Ecoflex 00-30", "Ecoflex 00-20", "Ecoflex 00-10")
LAW_NAMES = tuple(LAWS)
GRAVITY = 9.80665
_ENTRIES = load_materials()


@dataclass(frozen=True, eq=False)
class Design:
    """A robot in a state of loading. pressure : (sets,) [Pa]. section : the witness's, at that pressure."""

    robot: Robot
    material: Material
    pressure: np.ndarray
    loads: Loads
    section: Section

    def __str__(self) -> str:
        r = self.robot
        widths = [f"{1e3 * w:.4g}" for w in (r.outer_diameter, r.lumen_diameter, r.chamber_diameter, r.length)]
        return (
            f"D_r D_i D_c L {' '.join(widths)} mm, {r.chamber_sets}x{r.chambers_per_set}, {self.material.name} "
            f"{self.material.law.name}, stretch {self.section.stretch:.3f}, bar {np.round(self.pressure / 1e5, 4)}, "
            f"{self.loads}"
        )


def body_of(robot: Robot) -> Body:
    """Return a robot's dimensions as the witness takes them."""
    return Body(
        robot.outer_diameter,
        robot.lumen_diameter,
        robot.chamber_circle_diameter,
        robot.chamber_diameter,
        robot.chamber_wall,
        robot.length,
        robot.chamber_sets,
        robot.chambers_per_set,
        robot.chamber_angle,
    )


def rubber_of(material: Material) -> Rubber:
    """Return a built-in law with the same constants, differentiated by hand."""
    return LAWS[material.law.name](*(float(value) for value in material.constants.values()))


def choices_of(coefficients: Coefficients, conventions: Conventions = REPRODUCTION) -> Choices:
    """Return coefficients and conventions as the witness takes them."""
    return Choices(
        k_e=coefficients.elongation,
        k_b=coefficients.bending,
        k_a=coefficients.area,
        k_i=coefficients.inertia,
        phi=coefficients.bore_fraction,
        opposes=conventions.stiffening_opposes_pressure,
        t_f=conventions.fibre_thickness,
        mean_pressure=conventions.mean_pressure,
    )


def silicone(name: str, law: str = "mooney-rivlin") -> Material:
    """Return a silicone of the library; the file is read once."""
    return _ENTRIES[name].models[law]


def random_robot(rng: np.random.Generator, *, sets: Sequence[int] = (2, 3, 4)) -> Robot:
    """Draw dimensions until they describe a robot that can be made."""
    while True:
        D_r = rng.uniform(8e-3, 30e-3)
        n1, n2 = int(rng.choice(sets)), int(rng.integers(1, 4))
        robot = Robot(
            name="random",
            outer_diameter=D_r,
            lumen_diameter=D_r * rng.uniform(0.2, 0.5),
            chamber_circle_diameter=D_r * rng.uniform(0.55, 0.75),
            chamber_diameter=D_r * rng.uniform(0.08, 0.2),
            chamber_wall=rng.uniform(0.3e-3, 0.8e-3),
            length=D_r * rng.uniform(2.0, 6.0),
            chamber_sets=n1,
            chambers_per_set=n2,
            chamber_angle=2 * np.pi / (n1 * n2) * rng.uniform(0.6, 1.0) if n2 > 1 else 0.0,
        )
        if not violations(robot):
            return robot


def random_material(rng: np.random.Generator, laws: Sequence[str] = LAW_NAMES) -> Material:
    """Draw a silicone and a law."""
    return silicone(str(rng.choice(SILICONES)), str(rng.choice(laws)))


def random_pressures(
    rng: np.random.Generator,
    robot: Robot,
    material: Material,
    *,
    most_stretch: float = 1.8,
    most_bending: float = 200.0,
) -> tuple[np.ndarray, Section]:
    """Draw pressures [Pa] whose unloaded arc bends by at most `most_bending` [deg]; return them and the section."""
    body, rubber = body_of(robot), rubber_of(material)
    share = rng.dirichlet(np.full(robot.chamber_sets, 0.6))
    stretch = rng.uniform(1.02, most_stretch)
    while True:
        total = balance_pressure(body, rubber, stretch)
        try:
            made = section(body, rubber, share * total / robot.chambers_per_set)
        except (NoRoot, Unstable):
            made = None
        if made is not None:
            bending = np.degrees(made.L * np.hypot(made.M_P[0] / made.EI[0], made.M_P[1] / made.EI[1]))
            if bending <= most_bending:
                return made.pressures[:: robot.chambers_per_set], made
        stretch = 1 + 0.8 * (stretch - 1)


def unit_vector(rng: np.random.Generator) -> np.ndarray:
    """Draw a direction."""
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def random_loads(rng: np.random.Generator, made: Section, *, force: float, moment: float) -> Loads:
    """Draw a tip force up to `force` EI/L^2, a moment up to `moment` EI/L and gravity in any direction."""
    EI = sum(made.EI) / 2
    return Loads(
        tip_force=rng.uniform(0, force) * EI / made.L**2 * unit_vector(rng),
        tip_moment=rng.uniform(0, moment) * EI / made.L * unit_vector(rng),
        gravity=GRAVITY * unit_vector(rng) * (rng.uniform() < 0.8),
    )


def random_design(
    rng: np.random.Generator,
    *,
    laws: Sequence[str] = LAW_NAMES,
    force: float = 1.5,
    moment: float = 0.7,
    most_stretch: float = 1.8,
    most_bending: float = 200.0,
) -> Design:
    """Draw a robot, a silicone, pressures and loads."""
    robot, material = random_robot(rng), random_material(rng, laws)
    pressure, made = random_pressures(rng, robot, material, most_stretch=most_stretch, most_bending=most_bending)
    return Design(robot, material, pressure, random_loads(rng, made, force=force, moment=moment), made)
