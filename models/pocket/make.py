"""Writes pocket.nc, and knows the exact volume of the pocket and of some of its blocks.

python models/pocket/make.py            writes pocket.nc beside this file
python models/pocket/make.py --table    prints the closed forms

At height h above the tip a bull nose of radius R and corner radius r has the radius
rho(h) = R - r + sqrt(r^2 - (r - h)^2) for h < r, else R. The passes leave no island (README.md), so the
section of the pocket at height h is the outermost centre path, filled, and grown by rho(h): with its area A
and its perimeter P

    section(h) = A + P rho(h) + pi rho(h)^2                                       (Steiner)
"""

from __future__ import annotations

from math import pi, prod
from typing import NamedTuple

from benchmarks.modelfiles import word, write_model

RADIUS, CORNER = 6.0, 3.0  # mm, of the cutter
STEP = 4.0  # mm between neighbouring passes
LOOPS = [(25.0, 5.0), (33.0, 13.0), (41.0, 21.0), (49.0, 29.0)]  # mm, X and Y size of the centre paths
ROUND = 2.0  # mm, corner radius of every centre path
LEVELS = [-5.0, -10.0]  # mm, Z of the two floors
TURNS, HELIX = 2, 2.5  # turns of the helical entry per level, its radius in mm
STOCK = (80.0, 60.0, 20.0)  # mm, as in job.toml
CLEAR = 0.5  # mm above the material where a helix begins
MIDDLE = 4.0  # mm, half the length of the middle block of the +Y side
FEED, ENTRY_FEED = 800.0, 300.0  # mm/min


class Corner(NamedTuple):
    """End of a feed move; centre None for a straight one. Volume in mm^3 where it has a closed form."""

    x: float
    y: float
    z: float
    center: tuple[float, float] | None = None
    feed: float = FEED
    volume: float | None = None


def section_moments(depth: float) -> tuple[float, float]:
    """Integrals of rho and of rho^2 over h = 0..depth, depth >= r."""
    flat, r = RADIUS - CORNER, CORNER
    first = flat * r + pi * r**2 / 4 + RADIUS * (depth - r)
    second = flat**2 * r + flat * pi * r**2 / 2 + 2 * r**3 / 3 + RADIUS**2 * (depth - r)
    return first, second


def pocket_volume(depth: float) -> float:
    """Volume of the finished pocket of this depth, mm^3."""
    a, b = LOOPS[-1]
    area = a * b - (4 - pi) * ROUND**2
    perimeter = 2 * (a + b) - (8 - 2 * pi) * ROUND
    first, second = section_moments(depth)
    return area * depth + perimeter * first + pi * second


def part_volume() -> float:
    """mm^3 of part.step."""
    return prod(STOCK) - pocket_volume(-LEVELS[-1])


def middle_volume(loop: int, level: int) -> float | None:
    """Volume of the middle block of the +Y side of a loop; the innermost loop has no closed form."""
    if loop == 0:
        return None
    volume = STEP * (LEVELS[0] - LEVELS[1]) * 2 * MIDDLE
    if loop == len(LOOPS) - 1 and level == 1:  # what the corner radius of the upper level left at the wall
        volume += (1 - pi / 4) * CORNER**2 * 2 * MIDDLE
    return volume


def entry_volume() -> float:
    """Volume of a helix and the level turn that ends it, mm^3: Steiner again, about a circle."""
    depth = LEVELS[0] - LEVELS[1]
    first, second = section_moments(depth)
    return pi * (HELIX**2 * depth + 2 * HELIX * first + second)


def level_moves(level: int) -> list[Corner]:
    """Helix, a level turn, then the loops from the inside out, counter-clockwise (climb milling)."""
    floor = LEVELS[level]
    top = (LEVELS[level - 1] if level else 0.0) + CLEAR
    heights = [top + (floor - top) * (turn + 1) / TURNS for turn in range(TURNS)] + [floor]
    moves = [Corner(0, -HELIX, top, feed=ENTRY_FEED)]
    moves += [Corner(0, -HELIX, z, center=(0, 0), feed=ENTRY_FEED) for z in heights]
    for loop, (a, b) in enumerate(LOOPS):
        x, y, r = a / 2, b / 2, ROUND
        moves += [
            Corner(0, -y, floor),
            Corner(x - r, -y, floor),
            Corner(x, -y + r, floor, center=(x - r, -y + r)),
            Corner(x, y - r, floor),
            Corner(x - r, y, floor, center=(x - r, y - r)),
            Corner(MIDDLE, y, floor),
            Corner(-MIDDLE, y, floor, volume=middle_volume(loop, level)),
            Corner(-x + r, y, floor),
            Corner(-x, y - r, floor, center=(-x + r, y - r)),
            Corner(-x, -y + r, floor),
            Corner(-x + r, -y, floor, center=(-x + r, -y + r)),
            Corner(0, -y, floor),
        ]
    return moves


def written_moves() -> list[Corner]:
    """The feed moves of the program: those of both levels that go anywhere."""
    moves: list[Corner] = []
    for level in range(len(LEVELS)):
        for move in level_moves(level):
            if moves and move[:3] == moves[-1][:3] and not move.center:
                continue  # the first loop begins where the entry ends
            moves.append(move)
    return moves


def program() -> str:
    """The text of pocket.nc."""
    above = [f"G0 X0 {word('Y', -HELIX)}", "G0 Z2"]
    lines = [
        "(RECTANGULAR POCKET, BULL NOSE D12 R3, HELICAL ENTRY, TWO LEVELS)",
        "(STOCK X -40..40  Y -30..30  Z -20..0, ZERO AT TOP CENTRE)",
        "G21 G90 G17 G94 G40 G49 G80 G54",
        "T1 M6",
        "S8000 M3",
        "G0 Z20 M8",
    ]
    x, y, z, feed = 0.0, 0.0, 0.0, 0.0
    for move in written_moves():
        if move.feed == ENTRY_FEED != feed:  # an entry begins
            lines += ["G0 Z2", above[0]] if feed else above
            x, y, z = 0.0, -HELIX, 2.0
        words = ["G3" if move.center else "G1"]
        words += [
            word(letter, new)
            for letter, old, new in (("X", x, move.x), ("Y", y, move.y), ("Z", z, move.z))
            if new != old
        ]
        if move.center:
            words += [word("I", move.center[0] - x), word("J", move.center[1] - y)]
        if move.feed != feed:
            words.append(word("F", move.feed))
        lines.append(" ".join(words))
        x, y, z, feed = move.x, move.y, move.z, move.feed
    lines += ["G0 Z20", "M5", "M9", "M30"]
    return "\n".join(lines) + "\n"


def table() -> str:
    """The known truths."""
    rows = [f"pocket {-z:g} mm deep {pocket_volume(-z):.6f} mm^3" for z in LEVELS]
    rows.append(f"helix and level turn {entry_volume():.6f} mm^3")
    rows += [
        f"middle blocks, level {level + 1} {[middle_volume(k, level) for k in range(1, 4)]}"
        for level in (0, 1)
    ]
    return "\n".join(rows)


if __name__ == "__main__":
    write_model(__file__, lambda: {"pocket.nc": program()}, table)
