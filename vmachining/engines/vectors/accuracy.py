"""How far apart vectors may represent an error that is given (spec E.3, equations 4-1 to 4-5, corrected)."""

from __future__ import annotations

from math import acos, cos, inf, sqrt

from vmachining.errors import InputError


def _refuse(error: float, radius: float, what: str, where: str) -> None:
    if not 0.0 < error <= radius:
        remedy = "the error must be above zero and at most the radius"
        raise InputError(f"{what} error {error:g} mm {where} of {radius:g} mm", remedy=remedy)


def representation_spacing(error: float, curvature_radius: float) -> float:
    """(4-1): delta_R = 2 sqrt(2 rho e - e^2), the chord whose sagitta on a circle of radius rho is e. mm.

    Raises InputError: e is not between 0 and rho.
    """
    _refuse(error, curvature_radius, "representation", "on a radius of curvature")
    return 2.0 * sqrt(2.0 * curvature_radius * error - error * error)


def simulation_spacing(error: float, ball_radius: float) -> float:
    """(4-3), corrected: delta_S = sqrt(6 R e - 3 e^2), R the radius of the ball. mm.

    Three samples of an equilateral triangle of side delta on a sphere of radius R lie e below it in their middle when
    (delta / sqrt 3)^2 = 2 R e - e^2; on a square grid the distance is delta / sqrt 2, and delta = sqrt(4 R e - 2 e^2).

    Raises InputError: e is not between 0 and R.
    """
    _refuse(error, ball_radius, "simulation", "of a ball of radius")
    return sqrt(6.0 * ball_radius * error - 3.0 * error * error)


def spacing_for(error: float, ball_radius: float, curvature_radius: float = inf) -> float:
    """The smaller of delta_R and delta_S for one error, mm; no curvature: a part of planes."""
    simulated = simulation_spacing(error, ball_radius)
    if curvature_radius == inf:
        return simulated
    return min(simulated, representation_spacing(error, curvature_radius))


def grid_pitch(spacing: float, slope: float) -> float:
    """(4-2), (4-4): gamma = delta cos(theta), theta the slope (rad) from the horizontal. mm."""
    if not (spacing > 0.0 and 0.0 <= slope < acos(0.0)):
        raise InputError(f"spacing {spacing:g} mm at a slope of {slope:g} rad has no pitch")
    return spacing * cos(slope)


def wall_angle(pitch: float, spacing: float) -> float:
    """(4-5): theta_V = acos(gamma / delta), rad, the steepest slope that upright vectors of a pitch show at a spacing.

    Raises InputError: gamma is not below delta: no slope at all.
    """
    if not 0.0 < pitch < spacing:
        what = f"pitch {pitch:g} mm of upright vectors is not below the spacing {spacing:g} mm"
        raise InputError(what, remedy="take a smaller pitch, or a larger spacing")
    return acos(pitch / spacing)
