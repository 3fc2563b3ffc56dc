"""Random tools, motions, programs of motions and directions: the one place that invents them for Hypothesis.

What belongs to one language only (NC words, forces, pockets) is invented beside its tests.
"""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from vmachining.errors import ToolError
from vmachining.geometry import Arc, Line, unit
from vmachining.sweep import Turn
from vmachining.tool import BallNose, BullNose, FlatEnd, Profile, Taper

__all__ = ["angles", "coordinates", "directions", "paths", "programs", "stacks", "tools", "turns"]


def angles(size: float = 20) -> st.SearchStrategy[float]:
    """rad, some turns either way."""
    return st.floats(-size, size)


def directions() -> st.SearchStrategy[np.ndarray]:
    """(3,) unit."""
    number = st.floats(-1, 1)
    return st.tuples(number, number, number).filter(lambda v: np.linalg.norm(v) > 1e-3).map(unit)


@st.composite
def tools(draw: st.DrawFn) -> Profile:
    """Any kind of cutter, 1 to 30 mm wide."""
    diameter, length = draw(st.floats(1, 30)), draw(st.floats(31, 60))
    kind = draw(st.sampled_from(["flat", "ball", "bull", "taper", "stepped"]))
    share = draw(st.floats(0.05, 0.95))
    if kind == "flat":
        return FlatEnd(diameter=diameter, length=length).profile
    if kind == "ball":
        return BallNose(diameter=diameter, length=length).profile
    if kind == "bull":
        return BullNose(diameter=diameter, corner_radius=share * diameter / 2, length=length).profile
    if kind == "taper":
        corner = share * diameter / 2
        return Taper(diameter=diameter, corner_radius=corner, taper_deg=20 * share, length=length).profile
    r = diameter / 2
    return Profile([(r, 0), (r, 10), ((1 + share) * r, 10), (share * r, 20), (r, length)])


def coordinates(size: float = 60) -> st.SearchStrategy[tuple[float, float, float]]:
    number = st.floats(-size, size).map(lambda v: round(v, 3))
    return st.tuples(number, number, number)


@st.composite
def paths(draw: st.DrawFn) -> Line | Arc:
    """Lines in any direction, arcs and helices about every axis."""
    if draw(st.booleans()):
        return Line(draw(coordinates()), draw(coordinates()))
    start, centre = draw(coordinates(30)), draw(coordinates(30))
    axis = draw(st.sampled_from([0, 1, 2]))
    rise = draw(st.one_of(st.just(0.0), st.floats(-15, 15)))
    return Arc(start, centre, axis, angle=draw(st.floats(-8, 8)), rise=rise)


@st.composite
def turns(draw: st.DrawFn) -> Turn:
    """Great circles and rotary chains, tiny to huge, with any control point."""
    size = draw(st.sampled_from([0.1, 1.0, 60.0]))
    a, b = np.array(draw(coordinates(size))), np.array(draw(coordinates(size)))
    angle = st.floats(-3, 3).map(lambda v: round(v, 4))
    first = np.array(draw(st.tuples(angle, angle)))
    last = first + draw(st.sampled_from([0.0, 1e-6, 0.02, 1.0])) * np.array(draw(st.tuples(angle, angle))) / 3
    height = draw(st.sampled_from([0.0, 5.0, 25.0, 80.0]))
    chain = draw(st.sampled_from(["ac", "bc", "ab", "axis"]))
    if chain == "axis":
        first, last = _tilted(*first), _tilted(*last)
        if first @ last < -0.999:
            last = first
    return Turn.through(a, b, chain, first, last, control_height=height)


def _tilted(a: float, c: float) -> np.ndarray:
    """Axis Rz(c) Rx(a) ez."""
    return np.array([np.sin(c) * np.sin(a), -np.cos(c) * np.sin(a), np.cos(a)])


@st.composite
def programs(draw: st.DrawFn, count: int) -> list[Line | Arc]:
    """Motions one after the other about a stock from (0, 0, -10) to (24, 18, 0): passes, ramps, plunges, arcs, jumps between."""

    def number(low: float, high: float) -> float:
        return draw(st.floats(low, high, allow_nan=False))

    kinds = st.sampled_from(["pass", "pass", "ramp", "plunge", "jump", "arc", "helix", "upright arc"])
    at = np.array([number(-2, 26), number(-2, 20), number(-3, 1)])
    out: list[Line | Arc] = []
    for _ in range(count):
        kind, angle = draw(kinds), number(-3.0, 3.0)
        if kind == "plunge":
            out.append(Line(at, at + [0.0, 0.0, number(-3, 3)]))
        elif kind in ("arc", "helix"):
            radius = draw(st.sampled_from([1.0, 3.0, 8.0]))
            centre = at + radius * np.array([np.cos(angle), np.sin(angle), 0.0])
            out.append(Arc(at, centre, angle=angle, rise=0.0 if kind == "arc" else number(-2, 2)))
        elif kind == "upright arc":
            out.append(Arc(at, at + [2.0, 0.0, 1.0], angle=0.3 * angle, axis=1))
        else:
            rise = 0.0 if kind == "pass" else number(-2, 2)
            out.append(Line(at, at + [number(-14, 14), number(-14, 14), rise]))
        at = out[-1].position(1.0)
        if kind == "jump":
            at = np.array([number(-2, 26), number(-2, 20), number(-5, 1)])
    return out


def stacks() -> st.SearchStrategy[Profile]:
    """Polylines with steps, necks and cones."""
    row = st.tuples(st.floats(0.1, 20), st.one_of(st.just(0.0), st.floats(0.01, 10)))

    def build(parts: list[tuple[float, float]]) -> Profile | None:
        heights = np.cumsum([h for _, h in parts])
        try:
            return Profile([(r, z) for (r, _), z in zip(parts, heights, strict=True)])
        except ToolError:
            return None

    return st.lists(row, min_size=2, max_size=7).map(build).filter(lambda p: p is not None)  # type: ignore[arg-type]
