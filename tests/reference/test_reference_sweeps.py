"""Removed and swept volumes with a known answer. Each row says where the number is from.

Solids are cut flat at their length, and the top disc belongs to them. Closed forms are written out here, by
elementary solid geometry, without the package's formulas. Rows marked `lines` or `flux` were found by others
with "length of upright lines in the union of poses, product Gauss rule" or "flux of the moving surface", and
hold to the digits given.
"""

import csv
from math import atan2, cos, hypot, pi, sin
from pathlib import Path

import numpy as np
import pytest

from vmachining.geometry import Arc
from vmachining.sweep import Sweep
from vmachining.tool import AptTool, BallNose, BullNose, Cutter, FlatEnd, Profile, Taper

F20 = FlatEnd(diameter=20, length=50)
B10 = BallNose(diameter=10, length=50)
N20 = BullNose(diameter=20, corner_radius=5, length=50)
N30 = BullNose(diameter=30, corner_radius=5, length=50)
TAPER = Taper(diameter=6, corner_radius=3, taper_deg=5, length=40)
TAPER_APT = AptTool(d=5.497987044105, r=3, e=0, f=3, alpha_deg=0, beta_deg=5, h=40)
APT = AptTool(d=20, r=2, e=8.0787895264, f=4.23525749024, alpha_deg=15, beta_deg=3, h=50)

H = 50.0
DIGITS = 1e-11
"""Relative: the digits to which closed forms and this package may differ."""


def flat(R: float) -> float:
    return pi * R * R * H


def ball(R: float) -> float:
    return 2 / 3 * pi * R**3 + pi * R * R * (H - R)


def bull(R1: float, r: float) -> float:
    """Core, quarter ring by Pappus, cylinder."""
    quarter = pi * r * r / 4
    return pi * R1**2 * r + quarter * 2 * pi * (R1 + 4 * r / (3 * pi)) + pi * (R1 + r) ** 2 * (H - r)


def side_bull(R1: float, r: float) -> float:
    """Outline seen from the side: rectangle without the two corner spandrels."""
    return 2 * (R1 + r) * H - 2 * r * r + pi * r * r / 2


@pytest.mark.parametrize(
    ("tool", "volume"),
    [
        (F20, flat(10)),
        (B10, ball(5)),
        (N20, bull(5, 5)),
        (N30, bull(10, 5)),
        (TAPER, 2649.872227113),  # published, closed form
        (TAPER_APT, 2649.872227113),
        (APT, 19114.311631180),
    ],
    ids=["F20", "B10", "N20", "N30", "taper", "taper as apt", "apt"],
)
def test_tool_volume(tool: Cutter, volume: float):
    assert tool.profile.volume == pytest.approx(volume, rel=DIGITS)


def test_apt_corner_ends():
    """A tangent corner starts below its centre, square to the bottom line, and ends square to the flank."""
    a, b = pi * 15 / 180, pi * 3 / 180
    e, f = 8.0787895264, 4.23525749024
    joints = [[e + 2 * sin(a), f - 2 * cos(a)], [e + 2 * cos(b), f - 2 * sin(b)]]
    assert APT.profile.points[1:3] == pytest.approx(np.array(joints), abs=1e-11)
    assert APT.profile.points[-1, 0] == pytest.approx(12.479962743, abs=1e-9)


def ramp(dx: float, dz: float) -> tuple[float, float]:
    """Length and angle."""
    return hypot(dx, dz), atan2(abs(dz), dx)


def flat_ramp(dx: float, dz: float) -> float:
    return flat(10) + 20 * H * dx + 100 * pi * abs(dz)


def ball_ramp(dx: float, dz: float) -> float:
    """Shadow: half a disc below the equator, half an ellipse above the cylinder, rectangle between."""
    length, a = ramp(dx, dz)
    return ball(5) + length * (25 * pi / 2 * (1 + sin(a)) + 10 * (H - 5) * cos(a))


STRAIGHT = [
    ("level F20", F20, (100, 0, 0), flat(10) + 100 * 20 * H),
    ("level B10", B10, (100, 0, 0), ball(5) + 100 * (10 * (H - 5) + 25 * pi / 2)),
    ("level N20", N20, (100, 0, 0), bull(5, 5) + 100 * side_bull(5, 5)),
    ("ramp F20", F20, (100, 0, -20), flat_ramp(100, -20)),
    ("ramp B10", B10, (100, 0, -20), ball_ramp(100, -20)),
    ("ramp N20", N20, (100, 0, -20), 118688.732105),  # flux
    ("steep F20", F20, (20, 0, -40), flat_ramp(20, -40)),
    ("steep B10", B10, (20, 0, -40), ball_ramp(20, -40)),
    ("steep N20", N20, (20, 0, -40), 46348.284613),  # flux
    ("plunge F20", F20, (0, 0, -30), flat(10) + 100 * pi * 30),
    ("plunge B10", B10, (0, 0, -30), ball(5) + 25 * pi * 30),
    ("plunge N20", N20, (0, 0, -30), bull(5, 5) + 100 * pi * 30),
    ("level taper", TAPER, (100, 0, 0), 38325.7873322),  # closed form
    ("ramp taper", TAPER, (100, 0, -20), 39585.6570185),  # flux
    ("level apt", APT, (100, 0, 0), 128091.5502088),  # closed form
    ("ramp apt", APT, (100, 0, -20), 133651.7183964),  # flux
    ("plunge apt", APT, (0, 0, -30), 33793.3533595),  # closed form
]


@pytest.mark.parametrize(("name", "tool", "end", "volume"), STRAIGHT, ids=[row[0] for row in STRAIGHT])
@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_straight_sweep(name, tool, end, volume, turn):
    """Also in another direction of the plane, and the other way round."""
    c, s = cos(turn), sin(turn)
    there = (7 + c * end[0] - s * end[1], -3 + s * end[0] + c * end[1], 11 + end[2])
    assert Sweep(tool, (7, -3, 11), there).volume == pytest.approx(volume, rel=DIGITS)
    assert Sweep(tool, there, (7, -3, 11)).volume == pytest.approx(volume, rel=DIGITS)


@pytest.mark.parametrize(
    ("tool", "r", "angle", "volume"),
    [
        (F20, 30, pi / 2, flat(10) + 15 * pi * 20 * H),
        (B10, 30, pi / 2, ball(5) + 15 * pi * (10 * (H - 5) + 25 * pi / 2)),
        (N20, 30, pi / 2, bull(5, 5) + 15 * pi * side_bull(5, 5)),
        (F20, 6, pi / 2, 25045.751367),  # lines; the axis of rotation is inside the tool
        (B10, 3, pi / 2, 6081.080215),
        (N20, 6, pi / 2, 24648.167684),
        (F20, 30, 2 * pi, 60 * pi * 20 * H),
        (B10, 30, 2 * pi, 60 * pi * (10 * (H - 5) + 25 * pi / 2)),
        (N20, 30, 2 * pi, 60 * pi * side_bull(5, 5)),
    ],
)
def test_circular_sweep(tool, r, angle, volume):
    for sense in (1, -1):
        path = Arc((r, 0, 0), (0, 0, 0), 2, angle=sense * angle)
        assert Sweep.along(tool, path).volume == pytest.approx(volume, rel=1e-10)


def test_record_of_two_slots():
    """Two slots that meet at a right angle remove height times (3900 + 125 pi) together.

    Each alone is 2000 + 100 pi in plan, so they share 100 + 75 pi: three quarters of the corner's disc, and
    the square on its inner side. The shared part is counted on a grid.
    """
    one = Sweep(F20, (0, 0, 0), (100, 0, 0))
    two = Sweep(F20, (100, 0, 0), (100, 100, 0))
    n = 400
    x, y = np.meshgrid(*(k - 12 + 24 * (np.arange(n) + 0.5) / n for k in (100, 0)), indexing="ij")
    origins = np.stack([x.ravel(), y.ravel(), np.full(n * n, 25.0)], axis=1)
    shared = float((one.contains(origins) & two.contains(origins)).mean()) * 24 * 24
    assert one.volume is not None
    assert two.volume is not None
    together = one.volume + two.volume - H * shared
    # points on a grid: the rim is uncertain by half a cell along its length of about 70 mm
    assert together == pytest.approx(H * (3900 + 125 * pi), abs=H * 70 * 24 / n / 2 / 4)


DATA = Path(__file__).parents[3] / "shared" / "data" / "volumes.csv"
BALL4 = BallNose(diameter=4, length=20)


def slab_volume(sweep: Sweep, box, breaks: list[list[float]]) -> float:
    """Volume of sweep and box by upright Gauss lines between the given breaks in x and y."""
    low, high = np.array(box, dtype=float)
    t, w = np.polynomial.legendre.leggauss(24)
    t, w = 0.5 * (t + 1), 0.5 * w
    t, w = t * t * (3 - 2 * t), w * 6 * t * (1 - t)
    nodes = []
    for cuts in breaks:
        a, b = np.array(cuts[:-1]), np.array(cuts[1:])
        nodes.append(((a + np.outer(t, b - a)).ravel(), np.outer(w, b - a).ravel()))
    (x, wx), (y, wy) = nodes
    origins = np.array([(u, v, 0.0) for u in x for v in y])
    found = sweep.ray_intervals(origins, (0, 0, 1))
    length = np.clip(found.leave, low[2], high[2]) - np.clip(found.enter, low[2], high[2])
    total = np.zeros(len(origins))
    np.add.at(total, np.repeat(np.arange(len(origins)), found.counts), length)
    return float(np.outer(wx, wy).ravel() @ total)


CUBE = ((0, 0, 0), (10, 10, 10))


def removed(case: str) -> tuple[float, float]:
    """(by this package, by closed form) of one published case."""
    if case == "through slot":
        slot = Sweep(FlatEnd(diameter=4, length=20), (5, -3, 6), (5, 13, 6))
        return slab_volume(slot, CUBE, [[3, 7], [0, 10]]), 4 * 4 * 10
    if case == "ball plunge":
        plunge = Sweep(BALL4, (5, 5, 10), (5, 5, 6)).volume or 0.0
        return plunge - 4 * pi * 20, 2 / 3 * pi * 8 + 8 * pi  # the cylinder from z = 10 to 30 is in the air
    if case == "ball slot":
        slot = Sweep(BALL4, (5, -3, 6), (5, 13, 6))
        return slab_volume(slot, CUBE, [[3, 5, 7], [0, 10]]), (2 * pi + 4 * 2) * 10
    if case == "bull slot":
        # the stock ends 10 mm above the tip, so the lower 10 mm of the cutter cut
        section = 20 * 10 - 2 * 25 + pi * 25 / 2
        core = pi * 25 * 5 + pi * 25 / 4 * 2 * pi * (5 + 20 / (3 * pi)) + pi * 100 * 5
        tool = BullNose(diameter=20, corner_radius=5, length=60).profile.clip(0, 10)
        return Sweep(tool, (0, 0, 0), (100, 0, 0)).volume or 0.0, 100 * section + core
    if case == "sphere sweep":
        sphere = Profile([(0, -0.2), (0, 0.2)], [(0, 0)], [0.2])
        return Sweep(sphere, (0, 0, 0), (0.3, 0, 0.4)).volume or 0.0, pi * 0.04 * (4 / 3 * 0.2 + 0.5)
    raise KeyError(case)


IN_SCOPE = ["through slot", "ball plunge", "ball slot", "bull slot", "sphere sweep"]


@pytest.mark.parametrize("case", IN_SCOPE)
def test_removed_volume(case):
    ours, closed = removed(case)
    assert ours == pytest.approx(closed, rel=1e-9)


@pytest.mark.skipif(not DATA.exists(), reason="the published table of removed volumes is not on this machine")
@pytest.mark.parametrize("case", IN_SCOPE)
def test_removed_volume_as_published(case):
    with DATA.open(newline="") as file:
        row = next(r for r in csv.DictReader(file) if r["case"] == case)
    assert removed(case)[0] == pytest.approx(
        float(row["removed_mm3"]), abs=max(float(row["tolerance"]), 1e-7)
    )
