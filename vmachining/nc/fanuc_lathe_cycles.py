"""Cycles of lathes of the Fanuc family: single passes, threads, holes, and those of many passes, which are left out.

    G90 G94 G92 X Z R F   one pass: along, across, a thread (system B: G77 G79 G78)
    G83 to G85, G87 to G89  holes along Z, and along X; R counts from where the tool is
    G70 P Q, Okuma G87 N    the contour of these blocks, as it is written; then back to where it began
    G71 to G73, G76, Okuma G85 G86   many passes: left out, and said (W379); the tool comes back to where they began

Source: operator's manual of the Fanuc series 0i-T and 30i (lathe), Okuma OSP-P200L programming manual.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from vmachining.nc.block import Problem, spell
from vmachining.nc.fanuc import Translator
from vmachining.nc.fanuc_line import Line, Words
from vmachining.nc.lexer import Word
from vmachining.nc.settings import Settings
from vmachining.nc.state import State

Contour = tuple[int, int]
"""First and last line, 0-based."""
Find = Callable[[int, int | None, int, bool], Contour | None]
"""Of the blocks N first to N last (None: to G80), looked for from a line on; again: the one that was roughed."""

PASSES: Final = {770: 900, 790: 940, 780: 920}
"""Single passes of system B by those of system A."""
HOLES: Final = {830: "Z", 840: "Z", 850: "Z", 870: "X", 880: "X", 890: "X"}
MANY: Final = {
    710: "roughing along", 720: "roughing across", 730: "roughing after a pattern", 740: "pecking along",
    750: "pecking across", 760: "a thread in several passes", 850: "roughing", 860: "roughing after a pattern",
}  # fmt: skip


class _Pass(NamedTuple):
    """A single pass in force: code of system A, goal, taper, lead or feed."""

    code: int
    x: float
    z: float
    taper: float
    feed: float | None


class Turned(Line):
    """A block of a lathe. scale : mm per unit, of the block. here, x, z : radius and Z where the tool is, and where they are
    named (else None), in units of the program, absolute.
    """

    def __init__(self, written: Words, state: State) -> None:
        super().__init__(written, state)
        self.x: float | None = None
        self.z: float | None = None
        self.scale = 25.4 if 200 in self.codes else 1.0 if 210 in self.codes else state.scale
        self.here = state.program[0] / self.scale, state.program[2] / self.scale

    @property
    def like(self) -> Word:
        """The word that stands for the block."""
        return self.written[0][0] if self.written else Word("G", 0.0, 1, 0, "")

    def of(self, code: int) -> Word:
        """The word of a G code that is written."""
        return next(w for w, v in self.written if w.letter == "G" and round(v * 10.0) == code)

    def straight(self, code: int, x: float | None, z: float | None, feed: float | None = None) -> None:
        """A straight motion before the block."""
        like = self.like
        out = [(like._replace(letter="G", value=code / 10.0), code / 10.0)]
        given = {"X": x, "Z": z, "F": feed}
        out += [(like._replace(letter=c, value=v), v) for c, v in given.items() if v is not None]
        self.ahead.append(out)


class Cycles(Translator):
    """The cycles of a lathe, and what they leave behind for the blocks after them."""

    def __init__(self, settings: Settings, note: Callable[[Problem], None]) -> None:
        super().__init__(settings, note)
        self.contour: Find = lambda first, last, at, again: None
        self.skipped: Contour = (0, -1)
        """Lines that the last cycle took."""
        self.runs: Contour | None = None
        self.inside = False
        """Of a finishing cycle: the contour that runs after its block; whether one runs."""
        self.lead: float | None = None
        self.once: _Pass | None = None
        self.hole: dict[str, float] = {}

    def leaves_out(self, index: int) -> bool:
        """Whether this line, 0-based, belongs to the contour that the last cycle took."""
        return self.skipped[0] <= index <= self.skipped[1] and not self.inside

    def _threading(self, lead: float | None, b: Turned) -> None:
        """The lead is the feed of a turn for this block; F fills the one register of feeds."""
        state = b.state
        held = self.lead = self.lead if lead is None else lead
        turn = None if held is None else held * b.scale
        b.become(b.before, feed_mode=950, feed=turn)
        feed = state.feed if turn is None or "F" not in b.given else turn
        b.become(b.after, feed_mode=state.feed_mode, feed=feed)

    def _single(self, code: int, b: Turned) -> None:
        """G90, G94, G92: four motions of a pass that ends where it began."""
        old = self.once if not code else None
        feed = b.get("F") if "F" in b.given else old.feed if old else None
        taper = next((b.get(c) for c in "RIK" if c in b.given), old.taper if old else 0.0)
        x = b.x if b.x is not None else old.x if old else b.here[0]
        z = b.z if b.z is not None else old.z if old else b.here[1]
        self.once = _Pass(code or (old.code if old else 900), x, z, taper, feed)
        kind, (x0, z0) = self.once.code, b.here
        if kind == 920:
            self._threading(feed, b)
            feed = None
        if kind == 940:
            b.straight(0, None, z + taper)
            b.straight(10, x, z, feed)
            b.straight(10, None, z0)
            b.straight(0, x0, None)
        else:
            b.straight(0, x + taper, None)
            b.straight(10, x, z, feed)
            b.straight(0 if kind == 920 else 10, x0, None)
            b.straight(0, None, z0)

    def _hole(self, b: Turned) -> None:
        """G83 to G85 along Z, G87 to G89 along X: to the hole, to R, to the depth, back to the initial level."""
        now = next((c for c in b.codes if c in HOLES), 0)
        if now:
            self.hole = {"code": float(now), "level": b.here[1] if HOLES[now] == "Z" else b.here[0]}
        along_z = HOLES[int(self.hole["code"])] == "Z"
        depth, place = (b.z, b.x) if along_z else (b.x, b.z)
        if depth is not None:
            self.hole["depth"] = depth
        if "R" in b.given:
            self.hole["clear"] = b.get("R")
        if "depth" not in self.hole:
            return
        level, deep = self.hole["level"], self.hole["depth"]

        def along(code: int, to: float, f: float | None = None) -> None:
            b.straight(code, None if along_z else to, to if along_z else None, f)

        b.straight(0, place if along_z else None, None if along_z else place)
        if "C" in b.given and "C" in self.settings.rotary:
            b.ahead[-1].append(b.given["C"])
        if len(b.ahead[-1]) == 1:
            b.ahead.pop()
        clear = level + self.hole.get("clear", 0.0)
        along(0, clear)
        along(10, deep, b.get("F") if "F" in b.given else None)
        along(10 if int(self.hole["code"]) in (840, 850, 880, 890) else 0, clear)
        along(0, level)

    def _many(self, code: int, b: Turned, out: Line) -> None:
        """Cycles of many passes: G70 runs the contour, the others are left out; all end where they began."""
        first = b.given.get("P")
        if code:
            if (code not in (740, 750) and not b.has("PXZUW")) or (code == 710 and first is None):
                return  # depth and retract, for the block to come
            what = f"{spell('G', code)} ({MANY[code]}): its passes are left out, the tool comes back to where they began"
            self.say(f"many{code}", b.like, what, "W379")
        if first is None or code in (740, 750, 760):
            return
        lap = code in (850, 860) or 870 in b.codes
        name, last = int(first[1]), None if lap or "Q" not in b.given else int(b.get("Q"))
        found = self.contour(name, last, self.at, not code)
        if self.inside or found is None or (not code and found[0] <= self.at <= found[1]):
            what = "a cycle inside of a contour" if found else f"no block N{name} of a contour"
            out.refuse(first[0], f"{first[0].text}: {what}")
            return
        if code or lap:
            self.skipped = found
        if not code:
            self.runs = found
