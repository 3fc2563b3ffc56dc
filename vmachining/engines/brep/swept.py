"""`solid`: the swept volume of one block as a valid B-rep solid."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.envelopes.decomposition import POSES, Budget, Makers, Soft, decomposed
from vmachining.engines.brep.envelopes.fixed_axis import FixedAxis, halves
from vmachining.engines.brep.envelopes.pieces import Piece, turn_pieces
from vmachining.engines.brep.envelopes.pockets import pockets
from vmachining.engines.brep.occt.primitives import rotated
from vmachining.engines.brep.occt.tolerances import LEVEL_MM, MISS_MM, SHEET_FIT_MM, SWEPT_REL
from vmachining.engines.brep.occt.validity import Inspection, inspect
from vmachining.engines.brep.translations.caps import UP
from vmachining.engines.brep.translations.front import front
from vmachining.engines.brep.translations.guides import HelixGuide, LineGuide
from vmachining.engines.brep.translations.level import bent_guide, level, straight_guide
from vmachining.engines.brep.translations.ramp import ramp
from vmachining.engines.brep.translations.upright import plunged, ring
from vmachining.errors import EngineError, SweepError
from vmachining.geometry import Arc, Line
from vmachining.numerics.series import Series
from vmachining.sweep import Sweep, Turn, swept_volume
from vmachining.sweep.folds import standing
from vmachining.sweep.rotating import arc_series
from vmachining.tool import Profile, convex_cover

MOST_BENT = 0.95 * np.pi
"""rad: beyond this, an arc whose inner side ends in a point on its axis is swept as two."""

MOST_WOUND = 1.01 * np.pi
"""rad: turn of a helix whose front is one solid; a full turn is two."""


class Swept(NamedTuple):
    """shape : TopoDS_Solid. fit_mm : largest distance of its splines from the true surface, 0 without any.

    report : what OCCT says of the shape.
    """

    shape: Any
    fit_mm: float
    report: Inspection


def solid(sweep: Sweep, *, fit_mm: float = SHEET_FIT_MM) -> Any:
    """The sweep of one block as one `cadquery.Solid`.

    fit_mm : largest distance asked of the spline sheets of a tool that turns; `solids` tells what was reached.

    Raises SweepError: A sweep that is not a single solid here, or that this engine cannot build; says why.
    Raises EngineError: OCCT does not accept the solid, or its volume differs from the closed form (1e-6 relative, 1e-5
        with spline faces).

    Faces are planes, cylinders, cones, spheres, tori, and oblique extrusions of circles (a sharp edge on a
    ramp). Ramps of a torus and helices have quintic spline faces within 1e-7 mm of the truth, tools that turn
    within `fit_mm`.
    """
    parts = solids(sweep, fit_mm=fit_mm)
    if len(parts) != 1:
        raise SweepError(
            f"this sweep is a union of {len(parts)} solids", remedy="take engines.brep.solids(sweep)"
        )
    exact = None if isinstance(sweep.path, Turn) and sweep.upright() is None else sweep.volume
    if exact is not None:
        found = parts[0].report.volume
        if abs(found - exact) > SWEPT_REL[parts[0].fit_mm > 0.0] * exact:
            raise EngineError(f"solid of {found:.9g} mm3, the closed form is {exact:.9g}", engine="brep")
    return _cadquery().Solid(parts[0].shape)


def _cadquery() -> Any:
    try:
        import cadquery
    except ImportError as exc:  # missing, or its OCP was overwritten by the build without VTK
        raise EngineError(
            f"cadquery cannot be imported ({exc}); install 'vmachining[cadquery]', with the OCP build of cadquery last: "
            "see the page on installation; engines.brep.solids(sweep) gives the shapes without it",
            engine="brep",
        ) from exc
    return cadquery


def solids(sweep: Sweep, *, fit_mm: float = SHEET_FIT_MM, miss_mm: float = MISS_MM) -> list[Swept]:
    """Solids whose union is the sweep: mostly one.

    Several for arcs that come back to themselves or turn by more than about half a turn around an axis inside
    the tool, for helices that reach a point twice or have their axis in the tool, for cutters that are not
    convex on a ramp or while they turn, and for blocks during which the grazing curve of a turning tool changes
    its shape.

    miss_mm : by how much sheets of a turning tool may miss the truth where they do not come within `fit_mm`, and what may be
        missing between its parts; above `MISS_MM` the solids say so in their `fit_mm`.

    Raises SweepError: A turning tool, or one on an arc about x or y, whose envelope folds inside the sweep or whose
        grazing curve has a shape without solid (`pieces.py`).
    Raises EngineError: OCCT does not accept a solid, or one of a turning tool is off the volume of the flux identity by
        1e-5.
    """
    known = sweep.upright()
    if isinstance(sweep.path, Arc) and sweep.path.axis != 2 and sweep.path.angle * sweep.path.radius != 0.0:
        return _turning(sweep.profile, _carried(sweep.path), fit_mm, miss_mm)
    if known is None and isinstance(sweep.path, Turn):
        return _turning(sweep.profile, sweep.path, fit_mm, miss_mm)
    path = known[0].path if known is not None else None
    if known is None or not isinstance(path, (Line, Arc)):
        raise SweepError("the B-rep engine has no solid for this motion")
    standing, frame = known
    found = []
    for piece in _pieces(standing.profile, path):
        for shape, error in _built(*piece):
            moved = shape if np.array_equal(frame, np.eye(3)) else rotated(shape, frame.T)
            found.append(_inspected(moved, error))
    return found


def _inspected(shape: Any, fit_mm: float) -> Swept:
    """With what OCCT says; an error if it is not valid, closed and the right way round."""
    report = inspect(shape)
    if not (report.valid and report.closed and report.volume > 0.0):
        what = "valid" if not report.valid else "closed" if not report.closed else "the right way round"
        raise EngineError(f"OCCT says the swept solid is not {what}", engine="brep")
    return Swept(shape, fit_mm, report)


def _carried(path: Arc) -> Turn:
    """An arc about x or y as its own motion: its grazing curve changes along the way."""
    return Turn(path.position(0.0), path.position(1.0), arc_series(path), Series.constant(UP))


def _turning(profile: Profile, path: Turn, fit_mm: float, miss_mm: float) -> list[Swept]:
    """Solids of a turning tool, each of the volume that the flux through its front gives."""
    try:
        return [part for body in convex_cover(profile) for part in _convex(body, path, fit_mm, miss_mm)]
    except (SweepError, EngineError) as error:
        error.remedy = error.remedy or "split the block"
        raise


def _convex(profile: Profile, path: Turn, fit_mm: float, miss_mm: float) -> list[Swept]:
    """The same of a convex one."""
    budget = Budget()
    loose = miss_mm if miss_mm > MISS_MM else 0.0

    def build(body: Profile, part: Turn, off_mm: float, soft: Soft) -> list[Swept]:
        if part.is_steady and part.is_straight:  # a pose; arcs in upright planes are steady, too
            return [s._replace(fit_mm=max(s.fit_mm, loose)) for s in solids(Sweep.along(body, part))]
        pieces = turn_pieces(body, part, fit_mm, budget.take, loose_mm=loose, soft=soft)
        return [_gated(piece, piece.sweep.flux().volume, off_mm) for piece in pieces]

    def filled(
        body: Profile, whole: Turn, span: tuple[float, float], off_mm: float, soft: Soft
    ) -> list[Swept]:
        part = whole.part(*span)
        for pocket in pockets(body, part):
            count = pocket.poses(body, whole, span, miss_mm, POSES)
            if count is None:
                continue
            pieces = turn_pieces(body, part, fit_mm, budget.take, loose_mm=loose, soft=soft, filled=pocket)
            found = []
            for piece in pieces:
                flux = piece.sweep.flux()
                assert isinstance(piece.sweep.path, Turn)
                exact = flux.body + flux.flux + pocket.flux(body, piece.sweep.path)
                found.append(_gated(piece, exact, off_mm))
            for k in range(count + 1):
                found += build(body, standing(part, k / count), off_mm, soft)
            return found
        return []

    return decomposed(profile, path, Makers(build, _about_fixed_axis, filled, budget), miss_mm)


def _gated(piece: Piece, exact: float, off_mm: float) -> Swept:
    """A solid that the grazing curve draws, of the volume that it must have."""
    found = _inspected(piece.built.builder.solid(), piece.built.fit_mm + off_mm)
    volume = found.report.volume
    if abs(volume - exact) > SWEPT_REL[True] * exact:
        raise EngineError(
            f"swept solid of {volume:.9g} mm3, the flux identity gives {exact:.9g}", engine="brep"
        )
    return found


def _about_fixed_axis(profile: Profile, path: Turn, most_mm: float, off_mm: float) -> list[Swept]:
    """Halves of a tool that turns about a line through its axis that moves by less than `most_mm`; none of others."""
    about = FixedAxis.of(path, most_mm)
    found: list[Swept] = []
    if about is None:
        return found
    try:
        for build, exact in halves(profile, about):
            half = _inspected(build.solid(), about.off_mm + off_mm)
            if abs(half.report.volume - exact) > SWEPT_REL[False] * exact:
                raise EngineError(
                    f"half of {half.report.volume:.9g} mm3, its flux gives {exact:.9g}", engine="brep"
                )
            found.append(half)
    except (SweepError, EngineError):
        return []
    return found


def _pieces(profile: Profile, path: Line | Arc) -> list[tuple[Profile, Line | Arc]]:
    """Parts of tool and path of which each is one solid."""
    if isinstance(path, Arc) and (path.angle == 0.0 or path.radius == 0.0):
        path = Line(path.start, path.end)
    if isinstance(path, Line):
        travel = path.end - path.start
        upright = np.hypot(travel[0], travel[1]) < LEVEL_MM
        if abs(travel[2]) < LEVEL_MM or (upright and profile.is_unimodal) or profile.is_convex:
            return [(profile, path)]
        return [(piece, path) for piece in convex_cover(profile)]
    if abs(path.rise) < LEVEL_MM:
        return [(profile, piece) for piece in _level_parts(profile, path)]
    found: list[tuple[Profile, Line | Arc]] = []
    for part in convex_cover(profile):
        found += [(part, piece) for piece in _helix_parts(part, path) or [path]]
    return found


def _level_parts(profile: Profile, path: Arc) -> list[Arc]:
    """A level arc as it is, or its halves."""
    rc, theta = path.radius, abs(path.angle)
    if theta >= 2.0 * np.pi - 1e-9:
        return [path]
    radii = profile.points[:, 0]
    narrow = radii[radii <= rc + LEVEL_MM]
    if not len(narrow):
        return [path]
    pointed = profile.max_radius >= rc - LEVEL_MM
    meets = theta + 2.0 * np.arcsin(min(narrow.max() / rc, 1.0)) > 2.0 * np.pi - 1e-6
    if theta > MOST_BENT and (pointed or meets):
        return [part for half in path.split([0.5]) for part in _level_parts(profile, half)]
    return [path]


def _helix_parts(profile: Profile, path: Arc) -> list[Arc] | None:
    """Equal pieces of a helix that enter no point twice; None if none exist, or too many."""
    for count in (1, 2):
        pieces = path.split([k / count for k in range(1, count)])
        if path.radius > profile.max_radius and swept_volume(profile, pieces[0]) is not None:
            return list(pieces)
    return None


def _wound(profile: Profile, path: Arc) -> list[tuple[Any, float]]:
    """The cutter where it stands lowest, and what its front passes from there; as `_built`."""
    count = int(np.ceil(abs(path.angle) / MOST_WOUND))
    lowest = np.array(path.start if path.rise > 0.0 else path.end)
    found = [(plunged(profile, lowest), 0.0)]
    for piece in path.split([k / count for k in range(1, count)]):
        build, error = front(profile, piece)
        found.append((build.solid(), error))
    return found


def _built(profile: Profile, path: Line | Arc) -> list[tuple[Any, float]]:
    """Solids of one piece, each with how far (mm) its splines are off."""
    if isinstance(path, Arc):
        if abs(path.rise) >= LEVEL_MM:
            if path.radius <= profile.max_radius or swept_volume(profile, path) is None:
                return _wound(profile, path)
            build, error = ramp(profile, HelixGuide(path))
            return [(build.solid(), error)]
        flat = path if path.rise == 0.0 else _at_rest(path)
        if abs(flat.angle) >= 2.0 * np.pi - 1e-9:
            return [(ring(profile, np.array(flat.center), flat.radius), 0.0)]
        forward = flat if flat.angle > 0.0 else Arc(flat.end, flat.center, 2, angle=-flat.angle)
        return [(level(profile, bent_guide(forward)).solid(), 0.0)]
    travel = path.end - path.start
    if np.hypot(travel[0], travel[1]) < LEVEL_MM:
        center = 0.5 * (path.start + path.end)
        center[2] = path.start[2]
        body = profile.extruded(float(travel[2])) if travel[2] != 0.0 else profile
        return [(plunged(body, center), 0.0)]
    if abs(travel[2]) < LEVEL_MM:
        height = 0.5 * float(path.start[2] + path.end[2])
        return [(level(profile, straight_guide(path, height)).solid(), 0.0)]
    build, error = ramp(profile, LineGuide(path))
    return [(build.solid(), error)]


def _at_rest(path: Arc) -> Arc:
    """A level arc at the mean height."""
    start: Floats = np.array(path.start)
    start[2] += 0.5 * path.rise
    return Arc(start, path.center, 2, angle=path.angle)
