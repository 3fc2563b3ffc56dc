"""`Stance`: the tool at one instant of a motion, and its surface by rotation angle.

Symbols: T tip, A unit axis, V velocity of the tip, Adot = dA/dt, all at one t of the block (rates are per
block). phi rotation angle, from the second to the first direction of the tool frame, clockwise seen from the
spindle as the tool turns under M3. m unit radial direction, h height and rho radius of a point, N = n_r m + n_z A.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.sweep.grazing import instant
from vmachining.sweep.motion import Motion
from vmachining.tool import Edge

ALONG = 1e-9
"""Share of the velocity across the axis below which the feed has no direction: plunges, turns on the spot."""


class Stance(NamedTuple):
    """tip, axis, velocity, axis_rate : (3,) mm and per block. right, ahead : (3,) directions of the tool frame.

    The tool frame is Rx(theta_A) Ry(theta_B) applied to x, y, z: its columns are `right`, `ahead` and the axis
    (x, y and z for an upright tool). m(phi) = sin(phi) right + cos(phi) ahead.
    """

    tip: Floats
    axis: Floats
    velocity: Floats
    axis_rate: Floats
    right: Floats
    ahead: Floats

    @classmethod
    def on(cls, path: Motion, t: float) -> Stance:
        """The tool at t in [0, 1] of a path.

        theta_B = asin(A_x), theta_A = atan2(-A_y, A_z); a positive theta_A leans the tool to -y.
        """
        now = instant(path, t)
        x, y, z = (float(v) for v in now.axis)
        cos_b, theta = float(np.hypot(y, z)), float(np.arctan2(-y, z))
        sin_a, cos_a = float(np.sin(theta)), float(np.cos(theta))
        right = np.array([cos_b, sin_a * x, -cos_a * x])
        return cls(now.tip, now.axis, now.velocity, now.axis_rate, right, np.array([0.0, cos_a, sin_a]))

    @property
    def feed_angle(self) -> float | None:
        """rad: phi + feed_angle is 90 degrees straight ahead of the feed; None where the feed is axial."""
        a, b = float(self.velocity @ self.right), float(self.velocity @ self.ahead)
        if np.hypot(a, b) <= ALONG * max(float(np.linalg.norm(self.velocity)), 1e-300):
            return None
        return float(np.arctan2(b, a))

    def speed(self, edge: Edge) -> float:
        """Upper bound of the speed of the edge, mm per block."""
        far = float(np.hypot(edge.profile.max_radius, np.abs(edge.profile.points[:, 1]).max()))
        return float(np.linalg.norm(self.velocity) + far * np.linalg.norm(self.axis_rate))

    def radial(self, angle: Floats) -> Floats:
        """(n, 3) unit radial directions."""
        return np.asarray(np.sin(angle)[:, None] * self.right + np.cos(angle)[:, None] * self.ahead)

    def points(self, edge: Edge, phi: Floats, piece: Ints, s: Floats) -> Floats:
        """(n, 3) mm: points of the edge whose tip stands at phi (n,)."""
        p = edge.at(piece, s)
        return np.asarray(self.tip + p.z[:, None] * self.axis + p.r[:, None] * self.radial(phi - p.lag))

    def normal_speed(self, edge: Edge, phi: Floats, piece: Ints, s: Floats) -> Floats:
        """(n,) mm per block, N . V of points of the edge: positive where the surface meets new material.

        A point at h A + rho m moves with V + h Adot - rho (m . Adot) A when the tool turns without spin, hence
        N . V = n_r m . V + n_z A . V + (h n_r - rho n_z) m . Adot. The velocity of the centre of an arc of the
        meridian does the same for the whole arc.
        """
        p = edge.at(piece, s)
        m = self.radial(phi - p.lag)
        lever = p.z * p.n_r - p.r * p.n_z
        return np.asarray(
            p.n_r * (m @ self.velocity)
            + p.n_z * float(self.velocity @ self.axis)
            + lever * (m @ self.axis_rate)
        )
