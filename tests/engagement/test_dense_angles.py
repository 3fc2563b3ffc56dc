"""Contact columns against `contact`, which asks other distances at dense angles: the largest values lie between coarse angles."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining.engagement import Engagement, Past, RayWorkpiece, contact
from vmachining.engagement.along import Sweeps, contact_along
from vmachining.geometry import Arc, Line
from vmachining.stock import BoxStock
from vmachining.sweep import Stance, Sweep
from vmachining.tool import BallNose, BullNose, Edge, FlatEnd

PLATE = BoxStock([0, 0, -20], [60, 40, 0])
BALL = BallNose(diameter=16, length=60)


def stations(tool, stock, paths, at):
    """Largest values over stations of the last motion: (area, thickness, ae, ap, fraction) of the columns and by dense angles."""
    sweeps, edge = Sweeps(stock), Edge(tool, bottom=True)
    for path in paths:
        sweeps.add(tool.cutter, path)
    last = len(paths) - 1
    seen = contact_along(sweeps, [(last, np.array(at))], [edge]).columns[:, :5].max(axis=0)
    found = []
    for t in at:
        stance = Stance.on(paths[last], t)
        past = [Past(k, Sweep.along(tool.cutter, one)) for k, one in enumerate(paths[:-1])]
        own = (
            []
            if isinstance(paths[last], Line)
            else [Past(99, Sweep.along(tool.cutter, paths[last].split([t])[0]))]
        )
        one = Engagement(
            edge,
            stance,
            contact(edge, stance, RayWorkpiece(stock, past), own, angles=720, phase=0.37),
            "dexel",
        )
        if one.is_air:
            continue
        length = float(np.linalg.norm(stance.velocity))
        parts = one.contact.parts
        phi = one.contact.phi[parts.row]
        # N . V along an interval is largest at an end or at most 1 / 40 of it beside one of these places
        share = np.linspace(0.0, 1.0, 41)[:, None]
        thick = max(
            stance.normal_speed(edge, phi, parts.piece, (1.0 - u) * parts.lower + u * parts.upper).max()
            for u in share
        )
        area = np.zeros(len(one.contact.phi))
        np.add.at(area, one.contact.parts.row, one._integrals(one.contact.parts, around=False))
        found.append(
            (area.max() * length, thick, one.ae, one.ap, np.ptp(one.arcs, axis=1).sum() / (2 * np.pi))
        )
    return seen, np.max(found, axis=0)


def cusps():
    """The last motion meets a cusp or a wall of an earlier one between two angles of 5 degrees."""
    rows = [Line([5, y, -3], [55, y, -3]) for y in (8, 15)]
    bull = BullNose(diameter=12, corner_radius=3, length=50)
    return {
        "ramp across rows": (BALL, [*rows, Line([10, 30, -2], [50, 12, -6])], (0.35, 0.6)),
        "row beside rows": (BALL, [*rows, Line([5, 21.5, -4], [55, 21.5, -4])], (0.4,)),
        "wall of a slot": (
            FlatEnd(diameter=10, length=40),
            [Line([-6, 14, -2], [66, 14, -2]), Line([30, -6, -4], [33, 46, -4])],
            (0.3, 0.42),
        ),
        "bull on an arc": (bull, [*rows, Arc([42, 20, -4], [30, 20, -4], angle=2.0)], (0.5, 0.8)),
        "helix": (bull, [rows[0], Arc([36, 20, -2], [30, 20, -2], angle=5.0, rise=-3.0)], (0.4, 0.9)),
    }


@pytest.mark.parametrize("name", cusps())
def test_no_largest_value_is_missed_between_angles(name):
    """0.5 %, or 0.02 mm of ae and ap: with angles of 5 degrees the area of the ramp was 5.6 % too small.

    `contact` at 720 angles is off by up to 0.3 degrees beside a jump that it does not find, 0.5 % of R of ae.
    """
    tool, paths, at = cusps()[name]
    seen, dense = stations(tool, PLATE, paths, at)
    np.testing.assert_allclose(seen[:2], dense[:2], rtol=5e-3)
    np.testing.assert_allclose(seen[2:4], dense[2:4], rtol=5e-3, atol=0.02)
    assert seen[4] == pytest.approx(dense[4], abs=2e-3)


def test_the_side_of_a_row_peaks_where_its_closed_form_does():
    """Ball R on a level row at a step p beside an equal one. psi counts from the feed towards the full side.

    N.V = V cos(beta) cos(psi) on normals from beta = -90 degrees up to the surface or to the earlier groove.
    """
    radius, deep, p = 8.0, 4.0, 3.0
    paths = [Line([-20, 20 - p, -deep], [80, 20 - p, -deep]), Line([-20, 20, -deep], [80, 20, -deep])]
    sweeps, edge = Sweeps(PLATE), Edge(BALL, bottom=True)
    for path in paths:
        sweeps.add(BALL.cutter, path)
    seen = contact_along(sweeps, [(1, np.array([0.5]))], [edge]).columns[0]
    # psi rising towards +y (uncut side): up to the surface everywhere
    psi = np.linspace(-np.pi / 2, np.pi / 2, 2_000_001)
    top = -np.arcsin(1.0 - deep / radius)
    # the earlier ball covers where (rho sin(psi) + p)^2 < rho^2: beyond rho = p / (1 - sin(psi)), and rho = R cos(beta)
    with np.errstate(divide="ignore"):
        limit = np.minimum(p / (radius * (1.0 - np.sin(psi))), 1.0)
    end = np.minimum(top, -np.arccos(limit))
    # integral of N.V over the part: R cos(psi) times the integral of cos(beta) d beta
    area = 100.0 * radius * np.cos(psi) * (np.sin(end) + 1.0)
    assert seen[0] == pytest.approx(area.max(), rel=1e-3)
    thick = 100.0 * np.cos(psi) * np.cos(end)
    assert seen[1] == pytest.approx(thick.max(), rel=1e-3)
    # across the feed: from the end of the groove's cusp to the surface's rim at the other side
    rim = radius * np.cos(top)
    assert seen[2] == pytest.approx(rim + p / 2, abs=2e-3)


@pytest.mark.parametrize("lean", [-50.0, -49.0, -48.0, -47.0])
@pytest.mark.parametrize("round_", [True, False], ids=["ball", "flat"])
def test_a_gap_narrower_than_a_cell_is_found(round_, lean):
    """A groove across the feed takes 1.8 degrees out of an edge, half a cell, and another one begins a cell before it, so that
    margins at nodes do not fall towards the first.

    In the plane of the feed the edge is a circle. A ball r whose centre is A away leaves a gap where cos(theta) exceeds
    (R^2 + A^2 - r^2) / (2 R A); a slot one from where the edge comes above its floor to where it passes its wall. To both sides
    grooves take more and cos(psi) falls, so the largest chip is R V times the sum of sin(end) - sin(begin).
    """
    big, small, deep, half = 8.0, 3.0, 4.0, 0.9
    sin, cos = (lambda degrees: np.sin(np.radians(degrees))), (lambda degrees: np.cos(np.radians(degrees)))
    slot = FlatEnd(diameter=2 * small, length=40)

    def across(tool, x, z):
        return tool, Line([30 + x, -10, big - deep + z], [30 + x, 50, big - deep + z])

    grooves = [across(slot, big * cos(lean - 5) - small, big * sin(lean - 20))]
    if round_:
        apart = big * cos(half) - np.sqrt(
            small**2 - (big * sin(half)) ** 2
        )  # A^2 - 2 R A cos(theta) + R^2 - r^2 = 0
        grooves += [
            across(BallNose(diameter=2 * small, length=40), apart * cos(lean), apart * sin(lean) - small)
        ]
    else:
        grooves += [across(slot, big * cos(lean + half) - small, big * sin(lean - half))]
    sweeps, edge = Sweeps(PLATE), Edge(BALL, bottom=True)
    for tool, path in [*grooves, (BALL, Line([10, 20, -deep], [50, 20, -deep]))]:
        sweeps.add(tool.cutter, path)
    seen = contact_along(sweeps, [(2, np.array([0.5]))], [edge]).columns[0]
    ends = [-90.0, lean - 20, lean - 5, lean - half, lean + half, np.degrees(np.arcsin(deep / big - 1.0))]
    area = 40.0 * big * (np.diff(sin(np.array(ends)))[::2]).sum()
    assert seen[0] == pytest.approx(area, rel=1e-4)


BULL = BullNose(diameter=12, corner_radius=3, length=50)
WAYS = {
    "on": (5, 0, 0),
    "up": (5, 0, 2),
    "down": (5, 0, -2),
    "aside": (3, 2, 0.2),
    "away": (-1, 4, 0),
    "back": (-4, -1, 0),
}


@pytest.mark.parametrize("height", [-3.0, -4.0, -5.0])
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("tool", [BALL, BULL], ids=["ball", "bull"])
def test_a_block_begins_with_what_the_one_before_it_left(tool, way, height):
    """Asked by itself, the first place of a block knows nothing of the last one of the block before."""
    corner = np.array([30, 14, height])
    rows = [Line([5, y, -3], [55, y, -3.5]) for y in (8, 11)]
    paths = [*rows, Line([20, 14, -4], corner), Line(corner, corner + WAYS[way])]
    seen = []
    for asked in ([(2, [1.0]), (3, [0.0])], [(3, [0.0])]):
        sweeps, edge = Sweeps(PLATE), Edge(tool, bottom=True)
        for path in paths:
            sweeps.add(tool.cutter, path)
        seen.append(
            contact_along(sweeps, [(k, np.array(at)) for k, at in asked], [edge] * len(asked)).columns[-1]
        )
    np.testing.assert_allclose(seen[0], seen[1], rtol=2e-3, atol=2e-3)
