"""Meshes of B-rep solids: they close, hold the volume, and their errors fall as the extrapolation takes them to."""

from __future__ import annotations

from itertools import pairwise
from math import pi
from typing import Any

import numpy as np
import pytest
from manifold3d import Manifold

from vmachining.engines.brep import faceted as module
from vmachining.engines.brep.faceted import SAGS, Lack, Meshed, Plane, Taken, _filled, faceted, limit, taken
from vmachining.engines.brep.measure import volume
from vmachining.errors import EngineError


@pytest.mark.parametrize(("shape", "truth"), [
    (lambda cq: cq.Workplane().sphere(2.0).val(), 4 / 3 * pi * 8),
    (lambda cq: cq.Solid.makeCone(3.0, 0.0, 4.0), pi * 9 * 4 / 3),
    (lambda cq: cq.Solid.makeTorus(1.5, 0.5), 2 * pi**2 * 1.5 * 0.25),
    (lambda cq: cq.Solid.makeBox(1, 2, 3).cut(cq.Solid.makeCylinder(0.3, 3, cq.Vector(0.5, 1, 0))), 6 - pi * 0.27),
])  # fmt: skip
def test_meshes_of_solids_close_and_their_error_falls_with_the_sag(shape: Any, truth: float) -> None:
    """Poles, tips, seams and holes; half of the sag leaves half of the error, and the limit hardly any."""
    import cadquery as cq

    solid = shape(cq).wrapped
    errors = [abs(float(meshed(solid, sag).solid.volume()) / truth - 1.0) for sag in SAGS]
    assert all(0.4 < fine / coarse < 0.6 for coarse, fine in pairwise(errors))
    value, error = limit(lambda sag: [whole(meshed(solid, sag).solid)], 0.0)
    assert abs(value - truth) < 0.2 * error and abs(value / truth - 1.0) < 0.1 * errors[-1]


def meshed(solid: Any, sag: float) -> Meshed:
    return faceted(solid, sag, volume(solid))


def whole(solid: Manifold) -> Taken:
    """All of it is removed."""
    return Taken(*[float(solid.volume()), float(solid.surface_area())] * 2)


def test_errors_that_cancel_are_stated_all_the_same() -> None:
    """What a sweep shares with the stock and what earlier ones have of that hold errors of a like size."""
    own, other = (lambda sag: 10.0 - 9.0 * sag**0.9), (lambda sag: 4.0 - even * 9.0 * sag**1.1)
    ends = SAGS[0], SAGS[2]
    even = (ends[0] ** 0.9 - ends[1] ** 0.9) / (ends[0] ** 1.1 - ends[1] ** 1.1)
    value, error = limit(lambda sag: [Taken(own(sag) - other(sag), 50.0, own(sag), 100.0)], 1.0)
    step = (own(ends[0]) - other(ends[0])) - (own(ends[1]) - other(ends[1]))
    assert abs(step) < 1e-12 < 1e-3 < abs(value - 6.0) < error  # the step alone tells nothing


def test_steps_of_opposite_sign_do_not_make_the_error_small() -> None:
    """Two motions of one block, a convex and a hollow one."""
    parts = [
        lambda sag, sign=sign: Taken(5.0 + sign * sag, 20.0, 9.0 + 7.0 * sign * sag, 20.0) for sign in (-1, 1)
    ]
    _, error = limit(lambda sag: [part(sag) for part in parts], np.inf)
    assert error == pytest.approx(2 * (1.0 + 0.25 * 7.0) * (SAGS[0] - SAGS[2]))


@pytest.mark.parametrize("seen", [0.0, 0.3])
def test_layers_that_meshes_see_in_part_or_not_at_all_may_be_a_sag_thick(seen: float) -> None:
    """A layer of 1e-3 mm on 20 mm^2 of faces."""
    truth = 20.0 * 1e-3
    value, error = limit(lambda sag: [Taken(seen * truth, 20.0 * (seen > 0.0), 9.0, 20.0)], np.inf)
    assert truth - value < error == pytest.approx(20.0 * SAGS[2])


def test_what_an_extrapolated_mesh_misses_of_its_solid_is_stated() -> None:
    """Lacks that fall by the law say nothing; a mesh that lacks no less with a quarter of the sag is bad by what it lacks;
    one that leaves the law by little does so on every face, and only a tenth of them is here."""
    good, bad, usual = (lambda sag: 30.0 * sag), (lambda sag: 0.2), (lambda sag: 0.01 + 30.0 * sag)
    for lacks, miss in (([good] * 3, 0.0), ([good, bad], 0.2), ([bad, bad], 0.2 * 2**0.5), ([usual], 0.001)):
        _, error = limit(
            lambda sag, f=lacks: [Taken(1.0, 1.0, 1.0, 1.0, tuple(Lack(g(sag), 10.0) for g in f))], np.inf
        )  # type: ignore[misc]
        assert error == pytest.approx(miss, abs=1e-12)


def test_meshes_know_what_they_lack() -> None:
    import cadquery as cq

    for sag in SAGS[:2]:
        mesh = meshed(cq.Solid.makeSphere(5.0).wrapped, sag)  # half of one
        (lack,) = mesh.lacks
        assert (
            float(mesh.solid.volume()) + lack.volume == pytest.approx(2 / 3 * pi * 125, rel=1e-9)
            and lack.volume > 0.0
        )


def test_sweeps_that_only_just_touch_the_stock_are_not_taken_for_air() -> None:
    """Their meshes may be apart; boxes that are farther apart than a sag are air."""
    stock = Manifold.cube((4.0, 3.0, 2.0))
    near, far = (stock.translate((1.0, 0.0, 2.0 + gap)) for gap in (1e-3, 1e-1))
    assert taken(Meshed(stock, ()), Meshed(near, ()), []) == Taken(0.0, 0.0, 0.0, 2 * 3.0 * 3.0)
    assert taken(Meshed(stock, ()), Meshed(far, ()), []) == Taken(0.0, 0.0, 0.0, 0.0)


def test_a_mesh_that_does_not_hold_the_volume_is_refused() -> None:
    import cadquery as cq

    with pytest.raises(EngineError, match="triangles hold"):
        faceted(cq.Solid.makeSphere(5.0).wrapped, 1e-3, 500.0)


def test_a_missing_face_is_no_crack(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cube without one of its triangles would hold its volume again, filled."""
    import cadquery as cq

    real = module._triangles

    def lacking(shape: Any, sag: float) -> Any:
        points, triangles, planes = real(shape, sag)
        return points, triangles[1:], planes

    monkeypatch.setattr(module, "_triangles", lacking)
    with pytest.raises(EngineError, match=r"lack 0\.5 mm2"):
        faceted(cq.Solid.makeBox(1, 1, 1).wrapped, 1e-3, 1.0)


def test_cracks_beside_slivers_are_closed() -> None:
    """One face of a tetrahedron has points on two of its edges that its neighbours do not know."""
    whole = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])
    cracked = np.array(
        [(0, 2, 4), (4, 2, 5), (4, 5, 1), *whole[1:].tolist()]
    )  # 4 between 0 and 1, 5 between 1 and 2
    points = np.zeros((6, 3))
    closed, first = _filled(points, cracked, [])
    edges = {(int(t[k]), int(t[(k + 1) % 3])) for t in closed for k in range(3)}
    assert len(edges) == 3 * len(closed) and {(v, u) for u, v in edges} == edges
    assert len(closed) == len(cracked) + 2 and first == len(cracked)
    assert np.array_equal(_filled(points, whole, [])[0], whole)


@pytest.mark.parametrize("lost", [1, 1000], ids=["a triangle", "all of them"])
def test_a_plane_face_that_was_lost_is_filled_from_its_border(
    monkeypatch: pytest.MonkeyPatch, lost: int
) -> None:
    """A round face with a square hole, leaning; OCCT gave faces of fold covers without a tenth of their area, or not at all."""
    import cadquery as cq

    plate = cq.Solid.makeCylinder(3.0, 1.0).cut(cq.Solid.makeBox(2, 2, 3, cq.Vector(-1, -1, -1)))
    solid = plate.rotate(cq.Vector(0, 0, 0), cq.Vector(1, 2, 3), 77.0).wrapped
    whole, sag = meshed(solid, 2e-3).solid, 2e-3
    real, done = Plane.is_covered, list[bool]()

    def spoilt(plane: Plane, corners: Any) -> bool:
        assert real(plane, corners)
        if done or len(corners) < 10:  # the walls of the hole have two
            return True
        done.append(real(plane, corners[lost:]))
        return done[0]

    monkeypatch.setattr(Plane, "is_covered", spoilt)
    filled = meshed(solid, sag).solid
    assert done == [False]
    assert float(filled.volume()) == pytest.approx(float(whole.volume()), rel=1e-9)
    assert abs(float(filled.volume()) - (9 * pi - 4)) < 2 * pi * 3 * sag and filled.genus() == 1


def test_a_plane_face_is_not_filled_from_the_border_of_something_else() -> None:
    """A tetrahedron without its bottom of 1/2 mm2: filled if that is what lacks, refused if a larger face does."""
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
    open_ = np.array([(0, 1, 3), (1, 2, 3), (2, 0, 3)])
    down = np.array([(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)])
    closed, first = _filled(points, open_, [Plane(down, 0.0, 0.5, 1e-3)])
    assert first == len(closed) == 4 and sorted(closed[3].tolist()) == [0, 1, 2]
    assert np.linalg.det(points[closed]).sum() / 6.0 == pytest.approx(1.0 / 6.0)
    for elsewhere in (Plane(down, 0.0, 0.6, 1e-3), Plane(down, 0.1, 0.5, 1e-3)):
        with pytest.raises(EngineError, match="has another border"):
            _filled(points, open_, [elsewhere])
