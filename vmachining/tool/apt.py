"""The seven-parameter cutter of APT: CUTTER / d, r, e, f, alpha, beta, h.

Symbols, as in the standard: d diameter where bottom and side line meet, r corner radius, e and f radial and
axial position of the corner centre, alpha rise of the bottom line, beta side angle, h height.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vmachining.errors import ToolError
from vmachining.tool.cutters import Cutter, positive
from vmachining.tool.profile import Profile

__all__ = ["AptTool"]

TANGENT_MM = 1e-6
"""A corner circle this close to touching its line is tangent: e and f are written with six decimals or nine digits."""


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AptTool(Cutter):
    """APT cutter. d, r, e, f, h in mm, alpha_deg and beta_deg in degrees.

    The bottom line is z = x tan(alpha), the side line x = u + z tan(beta) with
    u = d/2 (1 - tan(alpha) tan(beta)); the corner circle about (e, f) joins them. With r = 0 they meet in a
    sharp edge at d/2 and e, f are not used. `length` defaults to h; a longer tool continues as a cylinder.

    Raises ToolError: A parameter out of range, or a corner circle that misses the bottom or the side line.
    """

    d: float
    r: float
    e: float
    f: float
    alpha_deg: float
    beta_deg: float
    h: float
    length: float = 0.0

    def __post_init__(self) -> None:
        positive("h", self.h)
        if not self.length:
            object.__setattr__(self, "length", float(self.h))
        super(AptTool, self).__post_init__()

    @property
    def diameter(self) -> float:
        """mm, the largest one."""
        return 2 * self.profile.max_radius

    def _check(self) -> None:
        positive("d", self.d)
        for name, value in (("r", self.r), ("e", self.e), ("f", self.f)):
            if not np.isfinite(value):
                raise ToolError(f"apt: {name} must be finite", word=name)
        if self.r < 0:
            raise ToolError(f"apt: r {self.r:g} mm is negative", word="r")
        if not 0 <= self.alpha_deg < 90:
            raise ToolError(
                f"apt: alpha_deg {self.alpha_deg:g} outside [0, 90)", word="alpha_deg",
                remedy="the bottom may be flat or pointed, not hollow",
            )  # fmt: skip
        if not -90 < self.beta_deg < 90:
            raise ToolError(f"apt: beta_deg {self.beta_deg:g} outside (-90, 90)", word="beta_deg")
        if self.length < self.h:
            raise ToolError(f"length {self.length:g} mm is shorter than h {self.h:g} mm", word="length")

    def _meridian(self) -> Profile:
        tan_a, tan_b = (float(np.tan(np.radians(v))) for v in (self.alpha_deg, self.beta_deg))
        u = self.d / 2 * (1.0 - tan_a * tan_b)
        nan = float("nan")
        if self.r == 0:
            low = high = (self.d / 2, self.d / 2 * tan_a)
        else:
            low, high = self._corner(tan_a, tan_b, u)
        top = (u + self.h * tan_b, self.h)
        if high[1] > self.h or top[0] < 0 or min(low[0], high[0]) < 0:
            raise self._misfit(f"the corner ends at z {high[1]:g} mm and the top radius is {top[0]:g} mm")
        points = [(0.0, 0.0), low, high, top]
        centers = [(nan, nan), (self.e, self.f), (nan, nan)]
        radii = [0.0, self.r, 0.0]
        if self.length > self.h:
            points.append((top[0], self.length))
            centers.append((nan, nan))
            radii.append(0.0)
        try:
            return Profile(points, centers, radii)
        except ToolError as exc:
            raise self._misfit(exc.message) from exc

    def _corner(
        self, tan_a: float, tan_b: float, u: float
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ends (r, z) of the corner arc: outer root on the bottom line, lower root on the side line."""
        under = self._half_chord("bottom", self.f - self.e * tan_a, tan_a)
        side = self._half_chord("side", self.e - u - self.f * tan_b, tan_b)
        low_r = (self.f * tan_a + self.e + under) / (1.0 + tan_a**2)
        high_z = (self.f + (self.e - u) * tan_b - side) / (1.0 + tan_b**2)
        low = (float(low_r), float(low_r * tan_a))
        high = (float(u + high_z * tan_b), float(high_z))
        return self._on_circle(low), self._on_circle(high)

    def _half_chord(self, name: str, offset: float, slope: float) -> float:
        """sqrt((1 + slope^2) r^2 - offset^2) of a line that passes the centre at |offset| / sqrt(1 + slope^2)."""
        stretch = float(np.hypot(1.0, slope))
        gap = abs(offset) / stretch - self.r
        if gap > TANGENT_MM:
            raise self._misfit(f"the corner circle misses the {name} line by {gap:.3g} mm")
        return 0.0 if gap >= -TANGENT_MM else float(np.sqrt((stretch * self.r) ** 2 - offset**2))

    def _on_circle(self, point: tuple[float, float]) -> tuple[float, float]:
        """Move a foot onto the circle that rounding left it off."""
        dr, dz = point[0] - self.e, point[1] - self.f
        reach = float(np.hypot(dr, dz))
        if reach == 0 or abs(reach - self.r) > 1e-4 * self.r:
            return point
        r, z = self.e + dr * self.r / reach, self.f + dz * self.r / reach
        return (max(r, 0.0) if r > -1e-9 else r, max(z, 0.0) if z > -1e-9 else z)

    def _misfit(self, what: str) -> ToolError:
        tan_a, tan_b = (float(np.tan(np.radians(v))) for v in (self.alpha_deg, self.beta_deg))
        u = self.d / 2 * (1.0 - tan_a * tan_b)
        cos_a, cos_b = np.cos(np.radians([self.alpha_deg, self.beta_deg]))
        e = (u + self.r * tan_b / cos_a - self.r / cos_b) / (1.0 - tan_a * tan_b)
        return ToolError(
            f"apt: the seven parameters do not fit together: {what}", word="apt",
            remedy=f"a tangent corner has e = {e:.9g}, f = {e * tan_a + self.r / cos_a:.9g}",
        )  # fmt: skip

    def _label(self) -> str:
        return f"apt D{self.d:g} r{self.r:g}"
