"""Writes pass.csv and stock.stl: a sculptured surface finished by one pass in five axes; and the seven published finish tests.

See `benchmarks.modelfiles` for how to call it; `make.py --table` takes 20 s.

Cutters, lead, speed and feed are those of the published tests of the analytic method for finishing (chapter 6: flat D20 and
D12, bull nose D20 r5, lead 10 and 15 degrees, 5000 rev/min, 0.3 mm a tooth, 40 contact points). Their parts were not
published. These are ours, of the shapes that the text names.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.modelfiles import write_model
from vmachining.arrays import Floats
from vmachining.engagement import chip, frames
from vmachining.engagement.analytic import (
    Corner,
    NormalGrid,
    Pass,
    Poses,
    Records,
    finished,
    staged_lengths,
    station_ends,
)
from vmachining.errors import InputError
from vmachining.toolpath.clpath import CLPath, Mark, pose_table
from vmachining.toolpath.facets import FacetMesh

LONG, HALF, BOTTOM = 80.0, 20.0, -30.0  # mm: the part over 0 <= x <= LONG, |y| <= HALF
CONTACTS, TEETH, REV_MIN, PER_TOOTH = 40, 2, 5000.0, 0.3
FEED = PER_TOOTH * TEETH * REV_MIN  # mm/min
PITCH = 2.0  # mm between normals that the method knows
CELL = 1.0  # mm, triangles of the stock
LEAST = 0.2  # mm: shorter cuts are not compared in percent
ANGLES = np.arange(0.0, 181.0, 10.0)  # degrees from the feed
SHOWN = "flat 2"  # the one that job.toml cuts
WALLS = {"x": (0.0, LONG), "y": (-HALF, HALF), "bottom": False}


@dataclass(frozen=True)
class Height:
    """A surface as its height; it continues beyond the part."""

    function: Callable[[Floats, Floats], Floats]

    def height(self, x: ArrayLike, y: ArrayLike) -> Floats:
        """See `Surface`."""
        both = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64))
        return np.asarray(self.function(*both))


class Test(NamedTuple):
    """A published test: cutter, depth along the normal in mm, lead in degrees, surface, published percent, patches."""

    corner: Corner
    depth: float
    lead: float
    surface: Height
    published: float
    patches: int = 1


def wave(t: Floats, height: float, long: float) -> Floats:
    return np.asarray(height * np.sin(2.0 * np.pi * t / long))


def arc(t: Floats, radius: float) -> Floats:
    """Sagitta of a circle, 0 where t <= 0."""
    return np.asarray(radius - np.sqrt(radius**2 - np.clip(t, 0.0, 0.9 * radius) ** 2))


FLAT20, FLAT12, BULL = Corner(10.0, 0.0, 40.0), Corner(6.0, 0.0, 40.0), Corner(5.0, 5.0, 35.0)
TESTS = {
    "flat 1": Test(FLAT20, 1.0, 10.0, Height(lambda x, y: wave(x, 3.0, 120.0) + 0.0 * y), 0.13),
    "flat 2": Test(FLAT20, 1.0, 15.0, Height(lambda x, y: wave(x, 3.0, 120.0) + wave(y + 9.0, 2.0, 100.0)), 3.4),
    "flat 3": Test(
        FLAT12, 1.0, 10.0, Height(lambda x, y: wave(x, 2.0, 80.0) * np.cos(2.0 * np.pi * y / 110.0)), 0.38, 2
    ),
    "bull 1": Test(BULL, 1.0, 0.0, Height(lambda x, y: -arc(40.0 - x, 150.0) + 0.0 * y), 0.23),
    "bull 2": Test(BULL, 1.0, 0.0, Height(lambda x, y: wave(x, 2.5, 100.0) + wave(y, 1.5, 90.0)), 1.7),
    "bull 3": Test(
        BULL, 7.0, 0.0, Height(lambda x, y: -np.tan(np.radians(8.0)) * np.clip(x - 30.0, 0.0, None) + 0.0 * y), 0.14
    ),
    "bull 4": Test(BULL, 1.0, 10.0, Height(lambda x, y: arc(40.0 - x, 120.0) + 0.0 * y), 0.21),
}  # fmt: skip


@cache
def tips(name: str) -> tuple[Floats, Floats]:
    """(40, 3) tips and axes: contact points `depth` below the surface along its normal, along y = 0."""
    test = TESTS[name]
    at, h = np.linspace(1.0, LONG - 1.0, CONTACTS), 1e-4
    out = []
    for x in at.tolist():
        slope = [
            float(np.subtract(*test.surface.height([x + a, x - a], [b, -b])) / (2.0 * h))
            for a, b in ((h, 0.0), (0.0, h))
        ]
        n = frames.unit([-slope[0], -slope[1], 1.0])
        t = frames.feed_direction((1.0, 0.0, 0.0), n)
        axis = frames.axis_of_lean(np.radians(test.lead), 0.0, t, n)
        contact = np.array([x, 0.0, float(test.surface.height(x, 0.0))]) - test.depth * n
        out.append((frames.tip_of_contact(contact, n, axis, test.corner.rm, test.corner.r, toward=t), axis))
    tip, axis = (np.array(v) for v in zip(*out, strict=True))
    return tip, axis


def place(name: str, k: float) -> Poses:
    """The tool `k` records along the pass, of the numbers as written."""
    tip, axis = tips(name)
    return Records.of_axes(np.round(tip, 5), np.round(axis, 9)).at([k], feed_mm_min=FEED)


def exact(name: str, k: float, angles: Floats = ANGLES) -> Pass:
    """The engagement on the surface itself, at angles from the feed in degrees."""
    test, where = TESTS[name], place(name, k)
    phi = np.radians(angles) - frames.feed_angle(where.velocity[0], where.frame[0])
    return finished(
        test.corner, test.surface, where.tip, where.frame, phi, where.velocity, axis_rate=where.axis_rate, **WALLS
    )  # fmt: skip


def lengths(name: str, k: float) -> dict[str, Floats]:
    """mm at `ANGLES`: "exact"; "stages" as published; "model" exact on the profiles around each end; NaN: no answer."""
    test, where = TESTS[name], place(name, k)
    corner, tip, m, v = test.corner, where.tip[0], where.frame[0], where.velocity[0]
    phi = np.radians(ANGLES) - frames.feed_angle(v, m)
    grid = normals(name)
    on_surface = exact(name, k)
    ends = on_surface.points(upper=True)[0]
    model = np.full(len(phi), np.nan)
    for i in range(len(phi)):
        real = ends[i][~np.isnan(ends[i][:, 0])]
        if len(real):
            try:
                model[i] = finished(
                    corner, grid.patch(*real[-1][:2]), tip, m, phi[i : i + 1], v, axis_rate=where.axis_rate, **WALLS
                ).cut_length[0, 0]  # fmt: skip
            except InputError:  # a circular profile that ends: no answer
                continue
    contact = np.array([1.0 + (LONG - 2.0) / (CONTACTS - 1) * k, 0.0, 0.0])
    if corner.r == 0.0:
        stages = staged_lengths(grid, corner, contact, tip, m, phi, v, patches=test.patches)
    else:
        speeds = [chip.edge_speeds(v, m, p, axis_rate=where.axis_rate[0]) for p in phi]
        low = np.array([chip.facing_range(*chip.corner_speeds(s, corner.rm, corner.r)).lower for s in speeds])
        turned = np.mod(phi, 2.0 * np.pi)
        stages = np.full(len(phi), np.nan)
        with suppress(InputError):
            stages = station_ends(grid.patch(*contact[:2]), corner, tip, m, turned) - corner.r * low
        stages[turned > np.pi] = np.nan
    out = on_surface.cut_length[0]
    # an end on a wall is found by planes in every method: nothing to compare
    last = np.array([e[~np.isnan(e[:, 0])][-1] if (~np.isnan(e[:, 0])).any() else [np.nan] * 3 for e in ends])
    inside = (last[:, 0] > 1e-6) & (last[:, 0] < LONG - 1e-6) & (np.abs(last[:, 1]) < HALF - 1e-6)
    return {
        "exact": out,
        "stages": np.where(inside, stages, np.nan),
        "model": np.where(inside, model, np.nan),
    }


@cache
def normals(name: str) -> NormalGrid:
    """Of the surface, `PITCH` apart."""
    return NormalGrid.sampled(
        TESTS[name].surface, np.arange(-PITCH, LONG + 2 * PITCH, PITCH), np.arange(-HALF, HALF + PITCH, PITCH)
    )


def errors(name: str, every: int = 3) -> dict[str, Floats]:
    """(places,) percent along the pass, largest over the angles: of "stages", of "model", and of stages straight ahead."""
    out: dict[str, list[float]] = {"stages": [], "ahead": [], "model": []}
    for k in range(0, CONTACTS, every):
        found = lengths(name, float(k))
        for method, kept in out.items():
            with np.errstate(invalid="ignore", divide="ignore"):
                answer = found["stages" if method == "ahead" else method]
                percent = 100.0 * np.abs(answer / found["exact"] - 1.0)
            asked = (found["exact"] > LEAST) & ((ANGLES == 90.0) | (method != "ahead"))
            percent = percent[asked & np.isfinite(percent)]
            kept.append(float(percent.max()) if len(percent) else np.nan)
    return {method: np.array(kept) for method, kept in out.items()}


def program() -> str:
    """The text of pass.csv: down at the first contact point, the pass of `SHOWN`, and up."""
    tip, axis = tips(SHOWN)
    piece = CLPath(tip, axis, np.zeros(CONTACTS, np.bool_), np.full(CONTACTS, int(Mark.CONTACT), np.int64))
    return pose_table(CLPath.joined([piece], clear_mm=40.0), feed_mm_min=FEED)


def stock() -> FacetMesh:
    """The part under the surface of `SHOWN` as triangles, on cells of `CELL`."""
    x, y = np.arange(0.0, LONG + CELL, CELL), np.arange(-HALF, HALF + CELL, CELL)
    n, m = len(x), len(y)
    top = TESTS[SHOWN].surface.height(x[:, None], y)
    grid = np.stack([*np.broadcast_arrays(x[:, None], y), top.astype(np.float32).astype(np.float64)], axis=-1)
    corners = np.array([[a, b, BOTTOM] for a, b in ((0, -HALF), (LONG, -HALF), (LONG, HALF), (0, HALF))])
    index = np.arange(n * m).reshape(n, m)
    a, b, c, d = (v.ravel() for v in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    base = n * m
    rims = (index[:, 0], index[-1, :], index[::-1, -1], index[0, ::-1])
    for side, rim in enumerate(rims):  # a fan from one lower corner, closed by the other
        low, high = base + side, base + (side + 1) % 4
        faces.append(np.stack([rim[:-1], np.full(len(rim) - 1, low), rim[1:]], axis=1))
        faces.append(np.array([[rim[-1], low, high]]))
    faces.append(base + np.array([[0, 2, 1], [0, 3, 2]]))
    return FacetMesh(np.concatenate([grid.reshape(-1, 3), corners]), np.concatenate(faces))


def table() -> str:
    """The known truths: percent over the places of a pass."""
    lines = []
    for name, test in TESTS.items():
        found = errors(name)
        told = ", ".join(
            f"{method} {np.nanmax(v):.2g} % (median {np.nanmedian(v):.2g} %)" for method, v in found.items()
        )
        lines.append(f"{name}: {told}, published {test.published:g} %")
    return "\n".join(lines)


if __name__ == "__main__":
    write_model(__file__, lambda: {"pass.csv": program(), "stock.stl": stock()}, table)
