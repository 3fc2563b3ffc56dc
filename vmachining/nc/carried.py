"""Moves of coordinates that are turned, scaled, mirrored or tilted, brought into the frame of the workpiece."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from vmachining.nc.arcs import PLANES
from vmachining.nc.frames import IDENTITY, UP, Frame
from vmachining.nc.model import Finding, Motion, Move, Point
from vmachining.nc.placing import Placing
from vmachining.nc.settings import Settings
from vmachining.nc.state import State
from vmachining.nc.vectors import add, subtract

_BY_NAME: Final = {plane.name: plane for plane in PLANES.values()}


class _Carrier(Placing):
    """Writes moves through a frame, from a tool axis on."""

    def __init__(self, settings: Settings, frame: Frame | None, axis: Point) -> None:
        super().__init__(settings)
        self.frame, self.axis = frame or IDENTITY, axis

    def carry(self, move: Move, axis: Point) -> None:
        """The move, at whose end the tool has this axis; rotary axes stay what they are."""
        self.plane, self.last = _BY_NAME[move.plane], self.frame.apply(move.start)
        if move.motion is Motion.DWELL:
            self._add(move, self.last, self.last, None)
            return
        first = len(self.moves)
        self._out_plane(move, axis)
        if move.rotary_deg is not None and axis == UP:
            start = move.rotary_start
            for k in range(first, len(self.moves)):
                self.moves[k] = self.moves[k]._replace(rotary_deg=move.rotary_deg, rotary_start=start)
                start = move.rotary_deg

    def swing(self, cause: Move, axis: Point) -> None:
        """The slides stand, the rotary axes turn the tool to its axis."""
        self.line, self.n, self.plane = cause.line, cause.n, _BY_NAME[cause.plane]
        self._swing(axis, cause)


def carried(moves: Sequence[Move], state: State, settings: Settings, vector: Point | None) -> list[Move]:
    """The moves of a block, whose ends are coordinates before the frame; vector : tool axis at their end, where it changes."""
    out = _Carrier(settings, state.carried, state.axis)
    for move in moves:
        out.carry(move, vector or state.axis)
    state.axis = out.axis
    return [move._replace(end_machine=add(move.end, state.lag)) for move in out.moves]


def pivoted(cause: Move, state: State, settings: Settings, axis: Point) -> tuple[list[Move], list[Finding]]:
    """The tool axis turns while the slides stand; where the tip goes is taken as if the table turned about zero.

    Where words of the rotary axes have turned it before, it does not move again.
    """
    out = _Carrier(settings, state.carried, state.axis)
    out.last = out.frame.apply(state.sim)
    out.swing(cause, axis)
    if state.axis == UP != axis and any(state.rotary.values()):
        out.moves.clear()
    state.axis = out.axis
    state.sim = out.frame.invert(out.last)
    state.machine = add(state.sim, state.lag)
    state.check_sync()
    return [move._replace(end_machine=add(move.end, state.lag)) for move in out.moves], out.findings


def turned_arc(move: Move, state: State, settings: Settings, start: Point, end: Point) -> list[Move]:
    """An arc of G18 or G19 under a work offset that is turned about Z: circles that lean. start, end : program coordinates."""
    c, s = state.turn
    out = _Carrier(settings, Frame(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)), state.to_sim), UP)
    out.carry(move._replace(start=start, end=end, rotation_deg=0.0), UP)
    return [
        item._replace(
            end_machine=add(item.end, state.lag),
            end_program=state.seen(subtract(item.end, state.to_sim)),
            rotation_deg=state.rotation,
        )
        for item in out.moves
    ]
