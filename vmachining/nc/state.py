"""What the control remembers from block to block, and what expressions may ask it.

Two worlds run side by side. In the machine world a tool length moves the machine; in the simulation frame it
does not: there every tool has length zero, because the tip is what the stock meets. Per axis, mm:

    machine    = program + (G92 + G5x + tool length)  = program + `to_machine`
    simulation = program + (G92 + G5x - G5x at start) = program + `to_sim`

An axis that is not programmed stays where it is in both worlds, so the simulated path never jumps when G43 is
switched. G92 keeps one offset for each world; they differ only while a tool length is in force.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from vmachining.nc.arcs import PLANES, Plane
from vmachining.nc.codes import spell
from vmachining.nc.expressions import Expression, Name, NoValueError, evaluate, parameter_number
from vmachining.nc.model import Point

__all__ = ["ORIGIN", "Memory", "State", "add", "subtract"]

ORIGIN: Final[Point] = (0.0, 0.0, 0.0)
LAST_FREE: Final = 5000
"""Numbered parameters above this belong to the control."""

SYNC_MM: Final = 1e-9
"""Machine and simulation world agree when their difference is what the offsets say, up to rounding."""


def add(a: Point, b: Point) -> Point:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a: Point, b: Point) -> Point:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@dataclass(slots=True)
class State:
    """Modal state and position. Codes are ten times the G number; lengths mm.

    feed : mm/min in G94, mm/rev in G95, 1/min in G93 (then of the block only); None after a change of mode.
    direction : +1 M3, -1 M4, 0 stopped. selected : last T. length : tool length offset per axis.
    warned_stopped : W501 was given since the spindle stopped.
    """

    sim: Point
    machine: Point
    offsets: Mapping[int, Point]
    start_offset: Point
    work: int = 540
    g92: Point = ORIGIN
    g92_sim: Point = ORIGIN
    g92_saved: tuple[Point, Point] = (ORIGIN, ORIGIN)
    length: Point = ORIGIN
    to_machine: Point = ORIGIN
    to_sim: Point = ORIGIN
    lag: Point = ORIGIN
    synced: bool = True
    motion: int | None = None
    plane: Plane = PLANES[170]
    absolute: bool = True
    absolute_center: bool = False
    scale: float = 1.0
    feed_mode: int = 940
    feed: float | None = None
    speed: float = 0.0
    direction: int = 0
    selected: int | None = None
    tool: int = 0
    warned_stopped: bool = False
    ended: bool = False

    @property
    def program(self) -> Point:
        """Position that the active work offset sees."""
        return subtract(self.machine, self.to_machine)

    @property
    def rpm(self) -> float:
        """Signed spindle speed."""
        return self.speed * self.direction

    def place_offsets(self) -> None:
        """Recompute the sums of offsets after one of them has changed."""
        work = self.offsets.get(self.work, ORIGIN)
        self.to_machine = add(add(self.g92, work), self.length)
        self.to_sim = add(self.g92_sim, subtract(work, self.start_offset))
        self.lag = subtract(self.to_machine, self.to_sim)
        self.check_sync()

    def check_sync(self) -> None:
        """Set `synced`: machine = simulation + lag, what the fast path relies on."""
        gap = subtract(subtract(self.machine, self.sim), self.lag)
        self.synced = max(abs(gap[0]), abs(gap[1]), abs(gap[2])) < SYNC_MM

    def clone(self) -> State:
        """A copy to try a block on."""
        twin: State = object.__new__(State)
        for name in _FIELDS:
            setattr(twin, name, getattr(self, name))
        return twin


_FIELDS: Final = tuple(State.__slots__)


class Memory:
    """Parameters of the program. Satisfies `expressions.Parameters`."""

    def __init__(self, state: State) -> None:
        self.state = state
        self._named: dict[str, float] = {}
        self._numbered: dict[int, float] = {}

    def named(self, name: str) -> float | None:
        """`#<name>`; names that open with an underscore may be those of the control."""
        value = self._named.get(name)
        if value is None and name.startswith("_"):
            value = self._of_control(name)
        return value

    def numbered(self, number: int) -> float | None:
        """`#number`: zero while it was never set, None for a number of the control that is not kept here."""
        if number <= LAST_FREE:
            return self._numbered.get(number, 0.0)
        state = self.state
        if 5420 <= number <= 5422:
            return state.program[number - 5420] / state.scale
        if number == 5400:
            return float(state.tool)
        if number == 5220:
            return float(list(_WORK_OFFSETS).index(state.work) + 1)
        return None

    def resolve(self, target: Name, value: Expression) -> tuple[str | int, float]:
        """Target and value of an assignment, before anything is written.

        Raises
        ------
        NoValueError
            No value, or a target that belongs to the control.
        """
        number = evaluate(value, self)
        if target.name is not None:
            if self._of_control(target.name) is not None:
                raise NoValueError(f"#<{target.name}> belongs to the control and cannot be set")
            return target.name, number
        assert target.number is not None
        key = parameter_number(target.number, self)
        if key > LAST_FREE:
            raise NoValueError(f"#{key} belongs to the control, setting it is not supported")
        return key, number

    def store(self, key: str | int, value: float) -> None:
        """Write a resolved assignment."""
        if isinstance(key, str):
            self._named[key] = value
        else:
            self._numbered[key] = value

    def _of_control(self, name: str) -> float | None:
        state = self.state
        if name in ("_x", "_y", "_z"):
            return state.program["xyz".index(name[1])] / state.scale
        if name in ("_metric", "_imperial"):
            return float((state.scale == 1.0) == (name == "_metric"))
        if name in ("_absolute", "_incremental"):
            return float(state.absolute == (name == "_absolute"))
        if name == "_feed":
            return (state.feed or 0.0) / (1.0 if state.feed_mode == 930 else state.scale)
        if name == "_rpm":
            return state.speed
        return float(state.tool) if name == "_current_tool" else None


_WORK_OFFSETS: Final = (540, 550, 560, 570, 580, 590, 591, 592, 593)


def work_offset_codes() -> dict[str, int]:
    """Names of the work offsets, "G54" to "G59.3", and their codes."""
    return {spell("G", code): code for code in _WORK_OFFSETS}
