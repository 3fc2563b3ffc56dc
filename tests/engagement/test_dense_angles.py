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
