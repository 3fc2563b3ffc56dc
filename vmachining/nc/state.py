"""What the control remembers from block to block, and what expressions may ask it.

Two worlds run side by side. In the machine world a tool length moves the machine; in the simulation frame it
does not: there every tool has length zero, because the tip is what the stock meets. R turns about Z by the
rotation of the work offset; lengths mm:

    machine    = R (program + G92) + G5x + tool length   = R program + `to_machine`
    simulation = R (program + G92) + G5x - G5x at start  = R program + `to_sim`

An axis that is not programmed stays where it is in both worlds, so the simulated path never jumps when G43 is
switched. G92 keeps one offset for each world; they differ only while a tool length is in force. Rotary axes
have offsets (G5x and G92) and no length, hence one world, in degrees.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from math import cos, isnan, radians, sin
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from vmachining.nc.block import spell
from vmachining.nc.expressions import (
    FANUC,
    FUNCTIONS,
    MAX_NUMBER,
    Expression,
    Name,
    NoValueError,
    evaluate,
    parameter_number,
)
from vmachining.nc.fanuc_variables import FAMILY_FREE, is_switch, set_variable, variable
from vmachining.nc.frames import PLANES, UP, Frame, Plane
from vmachining.nc.model import Move, Point, add, subtract

if TYPE_CHECKING:
    from vmachining.nc.compensation import Compensation
    from vmachining.nc.cycles import Cycle, Pattern, Stored
    from vmachining.nc.settings import ToolEntry

ORIGIN: Final[Point] = (0.0, 0.0, 0.0)
LOCALS: Final = 30
"""Numbered parameters that each call of a subprogram has for itself."""

LAST_FREE: Final = 5000
ALARM: Final = 3000
"""Numbered parameters above this belong to the control."""

NOTES: Final = frozenset((*range(5061, 5071), 5599))
"""Numbers above it that are only notes: results of probing, whether (DEBUG, ...) prints."""

SYNC_MM: Final = 1e-9
"""Machine and simulation world agree when their difference is what the offsets say, up to rounding."""


class Saved(NamedTuple):
    """Modes of a moment, in the order of `MODES`. automatic : they come back when the subprogram ends."""

    automatic: bool
    values: tuple[Any, ...]


MODES: Final = (
    "scale", "plane", "absolute", "absolute_center", "feed_mode", "feed", "speed", "direction", "work", "length", "to_r",
)  # fmt: skip
"""What M70 saves: units, plane, distance and feed modes, F, S, spindle, work offset, tool length, cycle return."""


@dataclass(slots=True)
class State:
    """Modal state and position. Codes are ten times the G number; lengths mm.

    feed : mm/min in G94, mm/rev in G95, 1/min in G93 (then of the block only); None after a change of mode.
    held_feed : feed mode and feed before it, where no F was given since.
    direction : +1 M3, -1 M4, 0 stopped. selected : last T. length : tool length offset per axis.
    warned_stopped : W501 was given since the spindle stopped. rotations : degrees, per work offset; rotation and
    turn (its cosine and sine) : of the one in force. references : where G28 and G30 go, simulation frame;
    rotary_references : the same for the rotary axes, where not zero.
    rotary : machine degrees by "a", "b", "c", of the axes named so far; rotary_work, rotary_g92 : their
    offsets. tcp, tcp_length : tool centre point control, by an M code until its counterpart, by G43.4 until
    another code of its group. cycle : canned cycle in force; to_r : G99. compensation : cutter
    radius; tip : where the tool really is, when compensation left it beside the programmed point. plain : the
    short cut of the reader may be taken; offset : it may, under compensation. stored, pattern : dialect mts. table :
    tools by number, as G10 left them. levels : modes saved by M70 and M73 (or None), one item for the main program and
    one per call.
    plan : of the Fanuc family, what turns, scales, mirrors or tilts program coordinates; carried : the same as a map
    of `sim`, which then are coordinates before it, onto the simulation frame. axis : of the tool. corner : kind and size
    of the rounding or chamfer after `held`, the move that waits for its neighbour. return_level : where cycles go back
    to, where it is not the initial level. between : intermediate point of the last G28, machine coordinates.
    shrink : how much less each peck of a hole is, and the least. tap : lead of the tap in force, where its cycle gives it.
    coolant : "", "mist", "flood" or both. centre : last I J K, of controls that keep them.
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
    held_feed: tuple[int, float] | None = None
    speed: float = 0.0
    direction: int = 0
    selected: int | None = None
    tool: int = 0
    warned_stopped: bool = False
    ended: bool = False
    rotations: Mapping[int, float] = field(default_factory=dict)
    rotation: float = 0.0
    turn: tuple[float, float] = (1.0, 0.0)
    references: tuple[Point, Point] = (ORIGIN, ORIGIN)
    rotary_references: tuple[Mapping[str, float], Mapping[str, float]] = field(
        default_factory=lambda: ({}, {})
    )
    rotary: Mapping[str, float] = field(default_factory=dict)
    rotary_work: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    rotary_g92: Mapping[str, float] = field(default_factory=dict)
    rotary_saved: Mapping[str, float] = field(default_factory=dict)
    tcp: bool = False
    tcp_length: bool = False
    cycle: Cycle | None = None
    to_r: bool = False
    compensation: Compensation | None = None
    tip: Point | None = None
    plain: bool = True
    offset: bool = False
    stored: Stored | None = None
    pattern: Pattern | None = None
    table: Mapping[int, ToolEntry] = field(default_factory=dict)
    levels: tuple[Saved | None, ...] = (None,)
    plan: Frame | None = None
    carried: Frame | None = None
    axis: Point = UP
    corner: tuple[str, float] | None = None
    held: Move | None = None
    return_level: float | None = None
    shrink: tuple[float, float] | None = None
    tap: float = 0.0
    between: Point | None = None
    coolant: str = ""
    centre: Mapping[str, float] = field(default_factory=dict)

    @property
    def program(self) -> Point:
        """Position that the active work offset sees."""
        return self.seen(subtract(self.machine, self.to_machine))

    @property
    def tip_program(self) -> Point:
        """The same, of the simulated tip."""
        return self.seen(subtract(self.sim, self.to_sim))

    @property
    def rpm(self) -> float:
        """Signed spindle speed."""
        return self.speed * self.direction

    @property
    def centred(self) -> bool:
        """Whether tool centre point control is in force."""
        return self.tcp or self.tcp_length

    def turned(self, point: Point) -> Point:
        """R point."""
        if self.rotation == 0.0:
            return point
        c, s = self.turn
        return c * point[0] - s * point[1], s * point[0] + c * point[1], point[2]

    def seen(self, point: Point) -> Point:
        """R^-1 point."""
        if self.rotation == 0.0:
            return point
        c, s = self.turn
        return c * point[0] + s * point[1], c * point[1] - s * point[0], point[2]

    def rotary_shift(self, axis: str) -> float:
        """Machine minus program degrees of a rotary axis."""
        return self.rotary_work.get(self.work, {}).get(axis, 0.0) + self.rotary_g92.get(axis, 0.0)

    def place_offsets(self) -> None:
        """Recompute the sums of offsets after one of them has changed."""
        here = self.sim if self.carried is None else self.carried.apply(self.sim)
        work = self.offsets.get(self.work, ORIGIN)
        self.rotation = self.rotations.get(self.work, 0.0)
        self.turn = cos(radians(self.rotation)), sin(radians(self.rotation))
        self.to_machine = add(add(self.turned(self.g92), work), self.length)
        self.to_sim = add(self.turned(self.g92_sim), subtract(work, self.start_offset))
        self.lag = subtract(self.to_machine, self.to_sim)
        if self.plan is not None or self.carried is not None:
            self._carry(here)
        self.check_sync()

    def replan(self, plan: Frame | None) -> None:
        """Program coordinates are turned, scaled, mirrored or tilted like this; the tool stays where it is."""
        here = self.sim if self.carried is None else self.carried.apply(self.sim)
        self.plan = plan
        self._carry(here)
        self.check_sync()

    def _carry(self, here: Point) -> None:
        self.carried = None
        if self.plan is not None:
            zero = self.to_sim
            origin = add(zero, subtract(self.plan.origin, self.plan.vector(zero)))
            self.carried = self.plan._replace(origin=origin)
        self.sim = here if self.carried is None else self.carried.invert(here)
        self.machine = add(self.sim, self.lag)

    def check_sync(self) -> None:
        """Set `synced`: machine = simulation + lag; and `plain`: nothing bends the short cut."""
        gap = subtract(subtract(self.machine, self.sim), self.lag)
        self.synced = max(abs(gap[0]), abs(gap[1]), abs(gap[2])) < SYNC_MM
        upright = self.rotation == 0.0 and self.carried is None and self.axis == UP
        straight = upright and self.synced and self.tip is None and self.held is None
        self.plain = straight and self.compensation is None
        self.offset = straight and self.compensation is not None

    def save(self, automatic: bool) -> None:
        """M70; automatic : M73, the modes come back when the subprogram ends."""
        self.levels = (*self.levels[:-1], Saved(automatic, _MODES(self)))

    def restore(self) -> None:
        """M72: the modes saved at this level come back; motion code and position stay."""
        saved = self.levels[-1]
        if saved is not None:
            for name, value in zip(MODES, saved.values, strict=True):
                setattr(self, name, value)
            self.warned_stopped = False
            self.place_offsets()

    def clone(self) -> State:
        """A copy to try a block on."""
        return State(*_FIELDS(self))


_FIELDS: Final = attrgetter(*(item.name for item in fields(State)))
_MODES: Final = attrgetter(*MODES)


class Memory:
    """Parameters of the program. Satisfies `expressions.Parameters`.

    A subprogram has its own #1 to #30 and its own names; names that open with an underscore, and all other
    numbers, belong to everybody.
    """

    def __init__(self, state: State, family: bool = False) -> None:
        self.state, self.family = state, family
        self.last, self.locals = (99_999, 33) if family else (MAX_NUMBER, LOCALS)
        self.functions = FANUC if family else FUNCTIONS
        self.line = 0
        self.names: dict[str, float] = {}
        self._global: dict[str, float] = {"_value": 0.0, "_value_returned": 0.0}
        self.values: dict[int, float] = {}
        self._callers: list[tuple[dict[str, float], dict[int, float]]] = []

    def enter(self, values: list[float]) -> None:
        """A call: the values become #1, #2, ..., the rest of the thirty is zero."""
        kept = {k: self.values.pop(k) for k in range(1, self.locals + 1) if k in self.values}
        self._callers.append((self.names, kept))
        self.names = {}
        self.values.update(enumerate(values, 1))

    def enter_words(self, values: Mapping[int, float]) -> None:
        """A macro call: its own level whose #1 to #33 are these."""
        self.enter([])
        self.values.update(values)

    def __contains__(self, number: int) -> bool:
        return number in self.values

    def leave(self) -> None:
        """The end of the call."""
        self.names, kept = self._callers.pop()
        for key in range(1, self.locals + 1):
            self.values.pop(key, None)
        self.values.update(kept)

    def result(self, value: float | None) -> None:
        """What a subprogram returned, as #<_value>; #<_value_returned> says whether it did."""
        self._global["_value"] = value or 0.0
        self._global["_value_returned"] = float(value is not None)

    def named(self, name: str) -> float | None:
        """`#<name>`; names that open with an underscore may be those of the control."""
        if not name.startswith("_"):
            return self.names.get(name)
        value = self._global.get(name)
        return self._of_control(name) if value is None else value

    def numbered(self, number: int) -> float | None:
        """`#number`: zero while it was never set, None for a number of the control that is not kept here."""
        if self.family and number >= FAMILY_FREE:
            return self.values[number] if number in self.values else variable(self.state, number)
        if number <= LAST_FREE or number in NOTES:
            return self.values.get(number, 0.0)
        state = self.state
        if 5420 <= number <= 5422:
            return state.program[number - 5420] / state.scale
        if 5423 <= number <= 5425:
            axis = "abc"[number - 5423]
            return state.rotary.get(axis, 0.0) - state.rotary_shift(axis)
        for first in (5021, 5440):  # where G53 would lead here
            if first <= number <= first + 2:
                return state.machine[number - first] / state.scale
        if number == 5400:
            return float(state.tool)
        if 5401 <= number <= 5410:
            return self._tool(number)
        if number == 5210:
            return float(state.g92 != ORIGIN or any(state.rotary_g92.values()))
        if number == 5220:
            return float(list(WORK_OFFSETS).index(state.work) + 1)
        return self._offset(number)

    def _tool(self, number: int) -> float:
        """#5401 to #5410: offsets (X, Y, Z, six more) and diameter of the tool in the spindle."""
        entry = self.state.table.get(self.state.tool)
        if entry is None:
            return 0.0
        values = {5401: entry.x_mm, 5402: entry.y_mm, 5403: entry.length_mm, 5410: entry.diameter_mm}
        value = values.get(number, 0.0)
        return 0.0 if isnan(value) else value / self.state.scale

    def _offset(self, number: int) -> float | None:
        """Reference points (#5161, #5181), G92 (#5211) and work offsets (#5221, #5241, ...), in mm and degrees."""
        state = self.state
        base, place = next(((b, number - b) for b in _TABLES if 0 <= number - b <= 5), (0, 0))
        if not base:
            turned = (number - 5230) // 20 if (number - 5230) % 20 == 0 else -1
            return state.rotations.get(WORK_OFFSETS[turned], 0.0) if 0 <= turned < len(WORK_OFFSETS) else None
        axis = "abc"[place - 3] if place > 2 else ""
        if base < 5200:
            which = (base - 5161) // 20
            point = add(state.references[which], state.start_offset)
            return state.rotary_references[which].get(axis, 0.0) if axis else point[place]
        if base == 5211:
            return state.rotary_g92.get(axis, 0.0) if axis else state.g92[place]
        code = WORK_OFFSETS[(base - 5221) // 20]
        if axis:
            return state.rotary_work.get(code, {}).get(axis, 0.0)
        return state.offsets.get(code, ORIGIN)[place]

    def resolve(self, target: Name, value: Expression) -> tuple[str | int, float]:
        """Target and value of an assignment, before anything is written.

        Raises NoValueError: No value, or a target that belongs to the control.
        """
        number = evaluate(value, self)
        if target.name is not None:
            if self._of_control(target.name) is not None:
                raise NoValueError(f"#<{target.name}> belongs to the control and cannot be set")
            return target.name, number
        assert target.number is not None
        key = parameter_number(target.number, self)
        if self.family and key == ALARM:
            raise NoValueError(f"#3000 = {number:g}: the program stops here with its own alarm")
        if self.family and key >= FAMILY_FREE and not is_switch(key):
            set_variable(self.state.clone(), key, number)
        elif key > LAST_FREE and key not in NOTES and not (self.family and is_switch(key)):
            raise NoValueError(f"#{key} belongs to the control, setting it is not supported")
        return key, number

    def store(self, key: str | int, value: float) -> None:
        """Write a resolved assignment."""
        if isinstance(key, str):
            (self._global if key.startswith("_") else self.names)[key] = value
        elif self.family and key >= FAMILY_FREE and not is_switch(key):
            set_variable(self.state, key, value)
        else:
            self.values[key] = value

    def _of_control(self, name: str) -> float | None:
        state = self.state
        if name in ("_x", "_y", "_z"):
            return state.program["xyz".index(name[1])] / state.scale
        if name in ("_abs_x", "_abs_y", "_abs_z"):
            return state.machine["xyz".index(name[5])] / state.scale
        if name in ("_a", "_b", "_c"):
            return state.rotary.get(name[1], 0.0) - state.rotary_shift(name[1])
        if name in ("_metric", "_imperial"):
            return float((state.scale == 1.0) == (name == "_metric"))
        if name in ("_absolute", "_incremental"):
            return float(state.absolute == (name == "_absolute"))
        if name == "_feed":
            return (state.feed or 0.0) / (1.0 if state.feed_mode == 930 else state.scale)
        if name == "_rpm":
            return state.speed
        if name == "_line":
            return float(self.line)
        ask = _ASKED.get(name)
        return None if ask is None else float(ask(state))


_ASKED: Final[Mapping[str, Callable[[State], float | bool]]] = {
    "_current_tool": lambda state: state.tool,
    "_selected_tool": lambda state: state.selected or 0,
    "_tool_offset": lambda state: state.length != ORIGIN,
    "_plane": lambda state: next(code for code, plane in PLANES.items() if plane is state.plane),
    "_motion_mode": lambda state: 800 if state.motion is None else state.motion,
    "_coord_system": lambda state: state.work,
    "_ccomp": lambda state: 400 if state.compensation is None else 415 - 5 * state.compensation.side,
    "_inverse_time": lambda state: state.feed_mode == 930,
    "_units_per_minute": lambda state: state.feed_mode == 940,
    "_units_per_rev": lambda state: state.feed_mode == 950,
    "_retract_r_plane": lambda state: state.to_r,
    "_retract_old_z": lambda state: not state.to_r,
    "_ijk_absolute_mode": lambda state: state.absolute_center,
    "_spindle_on": lambda state: state.direction != 0,
    "_spindle_cw": lambda state: state.direction == 1,
    "_call_level": lambda state: len(state.levels) - 1,
    "_task": lambda _: 0,
    "_remap_level": lambda _: 0,
}
"""Modes that programs may read, by name; codes are ten times their number."""


WORK_OFFSETS: Final = (540, 550, 560, 570, 580, 590, 591, 592, 593)
_TABLES: Final = (5161, 5181, 5211, *range(5221, 5400, 20))
"""First of the parameters X, Y, Z, A, B, C of each offset."""


def work_offset_codes() -> dict[str, int]:
    """Names of the work offsets, "G54" to "G59.3", and their codes."""
    return {spell("G", code): code for code in WORK_OFFSETS}
