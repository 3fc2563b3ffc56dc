"""The explicit envelope profiles of toroidal and cylindrical cutters, by name and number.

Symbols of the source: E centre of the torus (a point of the axis), e1 tool axis, V_E velocity of E, omega
angular velocity of the axis, R1 offset of the tube from the axis, R2 its radius; u angle about the axis from
e2 towards e3; v angle of the normal on the corner, 0 at the bottom disc, pi / 2 at the cylinder; k height
above E on the cylinder.

Source: Weinert, Du, Damm, Stautner, Swept volume generation for the simulation of machining processes, Int.
J. Mach. Tools Manuf. 44 (2004) 617-628, with the numbers of its account in Hendriko's textbook on five-axis
milling, chapter 3 (eq. 3-n). Where that text is wrong the corrected equation stands here and the docstring
says so. All of it is the grazing condition of `grazing/` on two surfaces; the envelopes of the
B-rep engine take `torus_terms` and `torus_angle`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import SweepError
from vmachining.sweep.turning import LETTERS

TINY = 1e-14
"""Relative size below which a vector has no direction."""


class Frame(NamedTuple):
    """e1, e2, e3 (3,), right-handed; e1 is the tool axis."""

    e1: Floats
    e2: Floats
    e3: Floats


def moving_frame(axis: ArrayLike, rate: ArrayLike, velocity: ArrayLike) -> Frame:
    """Frame of eq. 3-2 where the axis turns, of eq. 3-3 (corrected) where it does not.

    3-2: e2 along dA/dt, e3 = e1 x e2, so that omega = |dA/dt| e3 without spin. 3-3 is printed as a copy of
    3-2; what 3-19 needs is e3 along A x V_E and e2 = e3 x e1, so that e3 . V_E = 0 and e2 . V_E > 0. Where V_E
    is along the axis too, any frame will do.
    """
    e1, d, v = (rows(x, 3, name=n) for x, n in ((axis, "axis"), (rate, "rate"), (velocity, "velocity")))
    size = float(np.linalg.norm(d))
    if size > 0.0:
        e2 = d / size
        return Frame(e1, e2, np.cross(e1, e2))
    side = np.cross(e1, v)
    if float(np.linalg.norm(side)) <= TINY * float(np.linalg.norm(v)):
        side = np.cross(e1, np.eye(3)[int(np.argmin(np.abs(e1)))])
    e3 = side / np.linalg.norm(side)
    return Frame(e1, np.cross(e3, e1), e3)


def angular_velocity(chain: str, angles: ArrayLike, rates: ArrayLike) -> Floats:
    """(3,) rad per unit of time of the tool; angles and rates in the order of the letters of the chain.

    Raises SweepError: Unknown chain.

    "ac" is eq. 3-9. "hexa" is eq. 3-11 corrected: (cos c a' - sin c sin a c', sin c a' + cos c sin a c',
    (1 - cos a) c'); the printed signs and factors belong to no rotation. The two differ by the spin -c' A,
    which sweeps nothing.
    """
    if chain not in LETTERS:
        raise SweepError(f"unknown rotary chain {chain!r}", remedy=f"take one of {', '.join(LETTERS)}")
    first, second = (float(x) for x in rows(angles, 2, name="angles"))
    d1, d2 = (float(x) for x in rows(rates, 2, name="rates"))
    s1, s2, c2 = np.sin(first), np.sin(second), np.cos(second)
    if chain == "ac":
        return np.array([c2 * d1, s2 * d1, d2])
    if chain == "hexa":
        return np.array([c2 * d1 - s2 * s1 * d2, s2 * d1 + c2 * s1 * d2, (1.0 - np.cos(first)) * d2])
    if chain == "bc":
        return np.array([-s2 * d1, c2 * d1, d2])
    return np.array([d1, np.cos(first) * d2, s1 * d2])  # Rx(a) Ry(b)


def axis_rate(axis: ArrayLike, omega: ArrayLike) -> Floats:
    """(3,) dA/dt = omega x A."""
    return np.cross(rows(omega, 3, name="omega"), rows(axis, 3, name="axis"))


def torus_normal_speed(
    u: ArrayLike, v: ArrayLike, *, axis: ArrayLike, velocity: ArrayLike, rate: ArrayLike, R1: float
) -> Floats:
    """Eq. 3-15: N . V_P on the corner, mm per unit of time. It does not depend on R2.

    sin v D(u) - cos v num(u) with num = e1 . V_E - R1 |dA/dt| cos u and D = e2 . V_E cos u + e3 . V_E sin u.
    The text after 3-14 says V_P = V_E; only the part with R2 falls out, the part with R1 stays.
    """
    num, den = _parts(u, axis, velocity, rate, R1)
    angle = np.asarray(v, dtype=np.float64)
    return np.asarray(np.sin(angle) * den - np.cos(angle) * num)


def torus_profile(
    u: ArrayLike, *, axis: ArrayLike, velocity: ArrayLike, rate: ArrayLike, R1: float
) -> Floats:
    """Eq. 3-16: v(u) in [0, pi / 2] of the grazing point of the corner, NaN where none exists.

    u : (...,) rad, from e2 towards e3 of `moving_frame`.
    axis, velocity, rate : (3,) e1, V_E of the torus centre, dA/dt.
    R1 : mm.

    tan v = num / D; the valid angles are those where both have one sign, in every motion. That replaces the
    half chosen by the angle to the vertical (3-33), which holds for horizontal motions without turning only,
    and the range u_t <= u <= u_t + pi of 3-16, which needs a numerator of one sign. Contained:
    3-19 (no turning), 3-24 (corrected sign: e1 . V_E = 0), the circle tan v = -R1 |dA/dt| / e2 . V_E of the
    corrected 3-21 (e3 . V_E = 0 and e1 . V_E = 0). Where num and D vanish together all v graze: NaN.
    """
    num, den = _parts(u, axis, velocity, rate, R1)
    both = (num * den >= 0.0) & ((num != 0.0) | (den != 0.0))
    return np.where(both, np.arctan2(np.abs(num), np.abs(den)), np.nan)


def torus_arcs(
    *, axis: ArrayLike, velocity: ArrayLike, rate: ArrayLike, R1: float
) -> list[tuple[float, float]]:
    """Intervals (lo, hi) of u, rad, in which `torus_profile` is defined; hi may exceed pi.

    The ends are the zeros of D (eq. 3-17: tan u_t = -e2 . V_E / e3 . V_E, two roots pi apart; there v = pi / 2
    and the cylinder continues) and those of num (cos u = e1 . V_E / (R1 |dA/dt|); there v = 0 and the chord of
    the bottom disc continues). Without the latter one arc of length pi; with them two arcs.
    """
    frame = moving_frame(axis, rate, velocity)
    V, size = rows(velocity, 3, name="velocity"), float(np.linalg.norm(rows(rate, 3, name="rate")))
    lift, side = float(frame.e1 @ V), (float(frame.e2 @ V), float(frame.e3 @ V))
    cuts = []
    if np.hypot(*side) > 0.0:
        turn = float(np.arctan2(-side[0], side[1]))
        cuts += [turn, turn + np.pi]
    if R1 * size > 0.0 and abs(lift) <= R1 * size:
        zero = float(np.arccos(lift / (R1 * size)))
        cuts += [zero, -zero]
    cuts = sorted({(c + np.pi) % (2.0 * np.pi) - np.pi for c in cuts})
    if not cuts:
        return []
    out: list[tuple[float, float]] = []
    for lo, hi in zip(cuts, [*cuts[1:], cuts[0] + 2.0 * np.pi], strict=True):
        middle = torus_profile(0.5 * (lo + hi), axis=axis, velocity=velocity, rate=rate, R1=R1)
        if not np.isnan(middle):
            out.append((lo, hi))
    return out


def cylinder_angles(k: ArrayLike, *, axis: ArrayLike, velocity: ArrayLike, rate: ArrayLike) -> Floats:
    """Eq. 3-32 corrected: (..., 2) rad, the two grazing angles on the cylinder, pi apart.

    k : (...,) mm above E, along the axis.

    u = atan2(-(e2 . V_E + k |dA/dt|), e3 . V_E) and u + pi (printed without the minus, and as one root). At
    k = 0 it meets 3-17. NaN where the axis point at k stands still across the axis: all angles graze.
    """
    frame = moving_frame(axis, rate, velocity)
    V, size = rows(velocity, 3, name="velocity"), float(np.linalg.norm(rows(rate, 3, name="rate")))
    first = float(frame.e2 @ V) + np.asarray(k, dtype=np.float64) * size
    second = np.broadcast_to(float(frame.e3 @ V), first.shape)
    u = np.where((first == 0.0) & (second == 0.0), np.nan, np.arctan2(-first, second))
    return np.stack([u, u + np.pi], axis=-1)


def torus_terms(
    m: Floats, *, axis: Floats, velocity: Floats, rate: Floats, R1: float
) -> tuple[Floats, Floats]:
    """num and D of eq. 3-15 along radial directions.

    m : (..., 3) unit, square to the axis. axis, velocity, rate : (..., 3) that broadcast against it: e1, V_E, dA/dt.

    num = e1 . V_E - R1 m . dA/dt and D = m . V_E, so the normal speed at the angle v is sin v D - cos v num; in the frame
    of the source m = e2 cos u + e3 sin u and m . dA/dt = |dA/dt| cos u. Any direction of the frame will do.
    """
    num = (axis * velocity).sum(-1) - R1 * (m * rate).sum(-1)
    return np.asarray(num), np.asarray((m * velocity).sum(-1))


def torus_angle(num: Floats, D: Floats, middle: float) -> Floats:
    """Eq. 3-16 on any arc of a meridian: the normal angle v of the grazing point within pi / 2 of `middle`, rad.

    tan v = num / D has two roots half a turn apart; measured from the middle of the arc, rounding at its ends does not
    choose between them.
    """
    along, aside = D * np.cos(middle) + num * np.sin(middle), num * np.cos(middle) - D * np.sin(middle)
    sign = np.where(along < 0.0, -1.0, 1.0)
    return np.asarray(middle + np.arctan2(sign * aside, sign * along))


def _parts(
    u: ArrayLike, axis: ArrayLike, velocity: ArrayLike, rate: ArrayLike, R1: float
) -> tuple[Floats, Floats]:
    """num and D at angles u of the moving frame."""
    frame = moving_frame(axis, rate, velocity)
    angle = np.asarray(u, dtype=np.float64)[..., None]
    m = np.cos(angle) * frame.e2 + np.sin(angle) * frame.e3
    given = {
        name: np.asarray(v, dtype=np.float64)
        for name, v in (("axis", axis), ("velocity", velocity), ("rate", rate))
    }
    return torus_terms(m, **given, R1=R1)
