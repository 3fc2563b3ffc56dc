"""Writes mould.nc: a bowl z = -D cos^2(pi x / 2a) cos^2(pi y / 2a), roughed in levels and finished by a ball.

python models/mould/make.py             writes mould.nc beside this file
python models/mould/make.py --table     prints the bounds of the volume

Two facts carry it. A ball of radius b that touches the surface at p has its centre at p + b n, so the centre
over a point of the plan follows from a fixed point iteration (b times the curvature stays below 1/2). And
{z < level} is convex, because the logarithm of the product of cos^2 is concave: a disc lies in it if its rim
does, and so does the straight sweep between two such discs.
"""

from __future__ import annotations

from math import ceil, cos, pi, prod, sin, sqrt

from benchmarks.modelfiles import number, write_model

DEPTH, HALF = 12.0, 25.0  # mm, D and a
BALL, FLAT = 4.0, 4.0  # mm, radii of the finishing and of the roughing cutter
LEVELS = [-2.0, -4.0, -6.0, -8.0, -9.5]  # mm
ALLOWANCE = 0.5  # mm in z that roughing leaves
ROUGH_STEP, STEP = 4.0, 1.0  # mm, distance of passes in roughing and finishing (also the block there)
RAMP = 0.14  # slope of the ramped entry
SAFE = 10.0  # mm
ROUGH_FEED, RAMP_FEED, FINISH_FEED = 900.0, 300.0, 1200.0  # mm/min
WAVE = pi / (2 * HALF)
STOCK = (60.0, 60.0, 25.0)  # mm, as in job.toml

Point = tuple[float, float, float]


def word(letter: str, value: float) -> str:
    """An NC word with at most four decimals."""
    return letter + number(value, 4)


def surface(x: float, y: float) -> float:
    """Height of the design, mm."""
    if max(abs(x), abs(y)) >= HALF:
        return 0.0
    return -DEPTH * cos(WAVE * x) ** 2 * cos(WAVE * y) ** 2


def slope(x: float, y: float) -> tuple[float, float]:
    """Its derivatives."""
    if max(abs(x), abs(y)) >= HALF:
        return 0.0, 0.0
    return (
        DEPTH * WAVE * sin(2 * WAVE * x) * cos(WAVE * y) ** 2,
        DEPTH * WAVE * cos(WAVE * x) ** 2 * sin(2 * WAVE * y),
    )


def ball_tip(x: float, y: float) -> float:
    """Height of the tip of a ball over (x, y) that touches the design, mm."""
    px, py = x, y
    for _ in range(60):
        gx, gy = slope(px, py)
        root = sqrt(1 + gx * gx + gy * gy)
        px, py = x + BALL * gx / root, y + BALL * gy / root  # n = (-gx, -gy, 1) / root
    return surface(px, py) + BALL / root - BALL


def fits(x: float, y: float, level: float) -> bool:
    """Whether the flat cutter at this level leaves the allowance everywhere."""
    rim = ((x + FLAT * cos(pi * k / 90), y + FLAT * sin(pi * k / 90)) for k in range(180))
    return max(surface(*point) for point in rim) <= level - ALLOWANCE


def reach(y: float, level: float) -> float:
    """Largest x that fits on the line Y = y, rounded down to 0.01 mm; negative: none."""
    if not fits(0.0, y, level):
        return -1.0
    inside, outside = 0.0, HALF
    while outside - inside > 1e-4:
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if fits(middle, y, level) else (inside, middle)
    return int(inside * 100) / 100


def roughing(level: float, above: float) -> list[tuple[Point, float]]:
    """Moves of one level: down along Y = 0, over one half of it in zigzag, back, over the other.

    The first is the point where the ramp begins, half a millimetre above what is already cut.
    """
    x, start = reach(0.0, level), above + 0.5
    legs = max(2, ceil((start - level) / RAMP / (2 * x)))
    moves = [((x * (-1) ** k, 0.0, start + (level - start) * k / legs), RAMP_FEED) for k in range(legs + 1)]
    moves.append((((-1) ** legs * -x, 0.0, level), ROUGH_FEED))  # the floor of the ramp
    for side in (1, -1):
        end = moves[-1][0][0]
        k = 1
        while (x := reach(side * k * ROUGH_STEP, level)) >= 0:
            here = x if end > 0 else -x
            moves += [((here, side * k * ROUGH_STEP, level), ROUGH_FEED)]
            moves += [((-here, side * k * ROUGH_STEP, level), ROUGH_FEED)]
            end, k = -here, k + 1
        moves.append(((0.0, 0.0, level), ROUGH_FEED))
    return moves


def finishing() -> list[Point]:
    """Tip of the ball, zigzag along X in steps of one block."""
    count = round(2 * HALF / STEP)
    points = []
    for j in range(1, count):
        y = -HALF + j * STEP
        row = [(-HALF + i * STEP, y) for i in range(count + 1)]
        points += [(x, y, ball_tip(x, y)) for x, y in (row if j % 2 else reversed(row))]
    return points


def program() -> str:
    """The text of mould.nc."""
    lines = [
        "(BOWL OF COSINES, FLAT END MILL D8 AND BALL D8)",
        "(STOCK X -30..30  Y -30..30  Z -25..0, ZERO AT TOP CENTRE)",
        "G21 G90 G17 G94 G40 G49 G80 G54",
        "(ROUGHING)",
        "T1 M6",
        "S6000 M3",
        f"G0 {word('Z', SAFE)} M8",
    ]
    above = 0.0
    for level in LEVELS:
        (start, _), *moves = roughing(level, above)
        lines += [f"G0 {word('X', start[0])} {word('Y', start[1])}", f"G0 {word('Z', start[2])}"]
        lines += feed_moves(start, moves)
        lines.append(f"G0 {word('Z', SAFE)}")
        above = level
    start, *rest = finishing()
    lines += ["M5", "M9", "(FINISHING)", "T2 M6", "S9000 M3", f"G0 {word('Z', SAFE)} M8"]
    lines += [f"G0 {word('X', start[0])} {word('Y', start[1])}", f"G0 {word('Z', start[2] + 1)}"]
    lines += feed_moves((start[0], start[1], start[2] + 1), [(start, RAMP_FEED)])
    lines += feed_moves(start, [(point, FINISH_FEED) for point in rest])
    lines += [f"G0 {word('Z', SAFE)}", "M5", "M9", "M30"]
    return "\n".join(lines) + "\n"


def feed_moves(start: Point, moves: list[tuple[Point, float]]) -> list[str]:
    """Blocks of straight moves; only words that change are written."""
    lines, position, feed = [], start, 0.0
    for end, rate in moves:
        words = [
            word(letter, new)
            for letter, old, new in zip("XYZ", position, end, strict=True)
            if word(letter, new) != word(letter, old)
        ]
        if not words:
            continue
        if rate != feed:
            words.append(word("F", rate))
        lines.append(" ".join(words if feed else ["G1", *words]))
        position, feed = end, rate
    return lines


def bowl_volume() -> float:
    """Volume of the design below the stock, mm^3: D a^2, since cos^2 has the mean 1/2."""
    return DEPTH * HALF**2


def part_volume() -> float:
    """mm^3 of part.step."""
    return prod(STOCK) - bowl_volume()


def volume_bounds() -> tuple[float, float]:
    """Bounds of what the program removes, mm^3 (README.md)."""
    steepest, curvature = DEPTH * WAVE, 2 * DEPTH * WAVE**2
    gouge = curvature * STEP**2 / 8  # chords on the convex rim
    chord = curvature / (1 - BALL * curvature) * (1 + steepest**2) ** 1.5 * STEP**2 / 8
    wide = STEP / 2 * sqrt(1 + steepest**2) / (1 - BALL * curvature)
    excess = chord + wide**2 / 2 * (1 / BALL + curvature) * sqrt(1 + steepest**2)
    return bowl_volume() - excess * (2 * HALF) ** 2, bowl_volume() + gouge * (2 * HALF + 1) ** 2


def table() -> str:
    """The known truths."""
    low, high = volume_bounds()
    return (
        f"bowl {bowl_volume():.6f} mm^3, removed {low:.3f} to {high:.3f} mm^3\n"
        f"reach of the levels {[reach(0.0, level) for level in LEVELS]}"
    )


if __name__ == "__main__":
    write_model(__file__, lambda: {"mould.nc": program()}, table)
