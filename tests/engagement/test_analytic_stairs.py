"""The exact general rule on staircases: published cases put right, dense sampling, conservation of volume."""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import chips
from scipy.integrate import quad
from scipy.spatial import ConvexHull

from vmachining.engagement import chip, frames
from vmachining.engagement.analytic import Corner, HeightStock, engaged
from vmachining.errors import InputError, StockError, ToolError

rad = np.radians
R90 = 5 * pi / 2
# tip, theta_A, theta_B, phi, rm, r, x breaks, tops, y limits, s that counts from, intervals of s, q, axial length
STAIRS = {
    "S1": ((0, 0, 0), 5, 20, 60, 10, 0, (-20, 2, 8, 11, 30), (3, 4.5, 2, 7), None,
           [(0, 4.82304275299), (8.36799598608, 10.1642565464)], 6.6193033133193, 6.6193033133193),
    "S2": ((0, 0, 0), 4, 20, 60, 5, 5, (-30, 1, 4.5, 9.5, 40), (4, -1, 1, 9), None,
           [(0, 5 * rad(76.1914155083)), (5 * rad(80.2572253237), R90), (R90, R90 + 7.38098937134)],
           14.880162165120, 12.033720674415),
    "S3": ((0, 0, 0), 4, -30, 100, 5, 5, (-30, 6.5, 14.5, 40), (10, 3, 0), None,
           [(0, 5 * rad(42.9594550207)), (5 * rad(76.2780346944), R90), (R90, R90 + 1.02962318146)],
           5.9760102284609, 3.5564954731596),
    "S4": ((0, 0, 0), 0, -25, 75, 5, 5, (-30, 6.5, 13.75, 40), (10, 1.5, 1), None,
           [(0, 5 * rad(34.8650740144)), (R90 + 0.334035901267, R90 + 1.52959308954)], 4.2381088657855, None),
    "S6": ((0, 0, 6), 0, 30, 90, 10, 0, (-20, 11, 40), (-1, 9), None,
           [(4.67949192431, 9.23760430703)], 4.5581123827228, 4.5581123827228),
    "S7": ((0, 0, 0), -20, 15, 150, 10, 0, (-20, 0, 30), (12, 12), (-9, -2),
           [(0, 11.297092910526)], 11.297092910526, 11.297092910526),
}  # fmt: skip


@pytest.mark.parametrize("case", STAIRS.values(), ids=STAIRS)
def test_published_staircases(case):
    tip, a, b, phi, rm, r, x, tops, y, want, q, axial = case
    stock = HeightStock.staircase(x, tops, y=y or (-np.inf, np.inf))
    m = frames.rotation(rad(a), rad(b))
    found = engaged(Corner(rm, r), stock, tip, m, [rad(phi)], facing=False, bottom=False)
    intervals = np.column_stack([found.lower[0, 0], found.upper[0, 0]])[: len(want)]
    assert found.count[0, 0] == len(want)
    assert intervals == pytest.approx(np.array(want), abs=1e-10)  # 12 digits, lam up to 90 degrees
    assert found.cut_length == pytest.approx(q, abs=1e-12)
    if axial is not None:
        assert found.axial_depth == pytest.approx(axial, abs=1e-12)


def test_published_staircase_above_a_lower_limit():
    """S5 counts from lam 12 degrees; the facing set of a suitable motion does that."""
    stock = HeightStock.staircase((-15, 5, 12, 25), (6, 4, 8))
    m = frames.rotation(rad(-3), rad(10))
    e_r = chip.radial(m, rad(110))
    velocity = cos(rad(12)) * e_r + sin(rad(12)) * m[:, 2]
    found = engaged(Corner(8, 3), stock, (0, 0, 0), m, [rad(110)], velocity)
    assert found.lower[0, 0, 0] == pytest.approx(3 * rad(12), abs=1e-14)
    assert found.cut_length == pytest.approx(6.7737644144894, abs=1e-12)


STEP = 2e-3


def sampled(corner, stock, tip, m, phi, velocity, rate, facing, bottom):
    """Engaged length by points every `STEP` mm, and the number of ends met."""
    length = 0.0
    ends = 0
    ranges = [(0.0, corner.r * pi / 2), (corner.r * pi / 2, corner.r * pi / 2 + corner.flute)]
    for low, high in ([(-corner.rm, 0.0)] if bottom else []) + ranges:
        n = int(np.ceil((high - low) / STEP))
        if n == 0:
            continue
        s = low + (high - low) * (np.arange(n) + 0.5) / n
        lam = np.where(s < 0, 0.0, np.clip(s / corner.r, 0, pi / 2) if corner.r else pi / 2)
        rho = np.where(s < 0, corner.rm + s, corner.rm + corner.r * np.sin(lam))
        z = corner.r * (1 - np.cos(lam)) + np.maximum(s - corner.r * pi / 2, 0.0)
        e_r = m @ [sin(phi), cos(phi), 0]
        q = tip + rho[:, None] * e_r + z[:, None] * m[:, 2]
        normal = np.sin(lam)[:, None] * e_r - np.cos(lam)[:, None] * m[:, 2]
        inside = np.zeros(n, dtype=bool)
        for i in range(len(stock.x) - 1):
            for j in range(len(stock.y) - 1):
                inside |= (
                    (q[:, 0] >= stock.x[i]) & (q[:, 0] <= stock.x[i + 1]) & (q[:, 1] >= stock.y[j])
                    & (q[:, 1] <= stock.y[j + 1]) & (q[:, 2] <= stock.top[i, j]) & (q[:, 2] >= stock.floor)
                )  # fmt: skip
        if facing:
            turn = np.cross(m[:, 2], rate)  # omega with omega x w = rate
            inside &= ((velocity + np.cross(turn, q - tip)) * normal).sum(axis=1) > 0
        length += inside.sum() * (high - low) / n
        ends += np.count_nonzero(np.diff(inside)) + 2
    return length, ends


@given(st.integers(0, 10**9))
@settings(deadline=None, max_examples=150)
def test_any_staircase_is_as_dense_sampling_says(seed):
    rng = np.random.default_rng(seed)
    n, k = int(rng.integers(1, 9)), int(rng.integers(1, 4))
    x = np.sort(rng.uniform(-25, 25, n + 1))
    y = np.array([-np.inf, np.inf]) if rng.random() < 0.5 else np.sort(rng.uniform(-20, 20, k + 1))
    top = np.round(rng.uniform(-3, 12, (n, len(y) - 1)), int(rng.integers(0, 3)))
    stock = HeightStock(x, y, top, float(rng.choice([-np.inf, -2.0, 1.0])))
    r = float(rng.choice([0.0, 2.0, 5.0, 9.0]))
    corner = Corner(float(rng.choice([0.0, 3.0, 8.0])) if r else 10.0, r, 25.0)
    m = frames.rotation(*rng.uniform(-0.6, 0.6, 2))
    tip, velocity = rng.uniform(-5, 5, 3), rng.normal(size=3)
    rate = np.cross(rng.normal(size=3), m[:, 2]) * float(rng.choice([0.0, 0.1]))
    phi = float(rng.uniform(0, 2 * pi))
    facing, bottom = bool(rng.random() < 0.7), bool(rng.random() < 0.7)
    found = engaged(
        corner, stock, tip, m, [phi], velocity, axis_rate=rate, facing=facing, bottom=bottom
    )  # fmt: skip
    want, ends = sampled(corner, stock, tip, m, phi, velocity, rate, facing, bottom)
    assert found.cut_length[0, 0] == pytest.approx(want, abs=STEP * ends)
    lower, upper = found.lower[0, 0], found.upper[0, 0]
    real = ~np.isnan(lower)
    assert (upper[real] > lower[real]).all() and (lower[real][1:] >= upper[real][:-1]).all()


# -- conservation of volume: the integral over the contact is what the tool covers in the direction of its feed --------


def rate_of_removal(corner, stock, tip, m, velocity):
    def density(phi):
        found = engaged(corner, stock, tip, m, [phi], velocity)
        return float(chips.removal_density(found.lower, found.upper, found.speeds, corner.rm, corner.r)[0, 0])

    # the edge of a corner enters and leaves like a root, so the panels are many
    ends = np.linspace(0, 2 * pi, 25)
    return sum(quad(density, a, b, epsabs=1e-9, epsrel=1e-10, limit=200)[0] for a, b in pairwise(ends))


def test_a_leaning_bull_nose_removes_what_its_front_covers():
    m = frames.rotation(0, rad(10))
    tip = frames.tip_of_contact((0, 0, 0), (0, 0, 1), m[:, 2], 5, 5)
    slab = HeightStock.staircase((-100, 100), (2,))
    rate = rate_of_removal(Corner(5, 5), slab, tip, m, (1, 0, 0))
    assert rate == pytest.approx(24.86344322207, rel=1e-8)


def shadow(corner, top, m, tip, velocity, n):
    """Area that the tool below a level covers, seen along its motion: a convex body, by points of its surface."""
    phi = np.linspace(0, 2 * pi, n, endpoint=False)[:, None]
    lam = np.linspace(0, pi / 2, n + 1 if corner.r else 1)
    # rings of the corner, then of the cylinder up to far above the level
    rho = np.concatenate([corner.rm + corner.r * np.sin(lam), [corner.radius]])
    z = np.concatenate([corner.r * (1 - np.cos(lam)), [60.0]])
    e_r = np.sin(phi)[..., None] * m[:, 0] + np.cos(phi)[..., None] * m[:, 1]
    q = tip + rho[:, None] * e_r + z[:, None] * m[:, 2]
    below, step = q[..., 2] <= top, np.diff(q, axis=1)
    cut = below[:, :-1] & ~below[:, 1:]
    share = (top - q[:, :-1, 2])[cut] / step[..., 2][cut]
    points = np.concatenate([q[below], q[:, :-1][cut] + share[:, None] * step[cut]])
    v = frames.unit(velocity)
    basis = np.linalg.svd(v[None])[2][1:]
    return float(ConvexHull(points @ basis.T).volume)


@pytest.mark.parametrize("corner", [Corner(10, 0), Corner(5, 5), Corner(0, 10)], ids=["flat", "bull", "ball"])
@pytest.mark.parametrize(
    ("lean", "velocity"),
    [((0, 0), (0, 0, -1)), ((0, 0), (cos(rad(20)), 0, -sin(rad(20)))), ((5, 12), (0.8, 0.6, 0)), ((-4, 8), (1, 0.2, -0.4))],
    ids=["plunge", "ramp", "level", "leaning ramp"],
)  # fmt: skip
def test_removal_is_what_the_tool_covers(corner, lean, velocity):
    m, top = frames.rotation(*rad(lean)), 2.5
    slab = HeightStock.staircase((-100, 100), (top,))
    rate = rate_of_removal(corner, slab, (0, 0, 0), m, velocity) / np.linalg.norm(velocity)
    # inscribed hulls: their error falls with the square of the chords
    coarse, fine = (
        shadow(corner, top, m, (0, 0, 0), velocity, n) for n in ((600, 1200) if corner.r else (4000, 8000))
    )
    assert rate == pytest.approx(fine + (fine - coarse) / 3, rel=1e-6)


def test_plunge_and_ramp_in_closed_form():
    slab, m = HeightStock.staircase((-100, 100), (3,)), np.eye(3)
    a = rad(20)
    flat = rate_of_removal(Corner(10, 0), slab, (0, 0, 0), m, (cos(a), 0, -sin(a)))
    assert flat == pytest.approx(60 * cos(a) + pi * 100 * sin(a), rel=1e-9)
    reach = 12 + (4**2 - 1**2) ** 0.5  # of a D32 r4 in a depth of 3
    assert rate_of_removal(Corner(12, 4), slab, (0, 0, 0), m, (0, 0, -2)) == pytest.approx(
        2 * pi * reach**2, rel=1e-9
    )
    assert rate_of_removal(Corner(12, 4), slab, (0, 0, 0), m, (1, 0, 0)) == pytest.approx(
        2 * (36 + 4 * 4 * (np.arccos(0.25) / 2 - sin(2 * np.arccos(0.25)) / 4)), rel=1e-8
    )  # the shadow of the corner: 12 x 3 and the segment of the circle, on both sides


# -- hard edge cases ------------------------------------------------------------------------------------------


def test_an_edge_on_a_wall_belongs_to_both_sides_and_does_not_flip_by_an_ulp():
    for x in (10.0, np.nextafter(10.0, 11), np.nextafter(10.0, 9)):
        stock = HeightStock.staircase((-20, x, 30), (2, 5))
        found = engaged(Corner(10, 0), stock, (0, 0, 0), np.eye(3), [pi / 2], facing=False)
        assert found.cut_length == pytest.approx(10 + 5)  # disc and the higher of the two
    for z in (2.0, np.nextafter(2.0, 3), np.nextafter(2.0, 1)):
        stock = HeightStock.staircase((-20, 30), (z,))
        found = engaged(Corner(10, 0), stock, (0, 0, 2), np.eye(3), [0.0], facing=False)
        assert found.cut_length == pytest.approx(10.0)  # the disc lies in the top


def test_blocks_thinner_than_the_tolerance_and_equal_neighbours_merge():
    stock = HeightStock.staircase((-20, 3, 3 + 1e-13, 6, 9, 40), (1, -9, 1, 1, 1))
    m = frames.rotation(0, rad(30))
    found = engaged(Corner(0, 10), stock, (0, 0, 0), m, [pi / 2], facing=False)
    assert found.count[0, 0] == 1


def test_many_intervals_grow_the_room():
    x = np.arange(-30, 31, 1.0)
    comb = HeightStock.staircase(x, np.where(np.arange(60) % 2, 50.0, -50.0))
    found = engaged(
        Corner(10, 0, 40), comb, (0, 0, 0), frames.rotation(0, rad(60)), [pi / 2, 0], facing=False
    )
    assert found.count.max() > 10 and found.lower.shape[-1] == found.count.max()


def test_a_tool_at_rest_faces_nothing_and_a_plunge_all_of_its_corner():
    slab = HeightStock.staircase((-50, 50), (3,))
    still = engaged(Corner(5, 5), slab, (0, 0, 0), np.eye(3), np.linspace(0, 6, 7))
    assert not still.cut_length.any() and np.isnan(still.chip_area(1.0)).all()
    down = engaged(Corner(5, 5), slab, (0, 0, 0), np.eye(3), [0.0, 1.0], (0, 0, -1))
    assert down.lower[0, :, 0] == pytest.approx([-5, -5]) and down.upper[0, 0, 1] == pytest.approx(
        5 * np.arccos(0.4)
    )


def test_a_negative_lead_has_an_upper_limit_behind_and_its_disc_in_contact():
    slab = HeightStock.staircase((-50, 50), (3,))
    m = frames.rotation(0, rad(-8))
    found = engaged(Corner(5, 5), slab, (0, 0, 0), m, rad([270.0]), (1, 0, 0))
    assert found.lower[0, 0, :2] == pytest.approx([-5, 0]) and found.upper[0, 0, 1] == pytest.approx(
        5 * rad(8)
    )


def test_stock_from_vectors():
    x, y = np.meshgrid(np.arange(4.0), np.arange(0, 3, 1.5), indexing="ij")
    z = x + 10 * y
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])[np.random.default_rng(3).permutation(8)]
    stock = HeightStock.vectors(points, floor=-5)
    assert stock.x == pytest.approx([-0.5, 0.5, 1.5, 2.5, 3.5]) and stock.y == pytest.approx(
        [-0.75, 0.75, 2.25]
    )
    assert stock.top == pytest.approx(z)


def ask(tip=(0, 0, 0), frame=None, phi=(0.0,), velocity=(1, 0, 0)):
    frame = np.eye(3) if frame is None else frame
    return engaged(Corner(5, 5), HeightStock.staircase((0, 1), (1,)), tip, frame, phi, velocity)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HeightStock.staircase((0, 0, 1), (1, 2)), "must rise"),
        (lambda: HeightStock.staircase((0, 1), (1, 2)), "one height for each cell"),
        (lambda: HeightStock.staircase((0, 1), (np.nan,)), "not a number"),
        (lambda: HeightStock.vectors([(0, 0, 1), (0, 1, 1)]), "one x only"),
        (lambda: HeightStock.vectors([(0, 0, 1), (1, 1, 1), (0, 0, 2)]), "at one position"),
        (lambda: Corner(0, 0), "radii"),
        (lambda: ask(tip=(0, 0)), "shape"),
        (lambda: ask(velocity=[(1, 0, 0)] * 3), "velocity of shape \\(3, 3\\) for 1 positions"),
        (lambda: ask(phi=[[0.0], [1.0]]), "phi of shape"),
        (lambda: ask(tip=(0, np.nan, 0)), "tip: every value must be finite"),
        (lambda: ask(frame=np.diag([1, 1, -1.0])), "not a rotation"),
        (lambda: ask(frame=1.1 * np.eye(3)), "not a rotation"),
    ],
)  # fmt: skip
def test_bad_input(make, message):
    with pytest.raises((StockError, ToolError, InputError), match=message):
        make()


def test_each_position_may_have_angles_of_its_own():
    slab = HeightStock.staircase((-50, 50), (3,))
    tips, both = [(0, 0, 0), (0, 0, 1)], np.array([[0.3, 1.0], [1.2, 2.0]])
    one = engaged(Corner(5, 5), slab, tips, np.eye(3), both, (1, 0, 0))
    for i in range(2):
        alone = engaged(Corner(5, 5), slab, tips[i], np.eye(3), both[i], (1, 0, 0))
        assert alone.cut_length[0] == pytest.approx(one.cut_length[i], abs=0)
    assert one.phi_feed == pytest.approx(both) and radians(1) == rad(1)


def test_chips_of_a_slot():
    """Flat D10, depth 3, f 0.1: area f ap sin(phi), thickness f sin(phi)."""
    slab = HeightStock.staircase((-50, 50), (3,))
    phi = rad(np.arange(0, 360, 15))
    found = engaged(Corner(5, 0), slab, (0, 0, 0), np.eye(3), phi, (10, 0, 0))
    wave = 0.1 * np.maximum(np.sin(phi), 0)
    assert found.chip_area(0.1)[0] == pytest.approx(3 * wave, abs=1e-15)
    assert found.chip_area(0.1, model="book")[0] == pytest.approx(3 * wave, abs=1e-15)
    assert found.thickest(0.1)[0] == pytest.approx(wave, abs=1e-15)
    assert found.depth()[0][6] == pytest.approx(3.0)
    assert found.points(upper=True)[0, 6, 0] == pytest.approx([5, 0, 3])
