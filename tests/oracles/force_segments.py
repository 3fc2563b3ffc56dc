"""The mechanistic model piece by piece, as functions of plain numbers and arrays.

Symbols: phi rotation angle in the tool frame, from +y to +x (clockwise seen from the spindle). lam elevation of the
normal: 0 at the bottom, pi/2 on the cylinder. chi helix angle. h chip thickness, mm. dL length of a segment, mm.
Axes of a force: x, y, z of the tool frame, z along the tool axis to the spindle. Angles in rad.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engagement.chip import elevation, height, radius
from vmachining.errors import InputError

Convention = Literal["tool", "workpiece", "book"]


class Segments(NamedTuple):
    """Segments of intervals, each (..., k * segments): lam rad, length mm, height z and radius rho of the middle, mm."""

    lam: Floats
    length: Floats
    z: Floats
    rho: Floats


def edge_segments(lower: ArrayLike, upper: ArrayLike, rm: float, r: float, segments: int = 20) -> Segments:
    """Equal segments of engaged intervals [..., interval], 7-3 put right: lam_i = lam_c + dlam (i - 1/2).

    lower, upper : s of `vmachining.engagement.chip`, mm, each interval within one piece; NaN where none exists.
    """
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    if segments < 1:
        raise InputError(f"{segments} segments: expected at least 1")
    share = (np.arange(segments) + 0.5) / segments
    s = low[..., None] + (high - low)[..., None] * share
    length = np.broadcast_to((high - low)[..., None] / segments, s.shape)
    flat = s.reshape(*s.shape[:-2], -1)
    return Segments(
        np.where(flat < 0.0, 0.0, elevation(flat, r)),
        length.reshape(flat.shape),
        height(flat, r),
        radius(flat, rm, r),
    )


def elemental_forces(h: ArrayLike, length: ArrayLike, k: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """F_t, F_r, F_a (...,) N of segments: (K_qc h + K_qe) dL; none where h is 0 (7-1).

    k : (6, ...) Ktc, Krc, Kac in N/mm^2 and Kte, Kre, Kae in N/mm, as `Coefficients.at` gives.
    """
    thick, size, values = np.asarray(h, dtype=np.float64), np.asarray(length, dtype=np.float64), np.asarray(k)
    cuts = thick > 0.0
    f_t, f_r, f_a = (np.where(cuts, (values[q] * thick + values[q + 3]) * size, 0.0) for q in range(3))
    return np.asarray(f_t), np.asarray(f_r), np.asarray(f_a)


def direction_matrix(phi: ArrayLike, lam: ArrayLike, chi: float = 0.0) -> Floats:
    """(..., 3, 3) M_F = Rz(-phi) Ry(-chi) Rx(lam) (7-5, 7-6 with A13 and A23 put right): a rotation.

    At chi = 0 its columns are the cutting direction e_t, the tangent of the profile with rising lam, and -N.
    """
    p, lm = np.broadcast_arrays(np.asarray(phi, dtype=np.float64), np.asarray(lam, dtype=np.float64))
    sp, cp, sl, cl, sc, cc = np.sin(p), np.cos(p), np.sin(lm), np.cos(lm), np.sin(chi), np.cos(chi)
    rows = (
        (cp * cc, -cp * sc * sl + sp * cl, -cp * sc * cl - sp * sl),
        (-sp * cc, sp * sc * sl + cp * cl, sp * sc * cl - cp * sl),
        (np.full_like(sp, sc), cc * sl, cc * cl),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def printed_direction_matrix(phi: ArrayLike, lam: ArrayLike, chi: float = 0.0) -> Floats:
    """(..., 3, 3) the matrix as printed, for the record: det = cos 2 lam, singular at 45 degrees."""
    p, lm = np.broadcast_arrays(np.asarray(phi, dtype=np.float64), np.asarray(lam, dtype=np.float64))
    out = direction_matrix(p, lm, chi)
    sl = np.sin(lm)
    out[..., 0, 2] += 2.0 * np.sin(p) * sl
    out[..., 1, 2] += 2.0 * np.cos(p) * sl
    return out


def force_on(
    f_t: ArrayLike,
    f_r: ArrayLike,
    f_a: ArrayLike,
    phi: ArrayLike,
    lam: ArrayLike,
    chi: float = 0.0,
    *,
    convention: Convention = "tool",
) -> Floats:
    """(..., 3) N of segments in the tool frame.

    "tool": -F_t c1 - F_a c2 + F_r c3, on the tool. "workpiece": the reaction. "book": M_F (F_t, F_r, F_a) as the source
    multiplies, with the matrix put right; it puts the radial force along the axis of the cylinder.
    """
    m = direction_matrix(phi, lam, chi)
    t, r, a = (np.asarray(v, dtype=np.float64)[..., None] for v in (f_t, f_r, f_a))
    if convention == "book":
        return np.asarray(t * m[..., 0] + r * m[..., 1] + a * m[..., 2])
    if convention not in ("tool", "workpiece"):
        raise InputError(f"unknown convention {convention!r}", remedy="tool, workpiece or book")
    on_tool = -t * m[..., 0] - a * m[..., 1] + r * m[..., 2]
    return np.asarray(on_tool if convention == "tool" else -on_tool)
