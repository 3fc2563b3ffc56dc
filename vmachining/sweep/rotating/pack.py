"""A body and a motion as the kernels take them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.geometry import Arc
from vmachining.numerics.series import Amplitudes, Series, bounds
from vmachining.sweep.bounds import reaches
from vmachining.tool import Profile

ULPS = 16
"""Rounding of a distance in ulp of the extent of the sweep: a dozen operations on its coordinates."""

SAME = 1e-14
"""Tangent planes whose normals differ by less are one."""

CELLS = 256
"""Samples of a rate; what lies between them is bounded by the next derivative."""


class Packed(NamedTuple):
    """Columns of `_kernels.py`, see the legend there."""

    seg: Floats
    planes: Floats
    arcs: Floats
    ends: Ints
    limits: Floats
    waves: Floats
    tol: float


def pack(pieces: Sequence[Profile], tip: Series, axis: Series, origin: Floats) -> Packed:
    """Rows of the kernels; `origin` is taken off the tip, so that coordinates stay small."""
    seg: list[Floats] = []
    planes: list[Floats] = []
    arcs: list[Floats] = []
    ends = [(0, 0, 0)]
    for piece in pieces:
        seg.append(meridian_rows(piece))
        planes.append(_planes(piece))
        arcs.append(_arcs(piece))
        i, j, k = ends[-1]
        ends.append((i + len(planes[-1]), j + len(arcs[-1]), k + len(seg[-1])))
    local = tip + Series.constant(-origin)
    limits = np.array([_limits(piece, local, axis) for piece in pieces])
    extent = max(float(np.abs(np.concatenate(seg)[:, :4]).max()), local.bound(0))
    tol = max(ULPS * float(np.finfo(float).eps) * extent, 1e-14)
    return Packed(
        np.concatenate(seg), np.concatenate(planes), np.concatenate(arcs), np.array(ends), limits,
        waves_of(local, axis), tol,
    )  # fmt: skip


def arc_series(arc: Arc) -> Series:
    """Tip of a circle or helix."""
    arm, normal = arc.start - arc.center, np.eye(3)[arc.axis]
    side = np.copysign(1.0, arc.angle) * np.cross(normal, arm)
    terms = np.zeros((2, 2, 3), dtype=complex)
    terms[0, 0], terms[0, 1], terms[1, 0] = arc.center, arc.rise * normal, arm - 1j * side
    return Series(np.array([0.0, abs(arc.angle)]), terms)


def meridian_rows(piece: Profile) -> Floats:
    """(k, 10) segments of one convex meridian, with its discs."""
    out = []
    r, z = piece.points[0]
    if r > 0:
        out.append((0.0, z, r, z, 0.0, 0.0, 0.0, 0.0, -1.0, r))
    for s in piece.segments:
        middle = 0.5 * sum(s.beta)
        length = float(np.hypot(s.r1 - s.r0, s.z1 - s.z0))
        center = (s.cr, s.cz) if s.is_arc else (0.0, 0.0)
        out.append((*s[:4], *center, s.radius, float(np.cos(middle)), float(np.sin(middle)), length))
    r, z = piece.points[-1]
    if r > 0:
        out.append((r, z, 0.0, z, 0.0, 0.0, 0.0, 0.0, 1.0, r))
    return np.array(out, dtype=np.float64)


def _planes(piece: Profile) -> Floats:
    """(k, 3) n_r, n_z, d: discs, cones, and the tangents at the ends of arcs."""
    found = [(0.0, -1.0, -piece.z_min), (0.0, 1.0, piece.z_max)]
    for s in piece.segments:
        if s.is_arc:
            ends = [((s.r0 - s.cr) / s.radius, (s.z0 - s.cz) / s.radius, s.r0, s.z0),
                    ((s.r1 - s.cr) / s.radius, (s.z1 - s.cz) / s.radius, s.r1, s.z1)]  # fmt: skip
        else:
            length = float(np.hypot(s.r1 - s.r0, s.z1 - s.z0))
            ends = [((s.z1 - s.z0) / length, (s.r0 - s.r1) / length, s.r0, s.z0)]
        for n_r, n_z, r, z in ends:
            out = 0.0 if abs(n_r) < SAME else float(n_r)
            found.append((out, float(np.copysign(1.0, n_z)) if out == 0.0 else float(n_z), out * r + n_z * z))
    kept: list[tuple[float, float, float]] = []
    for row in found:
        if not any(
            max(abs(row[0] - k[0]), abs(row[1] - k[1])) < SAME and row[2] >= k[2] - 1e-12 for k in kept
        ):
            kept.append(row)
    return np.array(kept)


def _arcs(piece: Profile) -> Floats:
    """(j, 7) centre, radius, normals at both ends."""
    rows = [
        (s.cr, s.cz, s.radius, (s.r0 - s.cr) / s.radius, (s.z0 - s.cz) / s.radius,
         (s.r1 - s.cr) / s.radius, (s.z1 - s.cz) / s.radius)
        for s in piece.segments if s.is_arc
    ]  # fmt: skip
    return np.array(rows).reshape(-1, 7)


def _limits(piece: Profile, tip: Series, axis: Series) -> tuple[float, ...]:
    """Reference height with the smallest bend, and its bounds."""
    turn, bend = rate_bound(axis, 1), axis.bound(2)
    rise = -1.0
    if turn == 0.0:  # the only acceleration along a steady axis
        along = axis.at(0.0)
        rise = Series(tip.frequencies, (tip.terms @ along)[..., None]).bound(2)
    heights = np.linspace(piece.z_min, piece.z_max, 9)
    frequencies, at, of = _together(tip, axis)
    terms = at + heights[:, None, None, None] * of
    far, rush = reaches(piece, heights), bounds(frequencies, terms, 2)
    middle = (np.arange(CELLS) + 0.5) / CELLS
    moves = tip.at(middle, 1) + heights[:, None, None] * axis.at(middle, 1)
    seen = np.linalg.norm(moves, axis=2).max(axis=1)
    speed = np.minimum(seen + rush / (2.0 * CELLS), bounds(frequencies, terms, 1))
    k = int(np.argmin(rush + 2.0 * turn * speed + (bend + turn**2) * far))
    return float(heights[k]), float(far[k]), float(speed[k]), float(rush[k]), turn, bend, rise


def _together(tip: Series, axis: Series) -> tuple[Floats, Amplitudes, Amplitudes]:
    """Common frequencies (m,), and terms (m, 2, 3) of both."""
    frequencies = np.union1d(tip.frequencies, axis.frequencies)
    out = np.zeros((2, len(frequencies), 2, 3), dtype=complex)
    for k, series in enumerate((tip, axis)):
        out[k, np.searchsorted(frequencies, series.frequencies)] = series.terms
    return frequencies, out[0], out[1]


def rate_bound(series: Series, derivative: int) -> float:
    """Upper bound of the length of a derivative: samples plus half a cell of the next one."""
    middle = (np.arange(CELLS) + 0.5) / CELLS
    seen = float(np.linalg.norm(series.at(middle, derivative), axis=1).max())
    return min(seen + series.bound(derivative + 1) / (2.0 * CELLS), series.bound(derivative))


def waves_of(tip: Series, axis: Series) -> Floats:
    """(m, 19), tip and axis by common frequency."""
    rows: dict[float, Floats] = {}
    for series, at in ((tip, 1), (axis, 13)):
        for w, z in zip(series.frequencies.tolist(), series.terms, strict=True):
            own = np.concatenate([z[0].real, z[0].imag, z[1].real, z[1].imag])
            rows.setdefault(w, np.zeros(19))[at : at + 12] += own[: 19 - at]
    for w, row in rows.items():
        row[0] = w
    return np.array(list(rows.values()))
