"""Writes mould_cover.nc: the cover of part.step roughed by a ball in parallel passes that the drop cutter found.

See `benchmarks.modelfiles` for how to call it.
"""

from __future__ import annotations

from math import radians, sqrt, tan
from pathlib import Path

from benchmarks.modelfiles import write_model
from vmachining.job.stock import read_part
from vmachining.toolpath.clpath import CLPath, iso_program
from vmachining.toolpath.facets import Surface, raster

LENGTH, WIDTH, HEIGHT, RIM, FLAT, DRAFT_DEG = 100.0, 95.5, 34.0, 2.0, 1.0, 5.0
SLOT, SLOT_LENGTH, SLOT_DEPTH, SLOTS = 1.5, 20.0, 0.8, 111
TOP = 36.0  # mm, of the stock
BALL, STEP, CHORD = 3.0, 4.0, 0.1  # mm


def path() -> CLPath:
    """Passes along x over facets that are the faces themselves: all of them are plane."""
    part = read_part(Path(__file__).parent / "part.step", chord_mm=0.01)
    return raster(Surface(part), BALL, BALL, chord=CHORD, step=STEP, clear=TOP + 5.0).path


def program() -> str:
    """The text of mould_cover.nc."""
    return iso_program(
        path(), feed_mm_min=2000.0, spindle_rev_min=9000.0, title="MOULD COVER, ROUGHING, BALL D6, STEP 4"
    )


def part_volume() -> float:
    """mm^3: lips, a frustum of a pyramid over a rectangle, less the slots."""
    a, b, h = LENGTH - 2 * FLAT, WIDTH - 2 * FLAT, HEIGHT - RIM
    t = 2 * tan(radians(DRAFT_DEG))
    frustum = a * b * h - (a + b) * t * h**2 / 2 + t**2 * h**3 / 3
    return LENGTH * WIDTH * RIM + frustum - SLOTS * SLOT * SLOT_LENGTH * SLOT_DEPTH


def dip() -> float:
    """mm that the ball sinks into a slot, standing on its two edges."""
    return BALL - sqrt(BALL**2 - SLOT**2 / 4)


def ridge() -> float:
    """mm between two passes on a plane."""
    return BALL - sqrt(BALL**2 - STEP**2 / 4)


def most() -> float:
    """mm^3: more than this is not removed: the part stays, and the slots below the dip."""
    slots = SLOTS * SLOT * SLOT_LENGTH * (SLOT_DEPTH - dip())
    return LENGTH * WIDTH * TOP - part_volume() - slots


def table() -> str:
    """The known truths."""
    return (
        f"part {part_volume():.6f} mm^3; removed at most {most():.3f} mm^3; slots keep {SLOT_DEPTH - dip():.6f} to "
        f"{SLOT_DEPTH + ridge() + CHORD:.6f} mm; the top at most {ridge() + CHORD:.6f} mm"
    )


if __name__ == "__main__":
    write_model(__file__, lambda: {"mould_cover.nc": program()}, table)
