"""Cycles of cutter location files: CYCLE/DRILL,RAPTO,3,FEDTO,-20,RTRCTO,AUTO,MMPM,100, then one GOTO for each hole.

The GOTO names the top of the hole. Along the tool axis the clearance plane lies RAPTO (or CLEAR) above it, the bottom
FEDTO below it (a negative number in NX files, a positive one in others), and the tool goes back to RTRCTO above it:
AUTO is the level where the cycle began, and without the word it stays on the clearance plane. Between holes it travels
at the level it has; where the next clearance plane lies higher it rises first.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from vmachining.nc.apt_records import Record
from vmachining.nc.refusal import RecordError

UNITS: Final = {"MMPM", "IPM", "MMPR", "IPR", "PERMIN", "PERREV"}
_PLAIN: Final = frozenset(
    {"DRILL", "FACE", "SPOT", "CDRILL", "REAM", "THRU", "BORE", "BOREOS", "BORE5", "STAND", "STD"}
)
_PECK: Final = frozenset({"DEEP", "DEEP2", "PECK"})
_BREAK: Final = frozenset({"BRKCHP", "BREAK", "CHIP"})
_TAP: Final = frozenset({"TAP", "RTAP", "RIGTAP"})
_FEED_OUT: Final = frozenset({"REAM", "BORE", "BORE5"})
_LENGTHS: Final = (
    "RAPTO",
    "CLEAR",
    "FEDTO",
    "DEPTH",
    "RTRCTO",
    "STEP",
    "STEP1",
    "STEP2",
    "INCR",
    "1STPECK",
    "SUBPECK",
)
_HARMLESS: Final = frozenset({"AUTO", "CAM", "NULL", "SPIRAL", "ON", "NODRAG", "ORIENT"})
MAX_STEPS: Final = 100_000


class CycleStep(NamedTuple):
    """One motion along the axis: height above the top of the hole, whether it feeds, dwell before it continues, s."""

    height: float
    feeds: bool
    dwell: float = 0.0


class HoleCycle(NamedTuple):
    """A cycle in force; lengths mm along the tool axis. back : None: where the cycle began. feed : (value, unit)."""

    kind: str
    clear: float
    depth: float
    back: float | None
    first: float = 0.0
    step: float = 0.0
    dwell: float = 0.0
    feed: tuple[float, str] | None = None
    out: bool = False

    def steps(self, gap: float) -> list[CycleStep]:
        """From the clearance plane to the bottom and back to it; gap : between a retract and the last depth."""
        bottom = -self.depth
        if not self.step:
            down = [CycleStep(bottom, True, self.dwell)]
            return [*down, CycleStep(self.clear, True)] if self.out else down
        out, at, first = list[CycleStep](), 0.0, True
        while True:
            at -= self.first if first and self.first else self.step
            first = False
            if at <= bottom + 1e-9:
                return [*out, CycleStep(bottom, True, self.dwell)]
            if len(out) > MAX_STEPS:
                raise RecordError("E334", f"over {MAX_STEPS} steps in one hole")
            out.append(CycleStep(at, True, self.dwell))
            if self.kind != "BRKCHP":
                out.append(CycleStep(self.clear, False))
            out.append(CycleStep(min(at + gap, self.clear), False))


def cycle_of(record: Record, unit: float, signed: bool) -> HoleCycle:
    """The cycle that a record starts.

    unit : mm per unit of the file. signed : depths are negative below the top of the hole, as in NX files.
    Raises RecordError: A cycle or a word that is not known, or a depth that is missing.
    """
    kinds = [name for name in record.names if name in _PLAIN | _PECK | _BREAK | _TAP]
    known = {*_LENGTHS, *UNITS, *_HARMLESS, *kinds, "DWELL", "REV", "SEC"}
    if not kinds or (other := next((name for name in record.names if name not in known), None)):
        what = record.names[0] if not kinds and record.names else other if kinds else "without a name"
        raise RecordError(
            "E208", f"CYCLE/{record.text[:40]}: {what} is not supported", "post the holes as single moves"
        )
    depth, clear = record.after("FEDTO", "DEPTH"), record.after("RAPTO", "CLEAR")
    if depth is None and (kinds[0] in record.values) and not any(n in _LENGTHS for n in record.names):
        depth = record.after(kinds[0])
    if depth is None or depth == 0.0:
        raise RecordError("E331", "a cycle without FEDTO, the depth of its holes")
    if signed and depth > 0.0:
        raise RecordError("E333", f"FEDTO {depth:g} lies above the top of the hole")
    if clear is not None and clear < 0.0:
        raise RecordError("E333", f"RAPTO {clear:g} lies below the top of the hole")
    feed = next(((v, name) for name in UNITS if (v := record.after(name)) is not None), None)
    first, step = record.after("1STPECK", "STEP1"), record.after("STEP", "STEP2", "INCR", "SUBPECK")
    pecks = bool(set(kinds) & (_PECK | _BREAK)) or step is not None
    if pecks and not (step or first):
        raise RecordError("E334", f"CYCLE/{kinds[0]} without STEP", "program STEP")
    if (step or 0.0) < 0.0 or (first or 0.0) < 0.0:
        raise RecordError("E334", "a step of a cycle is negative")
    back = record.after("RTRCTO")
    dwell = record.after("DWELL") or 0.0
    revolutions = "REV" in record.names
    tap = bool(set(kinds) & _TAP)
    return HoleCycle(
        "BRKCHP" if set(kinds) & _BREAK else "TAP" if tap else kinds[0],
        (clear or 0.0) * unit,
        abs(depth) * unit,
        None
        if "RTRCTO" in record.names and back is None
        else (clear or 0.0) * unit
        if back is None
        else back * unit,
        (first or 0.0) * unit if pecks else 0.0,
        (step or first or 0.0) * unit if pecks else 0.0,
        0.0 if revolutions else dwell,
        feed,
        tap or bool(set(kinds) & _FEED_OUT),
    )
