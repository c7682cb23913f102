"""What a sweep solves and in what order: a table of poses cut into chunks of neighbours."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.batch.poses import row_type
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.inputs import conventions_table, segment_tables
from softnlp.model.numerics import Numerics
from softnlp.model.obstacle_tables import obstacle_tables
from softnlp.model.obstacles import Obstacle
from softnlp.model.outline_tables import outline_tables
from softnlp.model.outlined import OutlinedRobot
from softnlp.model.quantities import LOADS, Model, contact_quantities
from softnlp.model.rod import Loads
from softnlp.model.segments import SegmentedRobot, declared

Array = NDArray[np.float64]

CHUNK = 1024


@dataclass(frozen=True, eq=False)
class Plan:
    """The poses of a sweep.

    model, loads, contact : what every pose shares; contact None sweeps poses without a wall.
    varied : names of the quantities (`softnlp.model.quantities`) that differ between poses, "pressure" among them.
    values : (poses, columns) of those, SI, a column an entry in the order of `varied`.
    order : (poses,) numbers of the poses, neighbours next to each other. Each `chunk` of them is one piece of work,
    whose result depends on nothing outside it.
    times : (poses,) [s] of poses that were read with a time, or None. obstacles : what every pose is among.
    """

    model: Model
    loads: Loads
    numerics: Numerics
    contact: ContactSettings | None
    varied: tuple[str, ...]
    values: Array
    order: NDArray[np.int64]
    chunk: int = CHUNK
    times: Array | None = None
    obstacles: tuple[Obstacle, ...] = ()

    @property
    def poses(self) -> int:
        """The number of poses."""
        return len(self.values)

    @property
    def chunks(self) -> int:
        """The number of chunks."""
        return -(-self.poses // self.chunk)

    def members(self, chunk: int) -> NDArray[np.int64]:
        """Return the numbers of the poses of a chunk, in its order."""
        return self.order[chunk * self.chunk : (chunk + 1) * self.chunk]

    @property
    def row_type(self) -> np.dtype[Any]:
        """The type of a row of the result."""
        return row_type(self.model.chambers, wall=self.contact is not None, obstacles=len(self.obstacles))

    @cached_property
    def nominal(self) -> dict[str, Array]:
        """Every quantity of a pose by name, in the order of `softnlp.model.quantities`, with the plan's loads [SI]."""
        values = {name: q.nominal for name, q in declared(self.model).items()}
        return values | {name: np.asarray(getattr(self.loads, name), float) for name in LOADS}

    def columns_of(self, name: str) -> slice:
        """Return where a varied quantity stands in `values`."""
        before = self.varied[: self.varied.index(name)]
        start = sum(self.nominal[other].size for other in before)
        return slice(start, start + self.nominal[name].size)

    def pressures(self) -> Array:
        """Return the pressures of every pose (poses, sets) [Pa]."""
        return self.values[:, self.columns_of("pressure")]

    def full_values(self, numbers: NDArray[np.int64]) -> Array:
        """Return every quantity of some poses as (quantities, poses), ordered as `softnlp.model.quantities`, SI."""
        table = np.repeat(np.concatenate(list(self.nominal.values()))[:, None], numbers.size, axis=1)
        own = self.values[numbers].T
        start = 0
        for name, nominal in self.nominal.items():
            if name in self.varied:
                table[start : start + nominal.size] = own[self.columns_of(name)]
            start += nominal.size
        return table

    def fingerprint(self) -> str:
        """Return a digest of everything that the result depends on."""
        told: Mapping[str, Any] = {
            "robot": self.model.robot.name,
            "sets": [self.model.robot.chamber_sets, self.model.robot.chambers_per_set],
            "material": self.model.material.name,
            "law": self.model.material.law.told,
            "quantities": {name: [float(v).hex() for v in values] for name, values in self.nominal.items()},
            "wall": {n: [float(v).hex() for v in q.nominal] for n, q in contact_quantities(self.model).items()},
            "conventions": conventions_table(self.model.conventions),
            "numerics": asdict(self.numerics),
            "contact": None if self.contact is None else asdict(self.contact),
            "varied": list(self.varied),
            "chunk": self.chunk,
        }
        if self.obstacles:
            told = {**told, "obstacles": obstacle_tables(self.obstacles)}
        if isinstance(self.model.robot, SegmentedRobot):
            told = {**told, "segment": segment_tables(self.model.robot)}
        elif isinstance(self.model.robot, OutlinedRobot):
            told = {**told, "outlines": outline_tables(self.model.robot)}
        digest = hashlib.sha256(json.dumps(told, sort_keys=True).encode())
        for part in (self.values, self.order, *(() if self.times is None else (self.times,))):
            digest.update(np.ascontiguousarray(part).tobytes())
        return digest.hexdigest()


def cells(values: Array, chunk: int) -> NDArray[np.int64]:
    """Return an order in which every chunk is a compact cell: tables are halved across their widest column.

    values : (poses, columns); columns are compared by the part of their whole range that a cell spans. The order is
    the same on every machine: equal values stand in the order of the poses, since those of a partition differ.
    """
    span = np.ptp(values, axis=0)
    columns = np.ascontiguousarray((values / np.where(span > 0, span, 1.0)).T[span > 0])
    if not len(columns):
        return np.arange(len(values), dtype=np.int64)
    ranks = np.empty(columns.shape, np.int64)
    for column, rank in zip(columns, ranks, strict=True):
        rank[np.argsort(column, kind="stable")] = np.arange(len(values))
    done: list[NDArray[np.int64]] = []
    waiting = [np.arange(len(values), dtype=np.int64)]
    while waiting:
        cell = waiting.pop()
        own = columns[:, cell]
        if cell.size <= chunk:
            done.append(cell[np.lexsort((cell, *own[::-1]))])
            continue
        # a whole number of chunks on the left keeps every chunk but the last full
        cut = chunk * max(1, round(cell.size / chunk / 2))
        widest = int(np.argmax(np.ptp(own, axis=1)))
        parted = np.argpartition(ranks[widest, cell], cut)
        waiting += [cell[parted[cut:]], cell[parted[:cut]]]
    return np.concatenate(done)
