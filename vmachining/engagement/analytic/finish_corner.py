"""Finish passes with a corner: the published stages at three rotation angles and their interpolation, corrected.

| function | is |
|---|---|
| `end_place` | on which piece the edge leaves the material, by vertical distances |
| `corner_circle`, `corner_line` | end on the corner against a circle or a line, in their plane |
| `station` | UE at phi = 0, 90 or 180 degrees by stages |
| `interpolated_heights`, `end_at_height` | UE at every other angle, from heights: as published, or for planes exactly |
| `station_ends` | all of it: s of UE at any angles |

The direct solve at every angle is `finish.finished`; the interpolation is the dominating error of the published
procedure (up to 40 % of the length, see docs/measured/abs.md). Angles rad, lengths mm. Source: Hendriko, five-axis
milling, 6-43 to 6-58, corrected: signs of the leans at 0 and 180 degrees, 6-51, 6-52, 6-55, 6-56.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engagement import chip
from vmachining.engagement.analytic.finish import circle_length, leaned, section_through, slope_length
from vmachining.engagement.analytic.passes import Corner
from vmachining.engagement.analytic.planes import corner_plane, cylinder_plane, quarter
from vmachining.engagement.analytic.surface import STRAIGHT, Patch, Section
from vmachining.engagement.frames import angles_of
from vmachining.errors import InputError

STATIONS = (0.0, 0.5 * np.pi, np.pi)
"""rad of phi: places A, B and C of the published procedure."""


class EndPlace(Enum):
    """Where the edge leaves the material. FOLDED: the bottom is out and the top is in, which the source leaves out."""

    NONE = "none"
    CORNER = "corner"
    CYLINDER = "cylinder"
    FOLDED = "folded"


def end_place(d_c: float, d_p: float) -> EndPlace:
    """By the vertical distances of the surface above C (lower end of the corner) and P (upper end), mm."""
    if d_c > 0.0:
        return EndPlace.CYLINDER if d_p > 0.0 else EndPlace.CORNER
    return EndPlace.FOLDED if d_p > 0.0 else EndPlace.NONE


# -- in the plane of the edge: C at the origin, axes (outward, up), w = (sin th, cos th) ------------------------


def corner_circle(r: float, radius: ArrayLike, lean: ArrayLike, tilt: ArrayLike, cs: ArrayLike) -> Floats:
    """(...,) rad, lam of UE against a circle; NaN if none exists.

    r : of the corner. radius : signed, R > 0 convex. lean : th, outward lean of w. tilt : delta, outward tilt of the
    profile's normal over C. cs : vertical distance of the circle over C in this plane.

    O4 = r w, O3 = (-R sin delta, Cs - R cos delta): a cos lam + b sin lam = g with d = O4 - O3, a = -w.d, b = e_r.d,
    g = (R^2 - r^2 - d.d) / (2 r); lam = tau - acos(g/k) convex, tau + acos(g/k) concave.
    """
    big, th, de, q = (np.asarray(v, dtype=np.float64) for v in (radius, lean, tilt, cs))
    sin, cos = np.sin(th), np.cos(th)
    dx, dz = r * sin + big * np.sin(de), r * cos - q + big * np.cos(de)
    a, b = -(sin * dx + cos * dz), cos * dx - sin * dz
    k, tau = np.hypot(a, b), np.arctan2(b, a)
    # (R - |d|)(R + |d|) keeps its digits where both are large; |d| = k
    g = ((np.abs(big) - k) * (np.abs(big) + k) - r * r) / (2.0 * r)
    with np.errstate(invalid="ignore", divide="ignore"):
        half = np.arccos(np.where(np.abs(g) <= k, g / k, np.nan))
    return quarter(np.where(big > 0.0, tau - half, tau + half))


def corner_line(r: float, cs: ArrayLike, ascent: ArrayLike, lean: ArrayLike) -> Floats:
    """(...,) rad, lam of UE against the line z = Cs + tan(g) X, X outward (6-53 to 6-56).

    wu = Cs + r (1 + sin th tan g - cos th), lam = 90 deg + g + th - asin((r - wu) cos g / r).
    """
    q, g, th = (np.asarray(v, dtype=np.float64) for v in (cs, ascent, lean))
    wu = q + r * (1.0 + np.sin(th) * np.tan(g) - np.cos(th))
    sine = (r - wu) * np.cos(g) / r
    with np.errstate(invalid="ignore"):
        return quarter(chip.QUARTER + g + th - np.arcsin(np.where(np.abs(sine) <= 1.0, sine, np.nan)))


# -- stages ----------------------------------------------------------------------------------------------------


class StationEnd(NamedTuple):
    """UE of a station: place; s mm along the edge and z mm, NaN where the edge is out of the material."""

    place: EndPlace
    s: float
    z: float


def station(patch: Patch, corner: Corner, tip: ArrayLike, frame: ArrayLike, phi: float) -> StationEnd:
    """UE at phi = 0, 90 or 180 degrees by the published stages, corrected.

    Raises InputError: Another angle, or a model without a height over the edge.
    """
    which = [abs(phi - p) < 1e-12 for p in STATIONS]
    if not any(which):
        raise InputError(f"stations are at 0, 90 and 180 degrees, not {np.degrees(phi):g}")
    m = np.asarray(frame, dtype=np.float64)
    theta_a, theta_b = (float(v) for v in angles_of(m[:, 2]))
    back = which[2]
    if which[1]:
        first, second, lean1, lean2 = patch.along_y, patch.along_x, -theta_a, theta_b
    else:
        first, second, lean1, lean2 = patch.along_x, patch.along_y, theta_b, theta_a if back else -theta_a
    k = int(which[1])  # coordinate of the first profile

    def staged(at: Floats) -> tuple[float, float, float, Section]:
        """Cs, R_i and the outward tilt of the second profile over a point."""
        cq = float(patch.projection(at))
        cs = leaned(cq, first, float(at[k]), lean1)
        if second.shape in STRAIGHT:
            g = np.arctan(np.tan(second.ascent) * cs / cq)
            return cs, np.inf, float(-g if back else g), second
        d = float(second.tilt(at[1 - k]))
        through = second.radius
        if lean1 != 0.0 and lean2 != 0.0:
            through = section_through(cq, cs, lean1, first, second, d)
        return cs, through, -d if back else d, second

    c, p = (chip.edge_points(tip, m, phi, s, corner.rm, corner.r) for s in (0.0, corner.r * chip.QUARTER))
    distances = [float(patch.projection(v)) for v in (c, p)]
    if np.isnan(distances).any():
        raise InputError("the model has no height over the edge", remedy="take a normal nearer to it")
    place = end_place(*distances)
    if place in (EndPlace.NONE, EndPlace.FOLDED):
        return StationEnd(place, np.nan, np.nan)
    cs, radius, angle, shape = staged(c if place is EndPlace.CORNER else p)
    line = shape.shape in STRAIGHT
    if place is EndPlace.CORNER:
        lam = (
            corner_line(corner.r, cs, angle, lean2)
            if line
            else corner_circle(corner.r, radius, lean2, angle, cs)
        )
        s = corner.r * float(lam)
    else:
        along = slope_length(cs, angle, lean2) if line else circle_length(cs, angle, radius, lean2)
        s = corner.r * chip.QUARTER + float(along)
    z = float(chip.edge_points(tip, m, phi, s, corner.rm, corner.r)[2]) if np.isfinite(s) else np.nan
    return StationEnd(place, s, z)


# -- between the stations --------------------------------------------------------------------------------------


def interpolated_heights(phi: ArrayLike, z: ArrayLike, *, rule: str = "published") -> Floats:
    """(...,) mm, z of UE at phi (...,) in [0, pi] from those (3,) of the stations.

    rule "published": z_A + (z_B - z_A) sin phi up to 90 degrees, z_C + (z_B - z_C) sin phi beyond (6-57, 6-58).
    "plane": zM + (z_B - zM) sin phi + (z_A - z_C)/2 cos phi, zM = (z_A + z_C)/2, which planes fulfil for one lam.
    """
    at = np.asarray(phi, dtype=np.float64)
    a, b, c = np.asarray(z, dtype=np.float64)
    if rule == "published":
        end = np.where(at <= chip.QUARTER, a, c)
        return np.asarray(end + (b - end) * np.sin(at))
    if rule == "plane":
        middle = 0.5 * (a + c)
        return np.asarray(middle + (b - middle) * np.sin(at) + 0.5 * (a - c) * np.cos(at))
    raise InputError(f"unknown rule {rule!r}", remedy="published or plane")


def end_at_height(corner: Corner, tip: ArrayLike, frame: ArrayLike, phi: ArrayLike, z: ArrayLike) -> Floats:
    """(...,) mm, s where the edge comes to the height z: on the corner if it does there, else on the cylinder."""
    up = np.array([0.0, 0.0, 1.0])
    lam = corner_plane(up, z, tip, frame, phi, corner.rm, corner.r).up if corner.r > 0.0 else np.nan
    along = cylinder_plane(up, z, tip, frame, phi, corner.rm, corner.r)
    rod = corner.r * chip.QUARTER + np.where(along >= 0.0, along, np.nan)
    return np.asarray(np.where(np.isnan(lam), rod, corner.r * np.asarray(lam)))


def station_ends(
    patch: Patch, corner: Corner, tip: ArrayLike, frame: ArrayLike, phi: ArrayLike, *, rule: str = "published"
) -> Floats:
    """(m,) mm, s of UE at phi (m,) in [0, pi]: three stations and the interpolation of their heights."""
    z = [station(patch, corner, tip, frame, p).z for p in STATIONS]
    at = np.asarray(phi, dtype=np.float64)
    return end_at_height(corner, tip, frame, at, interpolated_heights(at, z, rule=rule))
