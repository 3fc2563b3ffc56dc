"""One joint of a machine: a slide or a rotary axis, where it lies and how far it goes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import KinematicsError


class Kind(StrEnum):
    """What a joint does."""

    LINEAR = "linear"
    ROTARY = "rotary"


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """A joint, in machine axes at the home position (all joints zero).

    name : letter of the program word, e.g. "X".
    direction : (3,) unit.
    point : (3,) mm on the line of a rotary axis; without meaning for a slide.
    sign : +1 if a positive coordinate moves whatever is nearer to the tool, relative to what is nearer to the
        workpiece, along or right-handed about `direction`; -1 for the other way. A head axis in the right-hand
        sense has +1. A table axis has -1 if its coordinate is the physical motion of the table, +1 if it
        follows ISO 841 (the tool moves in the positive sense relative to the work).
    lower, upper : travel, mm or rad; infinite for none.
    max_speed : mm/s or rad/s; max_acceleration : mm/s^2 or rad/s^2; infinite for none.

    Raises KinematicsError: No direction, a sign other than +1 and -1, a travel without zero length, limits that are not
        positive.
    """

    name: str
    kind: Kind
    direction: Floats
    point: Floats
    sign: int
    lower: float
    upper: float
    max_speed: float
    max_acceleration: float

    def __init__(
        self,
        name: str,
        kind: Kind | str,
        direction: ArrayLike,
        *,
        point: ArrayLike = (0.0, 0.0, 0.0),
        sign: int = 1,
        lower: float = -math.inf,
        upper: float = math.inf,
        max_speed: float = math.inf,
        max_acceleration: float = math.inf,
    ) -> None:
        where = f"axis {name}"
        try:
            sort = Kind(kind)
            way, place = (
                np.array(rows(v, 3, name=n)) for v, n in ((direction, "direction"), (point, "point"))
            )
        except ValueError as exc:
            raise KinematicsError(f"{where}: {exc}") from exc
        size = float(np.linalg.norm(way))
        if size == 0.0:
            raise KinematicsError(f"{where}: its direction has no length")
        way /= size
        if sign not in (1, -1):
            raise KinematicsError(f"{where}: sign is {sign}, expected +1 or -1")
        if not lower < upper:
            raise KinematicsError(f"{where}: travel from {lower:g} to {upper:g} is empty")
        for what, value in (("max_speed", max_speed), ("max_acceleration", max_acceleration)):
            if not value > 0:
                raise KinematicsError(f"{where}: {what} is {value:g}, expected a positive number")
        way.setflags(write=False)
        place.setflags(write=False)
        numbers = map(float, (lower, upper, max_speed, max_acceleration))
        for field, entry in zip(self.__slots__, (name, sort, way, place, int(sign), *numbers), strict=True):
            object.__setattr__(self, field, entry)

    @property
    def is_rotary(self) -> bool:
        """Whether it turns."""
        return self.kind is Kind.ROTARY

    @property
    def unit(self) -> str:
        """Unit people read: mm or deg."""
        return "deg" if self.is_rotary else "mm"

    def shown(self, value: float) -> float:
        """A coordinate in the unit people read."""
        return math.degrees(value) if self.is_rotary else value
