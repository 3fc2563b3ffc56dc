"""Solids of random wide turns: axes that turn by 20 to 60 degrees while the tip moves by 50 to 100 mm, six of each kind.

    python -m benchmarks.wide_turns [SECONDS]

prints one line for each: solids and faces, what they may miss, at how many points they agree with exact distances, seconds of
processor until then and with a STEP file that reads back the same; or why there are none. Two motions known to be hard
follow: turns about a point of the cutter.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np

from benchmarks.turned_blocks import tilted, unit
from vmachining.engines import brep
from vmachining.engines.brep.occt.booleans import quiet
from vmachining.engines.brep.write import Described
from vmachining.errors import EngineError, SweepError
from vmachining.job.single import SWEEP_SECONDS, WIDE_MISS_MM
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd, Taper

KINDS = ("ball", "bull", "flat", "cone")
SEEDS = 6


def motion(kind: str, seed: int) -> Sweep:
    """One of them: axes lean by up to 40 degrees at first."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    d = float(rng.uniform(10.0, 30.0))
    tool: Cutter = {
        "ball": BallNose(diameter=d, length=50),
        "bull": BullNose(diameter=d, corner_radius=d * float(rng.uniform(0.1, 0.35)), length=50),
        "flat": FlatEnd(diameter=d, length=50),
        "cone": Taper(diameter=0.3 * d, taper_deg=10, length=40),
    }[kind]
    axis = tilted(np.array([0.0, 0.0, 1.0]), rng, rng.uniform(0.0, 40.0))
    way = unit(rng.normal(size=3) * [1.0, 1.0, 0.2]) * rng.uniform(50.0, 100.0)
    last = tilted(axis, rng, rng.uniform(20.0, 60.0))
    return Sweep.along(tool, Turn.great_circle(Pose(np.zeros(3), axis), Pose(way, last)))


def about(tool: Cutter, height: float, slide: tuple[float, float, float]) -> Sweep:
    """A turn by 40 degrees about x whose centre lies at a height of the axis and slides."""
    ends = (0.0, 0.0), (np.radians(40.0), 0.0)
    return Sweep.along(
        tool,
        Turn.through((0, 0, height), (*slide[:2], height + slide[2]), "ac", *ends, control_height=height),
    )


def motions() -> list[tuple[str, Sweep]]:
    """All of them by name."""
    hard = [
        ("ball about its shank", about(BallNose(diameter=20, length=50), 30.0, (2.0, 0.5, 0.3))),
        (
            "bull about its corner",
            about(BullNose(diameter=26, corner_radius=5, length=50), 3.0, (20.0, 40.0, -1.0)),
        ),
    ]
    return [(f"{kind} {seed}", motion(kind, seed)) for kind in KINDS for seed in range(SEEDS)] + hard


def build(sweeps: list[Sweep]) -> Iterator[tuple[Described | str, float, float]]:
    """Solids of each, or why there are none, with seconds, and seconds with the file."""
    quiet()
    with TemporaryDirectory() as folder:
        for sweep in sweeps:
            begin, took = process_time(), np.nan
            found: Described | str
            try:
                steps = brep.built_sweep(sweep, WIDE_MISS_MM, Path(folder) / "sweep.step")
                found, took = next(steps), process_time() - begin
                next(steps)
            except (SweepError, EngineError) as exc:
                found = str(exc)
            yield found, took, process_time() - begin


def main(seconds: float) -> None:
    """Print the lines."""
    named, at = motions(), 0
    while at < len(named):
        try:
            for found, took, whole in brep.isolated_steps(build, [s for _, s in named[at:]], seconds=seconds):
                name, at = named[at][0], at + 1
                if isinstance(found, str):
                    print(f"{name}: none, {found} ({whole:.1f} s)", flush=True)
                    continue
                faces = sum(one.faces for one in found.solids)
                good = all(one.valid and one.closed for one in found.solids)
                print(
                    f"{name}: {len(found.solids)} solids, {faces} faces, {'valid' if good else 'INVALID'}, "
                    f"{found.fit_mm:.1e} mm, {found.points} points, {took:.1f} s, {whole:.1f} s",
                    flush=True,
                )
        except EngineError as exc:
            print(f"{named[at][0]}: none, {exc}", flush=True)
            at += 1


if __name__ == "__main__":
    from benchmarks import wide_turns as itself  # a worker finds functions there, not in __main__

    itself.main(float(sys.argv[1]) if len(sys.argv) > 1 else SWEEP_SECONDS)
