"""The analytic engagement against B-rep solids of parts of our own, per rotation angle: `vmachining bench abs`.

Semi-finish: a staircase of five blocks, a flat and a bull nose cutter. Finish: planes, cylinders, spheres, a saddle and a
wavy surface as solids (free surfaces as splines through the same heights), at the middle and off it; a flat cutter D20 1 mm
deep and a bull nose D20 r5 2 mm deep, lead 10 degrees, tilt 0 and 5. The analytic methods see normals on a grid of 2 mm
(but for "direct", which is told the surface). Lengths of cut above 0.2 mm are compared, in percent, at 19 angles from the
feed. OCCT runs in this process.

| method | is |
|---|---|
| `general rule` | `engaged` on the staircase |
| `direct` | `finished` on the surface itself: error of method and solids |
| `model` | `finished` on the patch around each end: the error of circular profiles |
| `stages 1`, `stages 2`, `stages n` | published stages, flat cutter: one patch, two (to 90 degrees and beyond), one per angle |
| `stations` | published stages, corner: three stations and interpolation of heights as printed |
| `stations plane` | the same with the rule that planes fulfil |
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engagement import By, chip, engaged_parts, frames
from vmachining.engagement.analytic import (
    Corner,
    HeightStock,
    NormalGrid,
    Pass,
    Surface,
    engaged,
    finished,
    staged_lengths,
    station_ends,
)
from vmachining.errors import InputError
from vmachining.sweep import Pose, Stance, Turn
from vmachining.tool import BullNose, Edge, FlatEnd

__all__ = ["PUBLISHED", "SURFACES", "abs", "finish_errors", "semi_finish_errors"]

HALF, DEEP = 40.0, 30.0
"""mm: parts are squares of +-40, 30 deep below their middle."""

PITCH = 2.0
LEAST_MM = 0.2
ANGLES = np.arange(0.0, 181.0, 10.0)
FLAT, BULL = Corner(10.0, 0.0, 40.0), Corner(5.0, 5.0, 35.0)
PUBLISHED = {"flat": (0.13, 3.4, 0.38), "bull": (0.23, 1.7, 0.14, 0.21)}


@dataclass(frozen=True)
class Height:
    """A surface as its height."""

    function: Callable[[Floats, Floats], Floats]

    def height(self, x: ArrayLike, y: ArrayLike) -> Floats:
        """See `Surface`."""
        return np.asarray(self.function(np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)))


def _round(t: Floats, radius: float) -> Floats:
    """Circular profile, R > 0 convex, its top or bottom at 0."""
    return np.asarray(np.sign(radius) * (np.sqrt(radius**2 - np.square(t)) - np.abs(radius)))


SURFACES: dict[str, Height] = {
    "plane": Height(lambda x, y: 0.0 * x + 0.0 * y),
    "slope along 12": Height(lambda x, y: -np.tan(np.radians(12.0)) * x + 0.0 * y),
    "slope across 8": Height(lambda x, y: np.tan(np.radians(8.0)) * y + 0.0 * x),
    "cylinder R100": Height(lambda x, y: _round(x, 100.0) + 0.0 * y),
    "hollow R100": Height(lambda x, y: _round(x, -100.0) + 0.0 * y),
    "sphere R100": Height(lambda x, y: np.sqrt(1e4 - x * x - y * y) - 100.0),
    "bowl R100": Height(lambda x, y: 100.0 - np.sqrt(1e4 - x * x - y * y)),
    "saddle 100/120": Height(lambda x, y: _round(x, 100.0) + _round(y, -120.0)),
    "wavy A4 L90": Height(lambda x, y: 4.0 * np.sin(2.0 * np.pi * x / 90.0) * np.cos(2.0 * np.pi * y / 90.0)),
}
PLACES = ((0.0, 0.0), (12.0, 8.0))


def abs() -> Iterator[dict[str, Any]]:
    """One record per part, place, cutter, tilt and method, and their sum per part, cutter and method."""
    yield from semi_finish_errors()
    for name in SURFACES:
        worst: dict[tuple[str, str], list[tuple[float, float]]] = {}
        for row in finish_errors(name, PLACES):
            yield row
            kept = row["max_percent"], row["mean_percent"]
            worst.setdefault((row["tool"], row["method"]), []).append(kept)
        for (tool, method), rows in worst.items():
            most, mean = np.array(rows).T
            yield {
                "case": "abs", "part": name, "tool": tool, "method": method, "summary": True,
                "max_percent": float(most.max()), "mean_percent": float(mean.mean()),
            }  # fmt: skip


def finish_errors(
    name: str, places: Sequence[tuple[float, float]], *, tilts: Sequence[float] = (0.0, 5.0)
) -> Iterator[dict[str, Any]]:
    """One record per place, cutter, tilt and method on one of `SURFACES`; tilts in degrees, places in mm."""
    surface = SURFACES[name]
    solid = _solid(name, surface)
    for place in places:
        for tool, corner, depth in (("flat", FLAT, 1.0), ("bull", BULL, 2.0)):
            for tilt in tilts:
                base = {"case": "abs", "part": name, "at_mm": list(place), "tool": tool, "tilt_deg": tilt}
                for row in _finish(surface, solid, place, corner, depth, tilt):
                    yield base | row | {"published_percent": PUBLISHED[tool]}


def semi_finish_errors() -> Iterator[dict[str, Any]]:
    """The general rule against boxes side by side."""
    breaks, tops = (-40.0, -7.0, -1.5, 4.0, 8.5, 40.0), (2.0, 3.2, 1.1, 4.4, 2.6)
    stairs = HeightStock.staircase(breaks, tops, y=(-HALF, HALF), floor=-DEEP)
    blocks = [
        (np.array([a, -HALF, -DEEP]), np.array([b, HALF, h]))
        for a, b, h in zip(breaks, breaks[1:], tops, strict=False)
    ]
    solid = _members(lambda cq: [cq.Solid.makeBox(*(hi - lo), pnt=cq.Vector(*lo)) for lo, hi in blocks])
    for tool, corner in (("flat", FLAT), ("bull", BULL)):
        m = frames.rotation(np.radians(3.0), np.radians(10.0))
        tip, velocity = np.array([-2.0, 1.0, 0.3]), np.array([1.0, 0.1, 0.0])
        phi = np.radians(ANGLES) - frames.feed_angle(velocity, m)
        truth = _brep(solid, corner, tip, m, velocity, phi)
        found = engaged(corner, stairs, tip, m, phi, velocity, bottom=False)
        yield {"case": "abs", "part": "staircase", "tool": tool} | _errors(
            "general rule", found.cut_length[0], truth
        )


def _finish(
    surface: Height, solid: Any, place: tuple[float, float], corner: Corner, depth: float, tilt: float
) -> Iterator[dict[str, Any]]:
    grid = NormalGrid.sampled(surface, *(np.arange(-HALF, HALF + 1.0, PITCH),) * 2)
    tip, m, velocity = _contact(surface, place, corner, depth, tilt)
    phi = np.radians(ANGLES) - frames.feed_angle(velocity, m)
    walls: dict[str, Any] = {"x": (-HALF, HALF), "y": (-HALF, HALF), "bottom": False}

    def direct(on: Surface, at: Floats = phi) -> Pass:
        return finished(corner, on, tip, m, at, velocity, **walls)

    truth = _brep(solid, corner, tip, m, velocity, phi)
    exact = direct(surface)
    yield _errors("direct", exact.cut_length[0], truth)
    lower = np.array(
        [
            chip.facing_range(*chip.corner_speeds(v, corner.rm, corner.r)).lower
            for v in _speeds(m, velocity, phi)
        ]
    )
    start = corner.r * lower
    ends = exact.points(upper=True)[0]
    model = np.zeros(len(phi))
    for k in range(len(phi)):
        real = ends[k][~np.isnan(ends[k][:, 0])]
        near = grid.patch(*(real[-1] if len(real) else tip)[:2])
        model[k] = _safely(lambda: direct(near, phi[k : k + 1]).cut_length[0, 0])  # noqa: B023 called at once
    yield _errors("model", model, truth)
    if corner.r > 0.0:
        patch = grid.patch(*place)
        # the published angles are those of the tool frame, 0 to 180 degrees
        turned = np.mod(phi, 2.0 * np.pi)
        for name, rule in (("stations", "published"), ("stations plane", "plane")):
            found = np.full(len(phi), np.nan)
            with suppress(InputError):
                found = station_ends(patch, corner, tip, m, turned, rule=rule) - start
            found[turned > np.pi] = np.nan
            yield _errors(name, found, truth)
        return
    contact = np.array([*place, 0.0])
    for patches in (1, 2, None):
        found = staged_lengths(grid, corner, contact, tip, m, phi, velocity, patches=patches)
        yield _errors(f"stages {patches or 'n'}", found, truth)


def _speeds(m: Floats, velocity: Floats, phi: Floats) -> list[chip.Speeds]:
    return [chip.edge_speeds(velocity, m, p) for p in phi]


def _safely(f: Callable[[], Any]) -> float:
    """NaN where the model does not reach."""
    try:
        return float(f())
    except InputError:
        return float("nan")


def _errors(method: str, found: Floats, truth: Floats) -> dict[str, Any]:
    """Percent of the length where it is above `LEAST_MM`; None for an angle without a comparison."""
    long = truth > LEAST_MM
    with np.errstate(invalid="ignore", divide="ignore"):
        percent = np.where(long, 100.0 * np.abs(found - truth) / truth, np.nan)
    known = percent[np.isfinite(percent)]
    return {
        "method": method, "angles": int(long.sum()), "answered": len(known),
        "max_percent": float(known.max(initial=0.0)), "mean_percent": float(known.mean()) if len(known) else 0.0,
        "per_angle_percent": [None if np.isnan(v) else round(float(v), 9) for v in percent],
    }  # fmt: skip


def _contact(
    surface: Height, place: tuple[float, float], corner: Corner, depth: float, tilt: float
) -> tuple[Floats, Floats, Floats]:
    """Tip, frame and feed with the contact `depth` below the surface along its normal."""
    x, y = place
    h = 1e-4
    slope = [
        float((surface.height(x + a, y + b) - surface.height(x - a, y - b)) / (2 * h))
        for a, b in ((h, 0.0), (0.0, h))
    ]
    n = frames.unit([-slope[0], -slope[1], 1.0])
    t = frames.feed_direction((1.0, 0.0, 0.0), n)
    axis = frames.axis_of_lean(np.radians(10.0), np.radians(tilt), t, n)
    contact = np.array([x, y, float(surface.height(x, y))]) - depth * n
    return frames.tip_of_contact(contact, n, axis, corner.rm, corner.r, toward=t), frames.frame_of(axis), t


def _brep(solid: Any, corner: Corner, tip: Floats, m: Floats, velocity: Floats, phi: Floats) -> Floats:
    """Lengths of cut by OCCT."""
    axis = m[:, 2]
    path = Turn.great_circle(Pose(tip - 0.5 * velocity, axis), Pose(tip + 0.5 * velocity, axis))
    length = corner.r + corner.flute
    tool = (
        FlatEnd(diameter=2 * corner.radius, length=length)
        if corner.r == 0.0
        else BullNose(diameter=2 * corner.radius, corner_radius=corner.r, length=length)
    )
    parts = engaged_parts(Edge(tool), Stance.on(path, 0.5), phi, solid)
    out = np.zeros(len(phi))
    np.add.at(out, parts.row, parts.upper - parts.lower)
    return out


# -- parts as solids -----------------------------------------------------------------------------------------


def _members(make: Callable[[Any], list[Any]]) -> Any:
    """Solids that the B-rep engine asks; through a STEP file, as a stock comes."""
    import cadquery as cq

    from vmachining.engines.brep import Blank
    from vmachining.engines.brep.workpiece.members import Members

    with TemporaryDirectory() as folder:
        file = Path(folder) / "part.step"
        cq.exporters.export(cq.Workplane().newObject([cq.Compound.makeCompound(make(cq))]), str(file))
        return Members(Blank("step", file=str(file)), [], By.STOCK)


def _solid(name: str, surface: Height) -> Any:
    box = HALF, DEEP

    def make(cq: Any) -> list[Any]:
        half, deep = box
        block = cq.Solid.makeBox(2 * half, 2 * half, deep + 25.0, pnt=cq.Vector(-half, -half, -deep))
        kind, _, _ = name.partition(" ")
        if kind in ("plane", "slope"):
            top = cq.Solid.makeBox(400.0, 400.0, 200.0, pnt=cq.Vector(-200.0, -200.0, 0.0))
            z = cq.Vector(0, 0, 0)
            if "along" in name:
                top = top.rotate(z, cq.Vector(0, 1, 0), 12.0)
            if "across" in name:
                top = top.rotate(z, cq.Vector(1, 0, 0), 8.0)
            return [block.cut(top)]
        if kind in ("cylinder", "hollow"):
            height = -100.0 if kind == "cylinder" else 100.0
            rod = cq.Solid.makeCylinder(100.0, 400.0, cq.Vector(0, -200.0, height), cq.Vector(0, 1, 0))
            return [block.intersect(rod) if kind == "cylinder" else block.cut(rod)]
        if kind in ("sphere", "bowl"):
            height = -100.0 if kind == "sphere" else 100.0
            ball = cq.Solid.makeSphere(100.0, cq.Vector(0, 0, height), angleDegrees1=-90, angleDegrees2=90)
            return [block.intersect(ball) if kind == "sphere" else block.cut(ball)]
        t = np.linspace(-half, half, 41)
        points = [[cq.Vector(x, y, float(surface.height(x, y))) for y in t] for x in t]
        face = cq.Face.makeSplineApprox(points, tol=1e-6, smoothing=None, minDeg=3, maxDeg=8)
        return [cq.Solid.extrudeLinear(face, cq.Vector(0, 0, -deep))]

    return _members(make)
