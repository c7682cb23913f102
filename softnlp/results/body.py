"""The body of a solved step as figures and meshes take it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from softnlp.base.arrays import Array
from softnlp.statics.step import Pose, SectionRadii


@dataclass(frozen=True, eq=False)
class Body:
    """The body of one solved step.

    position : (M, 3) p [m]. rotation : (M, 3, 3) R, columns are the body axes. radii : of the deformed section; (M,)
    each where it is not the same along it. parts : of several segments each by itself, without connectors.
    """

    position: Array
    rotation: Array
    radii: SectionRadii
    parts: tuple[Body, ...] = ()

    @property
    def pieces(self) -> tuple[Body, ...]:
        """Its segments, itself where there is one."""
        return self.parts or (self,)


def chain_body(position: Array, rotation: Array, radii: Mapping[str, Array], segment: Array) -> Body:
    """Return the body of several segments. radii : (M,) by name. segment : (M,) of each point from 1, 0 of none."""

    def of(chosen: Any) -> SectionRadii:
        there: dict[str, Any] = {name: values[chosen] for name, values in radii.items()}
        return SectionRadii(**there)

    numbers = range(1, int(segment.max(initial=0)) + 1)
    parts = [Body(position[own], rotation[own], of(own)) for own in (segment == k for k in numbers)]
    return Body(position, rotation, of(slice(None)), tuple(parts))


def body_of_pose(pose: Pose) -> Body:
    """Return the body of a solved pose."""
    if pose.outline is None:
        return Body(pose.shape.position, pose.shape.rotation, pose.radii)
    return chain_body(pose.shape.position, pose.shape.rotation, vars(pose.outline), pose.segment)
