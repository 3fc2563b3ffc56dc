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

from vmachining.nc.block import Problem
from vmachining.nc.codes import spell
from vmachining.nc.fanuc import Translator
from vmachining.nc.fanuc_line import Line
from vmachining.nc.lexer import Word
from vmachining.nc.settings import Settings
from vmachining.nc.state import State

Words = list[tuple[Word, float]]
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

    @staticmethod
    def _straight(
        code: int, x: float | None, z: float | None, like: Word, feed: float | None = None
    ) -> Words:
        out = [(like._replace(letter="G", value=code / 10.0), code / 10.0)]
        for letter, value in (("X", x), ("Z", z), ("F", feed)):
            if value is not None:
                out.append((like._replace(letter=letter, value=value), value))
        return out

    def _threading(
        self, lead: float | None, scale: float, before: list[Callable[[State], None]],
        after: list[Callable[[State], None]], state: State, *, modal: bool,
    ) -> None:  # fmt: skip
        """The lead is the feed of a turn for this block; modal : an F, which fills the one register of feeds."""
        mode = state.feed_mode
        held = self.lead = self.lead if lead is None else lead
        feed = held * scale if modal and held is not None else state.feed

        def turn(s: State) -> None:
            s.feed_mode, s.feed = 950, None if held is None else held * scale

        def back(s: State) -> None:
            s.feed_mode, s.feed = mode, feed

        before.append(turn)
        after.append(back)

    def _single(
        self, code: int, has: dict[str, tuple[Word, float]], here: tuple[float, float], x: float | None, z: float | None,
        like: Word, before: list[Callable[[State], None]], after: list[Callable[[State], None]], scale: float, state: State,
    ) -> list[Words]:  # fmt: skip
        """G90, G94, G92: four motions of a pass that ends where it began."""
        old = self.once
        feed = has["F"][1] if "F" in has else old.feed if old is not None and not code else None
        taper = next(
            (has[k][1] for k in "RIK" if k in has), old.taper if old is not None and not code else 0.0
        )
        keep = old if old is not None and not code else None
        goal_x = x if x is not None else keep.x if keep else here[0]
        goal_z = z if z is not None else keep.z if keep else here[1]
        now = self.once = _Pass(code or (old.code if old else 900), goal_x, goal_z, taper, feed)
        if now.code == 940:
            return [
                self._straight(0, None, goal_z + taper, like), self._straight(10, goal_x, goal_z, like, feed),
                self._straight(10, None, here[1], like), self._straight(0, here[0], None, like),
            ]  # fmt: skip
        if now.code == 920:
            self._threading(feed, scale, before, after, state, modal="F" in has)
            return [
                self._straight(0, goal_x + taper, None, like), self._straight(10, goal_x, goal_z, like),
                self._straight(0, here[0], None, like), self._straight(0, None, here[1], like),
            ]  # fmt: skip
        return [
            self._straight(0, goal_x + taper, None, like), self._straight(10, goal_x, goal_z, like, feed),
            self._straight(10, here[0], None, like), self._straight(0, None, here[1], like),
        ]  # fmt: skip

    def _hole(
        self, codes: set[int], has: dict[str, tuple[Word, float]], here: tuple[float, float], x: float | None,
        z: float | None, like: Word,
    ) -> list[Words]:  # fmt: skip
        """G83 to G85 along Z, G87 to G89 along X: to the hole, to R, to the depth, back to the initial level."""
        now = next((c for c in codes if c in HOLES), 0)
        if now:
            self.hole = {"code": float(now), "level": here[1] if HOLES[now] == "Z" else here[0]}
        axis = HOLES[int(self.hole["code"])]
        depth, place = (z, x) if axis == "Z" else (x, z)
        if depth is not None:
            self.hole["depth"] = depth
        if "R" in has:
            self.hole["clear"] = has["R"][1]
        if "depth" not in self.hole:
            return []
        level, deep = self.hole["level"], self.hole["depth"]
        feed = has["F"][1] if "F" in has else None

        def along(code: int, to: float, f: float | None = None) -> Words:
            return self._straight(code, None if axis == "Z" else to, to if axis == "Z" else None, like, f)

        first = self._straight(0, place if axis == "Z" else None, None if axis == "Z" else place, like)
        first += [(w, v) for w, v in has.values() if w.letter == "C" and "C" in self.settings.rotary]
        out = [first] if len(first) > 1 else []
        clear = level + self.hole.get("clear", 0.0)
        slow = int(self.hole["code"]) in (840, 850, 880, 890)
        return [
            *out,
            along(0, clear),
            along(10, deep, feed),
            along(10 if slow else 0, clear),
            along(0, level),
        ]

    def _many(
        self, code: int, codes: set[int], has: dict[str, tuple[Word, float]], like: Word, out: Line
    ) -> None:
        """Cycles of many passes: G70 runs the contour, the others are left out; all end where they began."""
        if code:
            if code not in (740, 750) and not {"P", "X", "Z", "U", "W"} & set(has):
                return
            if code == 710 and "P" not in has:
                return  # depth and retract, for the block to come
            what = f"{spell('G', code)} ({MANY[code]}): its passes are left out, the tool comes back to where they began"
            self.say(f"many{code}", like, what, "W379")
        first = has.get("P")
        if first is None or code in (740, 750, 760):
            return
        lap = code in (850, 860) or 870 in codes
        last = None if lap else int(has["Q"][1]) if "Q" in has else None
        name = int(first[1])
        found = self.contour(name, last, self.at, not code)
        if self.inside or found is None or (not code and found[0] <= self.at <= found[1]):
            what = "a cycle inside of a contour" if found else f"no block N{name} of a contour"
            out.refuse(first[0], f"{first[0].text}: {what}")
            return
        if code or lap:
            self.skipped = found
        if not code:
            self.runs = found
