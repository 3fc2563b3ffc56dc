"""Pockets, slots, studs and faces that a control mills by itself, as closed passes round their shape.

Manuals give the shape that is left, its allowances, the depth of each cut, the sense and how the tool goes in. Where the
passes between lie is the control's own, and so are its ways from one to the next. Here

1. every level is cleared from the middle outwards, by passes parallel to the wall and one step apart;
2. a step is at most 1.7 tool radii: passes about square corners then leave nothing between them;
3. the last pass runs along the wall, or stays off it by the allowance; finishing enters and leaves it on quarter circles.

So the shape is the control's and the passes are ours, which every use says (W384). Without the radius of the tool there
are no passes: the tool goes in above the middle and out again, which is said as well (W379).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, NamedTuple, Protocol

from vmachining.nc.model import PenError, put
from vmachining.nc.offset_curves import Pair
from vmachining.nc.pen import Pen

MOST: Final = 20_000
WIDEST: Final = 1.7
SAME_MM: Final = 1e-6


class _Ring(NamedTuple):
    """A closed pass: where it begins, and its pieces: end of each, centre of its arc or None, turned left."""

    start: Pair
    pieces: list[tuple[Pair, Pair | None, bool]]
    heading: Pair
    """Unit vector at the start, against the clock."""


class Shape(Protocol):
    """What is milled: passes against the clock, at a distance inside its outline (negative: outside)."""

    @property
    def depth(self) -> float:
        """Largest distance inside: there a pass has shrunk to a line or a point."""

    def ring(self, inset: float) -> _Ring:
        """The pass at that distance."""


class Rounded(NamedTuple):
    """A rectangle with round corners: half lengths, radius of the corners, turn in degrees about the middle."""

    x: float
    y: float
    along: float
    across: float
    corner: float
    turn: float = 0.0

    @property
    def depth(self) -> float:
        """Half of the shorter side."""
        return min(self.along, self.across)

    def place(self, u: float, v: float) -> Pair:
        """From its own axes about the middle."""
        c, s = math.cos(math.radians(self.turn)), math.sin(math.radians(self.turn))
        return self.x + c * u - s * v, self.y + s * u + c * v

    def ring(self, inset: float) -> _Ring:
        """From the middle of the side at +u, against the clock."""
        a, b = max(self.along - inset, 0.0), max(self.across - inset, 0.0)
        c = min(max(self.corner - inset, 0.0), a, b)
        start, at = self.place(a, 0.0), self.place
        pieces: list[tuple[Pair, Pair | None, bool]] = []
        if a - c <= SAME_MM and b - c <= SAME_MM:
            if c > SAME_MM:
                pieces.append((start, at(0.0, 0.0), True))
        else:
            for p, q in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
                flat, round_ = ((p * a, q * (b - c)), (p * (a - c), q * b))[:: p * q]
                pieces.append((at(*flat), None, True))
                if c > SAME_MM:
                    pieces.append((at(*round_), at(p * (a - c), q * (b - c)), True))
            pieces.append((start, None, True))
        c, s = math.cos(math.radians(self.turn)), math.sin(math.radians(self.turn))
        return _Ring(start, pieces, (-s, c))


class ArcSlot(NamedTuple):
    """A slot along an arc: centre and radius of its middle line, half its width, first angle and opening in degrees."""

    x: float
    y: float
    radius: float
    half: float
    first: float
    opening: float

    @property
    def depth(self) -> float:
        """Half of its width."""
        return self.half

    def ring(self, inset: float) -> _Ring:
        """From the outer side at its first end, against the clock."""
        w = max(self.half - inset, 0.0)
        low, high = sorted((self.first, self.first + self.opening))

        def at(radius: float, angle: float) -> Pair:
            turn = math.radians(angle)
            return self.x + radius * math.cos(turn), self.y + radius * math.sin(turn)

        middle, outer, inner = (self.x, self.y), self.radius + w, self.radius - w
        if not 0.0 < high - low <= 360.0:
            raise PenError("E339", "a slot along an arc whose opening is not between 0 and 360 degrees")
        if inner <= 0.0:
            raise PenError("E339", "a slot wider than the circle that it lies on")
        start = at(outer, low)
        pieces: list[tuple[Pair, Pair | None, bool]] = [(at(outer, high), middle, True)]
        if w > SAME_MM:
            pieces += [(at(inner, high), at(self.radius, high), True)]
        pieces += [(at(inner, low), middle, False)]
        if w > SAME_MM:
            pieces += [(start, at(self.radius, low), True)]
        turn = math.radians(low)
        return _Ring(start, pieces, (-math.sin(turn), math.cos(turn)))


class Cut(NamedTuple):
    """How a shape is milled; mm in program coordinates, mm/min, levels along the tool.

    rough, finish : what is done. side, floor : allowances left by roughing. most : deepest cut, shared evenly where
    `even`. finish_most : of finishing, 0 for one cut. step : between passes. plunge : "down", "helix" or "ramp", `way`
    its radius and pitch. climb : with M3. outside : a stud, whose blank reaches `blank` beyond its outline.
    """

    safe: float
    top: float
    bottom: float
    back: float
    feed: float | None
    down: float | None
    most: float
    step: float
    rough: bool = True
    finish: bool = False
    side: float = 0.0
    floor: float = 0.0
    even: bool = False
    finish_most: float = 0.0
    finish_feed: float | None = None
    plunge: str = "down"
    way: Pair = (0.0, 0.0)
    climb: bool = True
    outside: bool = False
    blank: float = 0.0


def levels(top: float, bottom: float, most: float, *, even: bool = False) -> Iterator[float]:
    """Depths below `top`, down to the bottom."""
    sign, total = math.copysign(1.0, top - bottom), abs(top - bottom)
    count = max(1, math.ceil(total / most - SAME_MM)) if most > 0.0 else 1
    if count > MOST:
        raise PenError("E339", f"over {MOST} cuts in one pocket")
    step = total / count if even or most <= 0.0 else most
    for k in range(1, count):
        yield top - sign * step * k
    yield bottom


def stud_blank(finished: Pair, corner: float, blank: Pair) -> float:
    """How far the corners of a rectangular blank lie outside a stud with round corners; half lengths, zero for none."""
    beyond = (max(size - half + corner, 0.0) for size, half in zip(blank, finished, strict=True))
    return max(0.0, math.hypot(*beyond) - corner)


class _Mill:
    """The tool while it mills one shape."""

    def __init__(self, pen: Pen, shape: Shape, cut: Cut, what: str) -> None:
        self.pen, self.shape, self.cut, self.what = pen, shape, cut, what
        self.a, self.b, self.normal = pen.plane.first, pen.plane.second, pen.plane.normal
        self.up = math.copysign(1.0, cut.top - cut.bottom)
        self.ccw = cut.climb != cut.outside if pen.rpm >= 0.0 else cut.climb == cut.outside
        self.radius = 0.0
        self.rapid, self.feeding = pen.rise, pen.feeding

    def over(self, place: Pair) -> None:
        if math.dist(place, (self.pen.at[self.a], self.pen.at[self.b])) > SAME_MM:
            self.pen.go({self.a: place[0], self.b: place[1]}, rapid=True)

    def line(self, place: Pair, level: float | None = None) -> None:
        if level is None and math.dist(place, (self.pen.at[self.a], self.pen.at[self.b])) <= SAME_MM:
            return
        more = {} if level is None else {self.normal: level}
        self.pen.go({self.a: place[0], self.b: place[1], **more}, rapid=False)

    def bend(self, place: Pair, centre: Pair, ccw: bool) -> None:
        self.pen.arc(put(self.pen.at, {self.a: place[0], self.b: place[1]}), centre, ccw=ccw, checked=False)

    def run(self, ring: _Ring) -> None:
        """Once round, from its start and back."""
        pieces, here = ring.pieces, ring.start
        if not self.ccw:
            ends = [ring.start, *(end for end, _, _ in pieces)]
            pieces = [(ends[k], pieces[k][1], not pieces[k][2]) for k in range(len(pieces) - 1, -1, -1)]
        for end, centre, left in pieces:
            if centre is not None:
                self.bend(end, centre, left)
            elif math.dist(here, end) > SAME_MM:
                self.line(end)
            here = end

    # ---- the parts of a cycle ----

    def insets(self, side: float) -> list[float]:
        """Passes from the inside outwards; of a stud from the outside in."""
        step = min(self.cut.step, WIDEST * self.radius) if self.cut.step > 0.0 else self.radius
        if self.cut.outside:  # the outermost pass reaches the rim of the blank
            last = self.radius + side
            count = max(0, math.ceil((self.cut.blank - last - self.radius) / step - SAME_MM))
            first = last + step * count
        else:
            last, first = self.radius + side, self.shape.depth
            if last > first + SAME_MM:
                raise PenError("E354", f"the tool does not fit into {self.what}")
            count = max(0, math.ceil((first - last) / step - SAME_MM))
        if count > MOST:
            raise PenError("E339", f"over {MOST} passes in one pocket")
        sign = -1.0 if self.cut.outside else 1.0
        return [sign * (last + step * k if k < count else first) for k in range(count, -1, -1)]

    def enter(self, ring: _Ring, above: float, level: float) -> None:
        """Into the material at the start of a ring."""
        cut = self.cut
        pitch = cut.way[1] or self.radius
        reach = min(cut.way[0] or self.radius / 2.0, self.shape.depth - self.radius - cut.side)
        turns = abs(above - level) / pitch
        room = reach > 0.01 * self.radius and turns < MOST
        if cut.plunge == "helix" and room and isinstance(self.shape, Rounded):
            middle = (self.shape.x, self.shape.y)
            begin = middle[0] + reach, middle[1]
            with self.feeding(cut.down):
                self.line(begin)
                end = put(self.pen.at, {self.normal: level})
                whole = max(1, math.ceil(turns - SAME_MM))
                self.pen.arc(end, middle, ccw=self.ccw, turns=whole)
                self.bend(begin, middle, self.ccw)
            with self.feeding(cut.feed):
                self.line(ring.start)
            return
        ends = [end for end, _, _ in ring.pieces]
        far = max(ends, key=lambda p: math.dist(p, ring.start), default=ring.start)
        room = math.dist(far, ring.start) > self.radius
        if cut.plunge == "ramp" and room and isinstance(self.shape, Rounded):
            with self.feeding(cut.down):
                self.line(far, (above + level) / 2.0)
                self.line(ring.start, level)
            return
        self.pen.sink(level, cut.down)

    def clear(self, above: float, level: float, side: float) -> None:
        """One level, from where the tool stands at the first ring."""
        rings = [self.shape.ring(inset) for inset in self.insets(side)]
        if self.cut.outside:
            self.pen.sink(level, self.cut.down)
        else:
            self.enter(rings[0], above, level)
        with self.feeding(self.cut.feed):
            for ring in rings:
                self.line(ring.start)
                self.run(ring)

    def begin(self, side: float) -> Pair:
        """Where a level begins: on the first ring, of a stud beside its blank."""
        ring = self.shape.ring(self.insets(side)[0])
        if not self.cut.outside:
            return ring.start
        away = max(self.cut.blank + self.radius + self.insets(side)[0], 0.0) + 2.0
        hx, hy = ring.heading
        return ring.start[0] + hy * away, ring.start[1] - hx * away

    def wall(self, level: float) -> None:
        """Along the wall, on and off it by quarter circles."""
        cut, inset = self.cut, -self.radius if self.cut.outside else self.radius
        ring = self.shape.ring(inset)
        hx, hy = ring.heading if self.ccw else (-ring.heading[0], -ring.heading[1])
        out = (ring.heading[1], -ring.heading[0])  # to the right of a pass against the clock: outwards
        free = 1.0 if cut.outside else -1.0
        size = self.radius if cut.outside else min(self.radius, (self.shape.depth - self.radius) / 2.0)
        centre = ring.start[0] + free * size * out[0], ring.start[1] + free * size * out[1]
        before = centre[0] - size * hx, centre[1] - size * hy
        after = centre[0] + size * hx, centre[1] + size * hy
        left = hx * (centre[1] - ring.start[1]) - hy * (centre[0] - ring.start[0]) > 0.0
        if size <= SAME_MM:
            before = after = ring.start
        self.over(before)
        self.rapid(level + self.up * min(abs(cut.safe - cut.top), abs(cut.safe - level)))
        self.pen.sink(level, cut.down)
        with self.feeding(cut.finish_feed or cut.feed):
            if size > SAME_MM:
                self.bend(ring.start, centre, left)
            self.run(ring)
            if size > SAME_MM:
                self.bend(after, centre, left)

    def knows_radius(self, ours: str) -> bool:
        """Whether there are passes, which is said: ours : what of them the control does not tell."""
        pen = self.pen
        if not pen.has_radius() and pen.settings.tools is None:
            pen.note("W379", f"{self.what}: its passes are left out, the radius of tool {pen.tool} is not known here", "",
                     once="milled without radius", hint="give the tool in the job, or by --tools")  # fmt: skip
            self.rapid(self.cut.safe)
            return False
        self.radius = pen.radius()
        if self.radius <= 0.0:
            raise PenError("E354", f"{self.what} needs a tool with a radius above zero")
        pen.note("W384", f"{self.what}: the {ours} it are ours", "", once="milled")
        return True

    def whole(self) -> None:
        pen, cut = self.pen, self.cut
        if not self.knows_radius("shape is that of the control, the passes that clear"):
            return
        corner = self.shape.corner if isinstance(self.shape, Rounded) and not cut.outside else 0.0
        if 0.0 < corner < min(self.shape.depth, self.radius - SAME_MM):
            text = f"{self.what}: corners of {corner:g} mm keep the radius of the tool, {self.radius:g} mm"
            pen.note("W384", text, "", once=text)
        clearance = abs(cut.safe - cut.top)
        self.rapid(cut.safe)
        if cut.rough:
            floor = cut.bottom + self.up * cut.floor
            start, above = self.begin(cut.side), cut.top
            depths = list(levels(cut.top, floor, cut.most, even=cut.even))
            _limit(len(depths) * len(self.insets(cut.side)), self.what)
            for level in depths:
                self.over(start)
                self.rapid(above + self.up * clearance)
                self.clear(above + self.up * (0.0 if cut.outside else clearance), level, cut.side)
                above = level
                self.rapid(level + self.up * clearance)
            self.rapid(cut.safe)
        if cut.finish and (cut.floor > 0.0 or not (cut.rough or cut.outside)):
            self.over(self.begin(cut.side))
            self.rapid(cut.bottom + self.up * (cut.floor + clearance))
            self.clear(cut.bottom + self.up * (cut.floor + clearance), cut.bottom, cut.side)
            self.rapid(cut.safe)
        if cut.finish and (cut.side > 0.0 or not cut.rough):
            for level in levels(cut.top, cut.bottom, cut.finish_most):
                self.wall(level)
                self.rapid(cut.safe)


def _limit(passes: int, what: str) -> None:
    if passes > MOST:
        raise PenError("E339", f"{what}: over {MOST} passes")


def _possible(pen: Pen, cut: Cut, what: str) -> None:
    if pen.compensation is not None:
        raise PenError("E344", f"{what} while cutter compensation is on")
    up = cut.top - cut.bottom
    if up == 0.0 or (cut.safe - cut.bottom) * up < 0.0 or (cut.back - cut.top) * up < 0.0:
        raise PenError("E333", f"{what}: its planes do not lie above its depth")
    if min(cut.side, cut.floor, cut.most) < 0.0:
        raise PenError("E339", f"{what}: an allowance or a depth of cut below zero")
    if cut.rough and cut.floor >= abs(cut.top - cut.bottom):
        raise PenError("E339", f"{what}: the allowance at the bottom is all of its depth")


def mill(pen: Pen, shape: Shape, cut: Cut, what: str) -> None:
    """A pocket, slot or stud. what : its name in the program.

    Raises PenError: E344, E333, E339, E351, E354, E301
    """
    _possible(pen, cut, what)
    job = _Mill(pen, shape, cut, what)
    job.whole()
    job.rapid(cut.safe)
    if isinstance(shape, Rounded):
        job.over((shape.x, shape.y))
    job.rapid(cut.back)


class Face(NamedTuple):
    """A rectangle that is faced: first corner, sizes with their signs, turn in degrees; beside : overrun of each line."""

    x: float
    y: float
    along: float
    across: float
    turn: float
    beside: float
    to_and_fro: bool


def face(pen: Pen, area: Face, cut: Cut, what: str) -> None:
    """Lines along the first side of a rectangle, one step apart, which reach beyond both ends.

    Raises PenError: E344, E333, E339, E351, E354, E301
    """
    _possible(pen, cut, what)
    shape = Rounded(area.x, area.y, 0.0, 0.0, 0.0, area.turn)
    job, at = _Mill(pen, shape, cut, what), shape.place
    if not job.knows_radius("face is that of the control, the passes that mill"):
        job.rapid(cut.back)
        return
    radius = job.radius
    step = min(cut.step, 2.0 * radius) if cut.step > 0.0 else radius
    width, sign = abs(area.across), math.copysign(1.0, area.across)
    # every line takes a step of the width; the last ends flush with the far side
    count = max(1, math.ceil(width / step - SAME_MM))
    if count > MOST:
        raise PenError("E339", f"over {MOST} passes in one face")
    rows = [sign * (min((k + 1) * step, width) - radius) for k in range(count)]
    way = math.copysign(1.0, area.along)
    near, far = -way * (radius + area.beside), area.along + way * (radius + area.beside)
    job.rapid(cut.safe)
    clearance = abs(cut.safe - cut.top)
    floor = cut.bottom + job.up * (cut.floor if cut.rough else 0.0)
    depths = list(levels(cut.top, floor, cut.most if cut.rough else 0.0, even=cut.even))
    _limit(len(depths) * count, what)
    for level in depths:
        back = False
        for k, row in enumerate(rows):
            begin, end = (far, near) if back else (near, far)
            if k == 0 or not area.to_and_fro:
                job.rapid(level + job.up * clearance if k else cut.safe)
                job.over(at(begin, row))
                pen.sink(level, cut.down)
            with job.feeding(cut.feed):
                if k and area.to_and_fro:
                    job.line(at(begin, row))
                job.line(at(end, row))
            back = area.to_and_fro and not back
        job.rapid(level + job.up * clearance)
    job.rapid(cut.safe)
    job.rapid(cut.back)
