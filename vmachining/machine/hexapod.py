"""A hexapod head: six legs between a frame and the platform that carries the spindle.

The platform never spins about the tool: R = Rz(c) Rx(a) Rz(-c), eq. (3-10), which is the shortest rotation that takes +z to
the tool axis u. With v = z x u it is I + [v] + [v]^2 / (1 + u_z). A leg reaches from its joint b on the frame to its joint
p(home) on the platform, so that its vector is tip + R (p - g) - b, g the gauge point at home.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, rows
from vmachining.errors import KinematicsError


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """Of n poses, each (n, 6): length mm; base and platform, rad that a leg leans from where it stands at home."""

    length: Floats
    base: Floats
    platform: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Hexapod:
    """Frame, platform and legs; the tool stands along +z at home.

    base, platform : (6, 3) mm, joints on the frame and on the platform at home, machine axes. gauge : (3,) mm, the gauge
    point at home. tool : mm that the tip hangs below it. length : shortest and longest leg, mm. base_cone, platform_cone :
    rad that the joints allow from home.

    Raises KinematicsError: Not six joints, a leg without length, limits that its home lies outside of.
    """

    base: Floats
    platform: Floats
    gauge: Floats
    length: tuple[float, float]
    base_cone: float = np.inf
    platform_cone: float = np.inf
    tool: float = 0.0

    def __post_init__(self) -> None:
        try:
            for name, shape in (("base", (6, 3)), ("platform", (6, 3)), ("gauge", (3,))):
                object.__setattr__(self, name, rows(getattr(self, name), *shape, name=name))
        except ValueError as exc:
            raise KinematicsError(f"legs: {exc}") from exc
        home = np.linalg.norm(self.platform - self.base, axis=1)
        low, high = self.length
        if not (low < high and (home > 0).all() and (home >= low).all() and (home <= high).all()):
            raise KinematicsError(
                f"legs are {home.min():.6g} to {home.max():.6g} mm long at home, the limits are {low:g} to {high:g}",
                remedy="home must lie within them",
            )

    @property
    def home(self) -> Floats:
        """(3,) mm, the tip at home: machine coordinates count from here."""
        return np.asarray(self.gauge - [0.0, 0.0, self.tool])

    def legs(self, tip: ArrayLike, axis: ArrayLike) -> Legs:
        """Lengths and angles of the legs at poses.

        tip : (n, 3) mm, axis : (n, 3) of any length, machine axes. Raises KinematicsError where the tool points straight down.
        """
        p, u = rows(tip, -1, 3, name="tip"), np.array(rows(axis, -1, 3, name="axis"))
        u /= np.linalg.norm(u, axis=1, keepdims=True)
        if (u[:, 2] <= -1.0 + 1e-12).any():
            raise KinematicsError("the platform cannot be turned upside down")
        v = np.zeros((len(u), 3, 3))
        v[:, 0, 2], v[:, 1, 2] = u[:, 0], u[:, 1]
        v[:, 2, 0], v[:, 2, 1] = -u[:, 0], -u[:, 1]
        turn = np.eye(3) + v + v @ v / (1.0 + u[:, 2])[:, None, None]
        arm = self.platform - self.gauge + [0.0, 0.0, self.tool]
        legs = p[:, None, :] + np.einsum("nij,kj->nki", turn, arm) - self.base
        length = np.linalg.norm(legs, axis=2)
        if (length == 0.0).any():
            raise KinematicsError("a leg has no length")
        home = self.platform - self.base
        home = home / np.linalg.norm(home, axis=1, keepdims=True)
        way = legs / length[:, :, None]
        return Legs(length, _between(way, home), _between(np.einsum("nji,nkj->nki", turn, way), home))

    def reached(self, tip: ArrayLike, axis: ArrayLike) -> Bools:
        """(n,) whether all legs and joints are within their limits."""
        found = self._over(self.legs(tip, axis))
        return np.asarray(~np.any([over.any(axis=1) for _, over, _ in found], axis=0))

    def complaint(self, tip: ArrayLike, axis: ArrayLike) -> tuple[int, str] | None:
        """The first of the poses that is out of reach, and why; None: all are reached."""
        found = self.legs(tip, axis)
        first: tuple[int, str] | None = None
        for k, over, words in self._over(found):
            hit = np.argwhere(over)
            if len(hit) and (first is None or hit[0, 0] < first[0]):
                pose, leg = hit[0]
                first = int(pose), words.format(leg + 1, k[pose, leg])
        return first

    def _over(self, legs: Legs) -> list[tuple[Floats, Bools, str]]:
        low, high = self.length
        out = [(legs.length, (legs.length < low) | (legs.length > high),
                f"leg {{}} would be {{:.6g}} mm long, it goes from {low:g} to {high:g}")]  # fmt: skip
        cones = ("frame", legs.base, self.base_cone), ("platform", legs.platform, self.platform_cone)
        for name, angle, cone in cones:
            words = f"the joint of leg {{}} on the {name} would lean by {{:.5g}} degrees, it allows {np.degrees(cone):g}"
            out.append((np.degrees(angle), angle > cone, words))
        return out

    def workspace(
        self, heights: ArrayLike, tilt: float, *, step_mm: float = 5.0, headings: int = 24
    ) -> Floats:
        """(k,) mm: radius about z within which every sampled tip is reached with the tool at `tilt` rad to all sides.

        heights : (k,) mm of the tip, from home. Sampled every step_mm on `headings` rays; -1 where not even z is reached.
        """
        around = np.linspace(0.0, 2.0 * np.pi, headings, endpoint=False)
        side = np.column_stack([np.cos(around), np.sin(around), np.zeros(headings)])
        axes = np.cos(tilt) * np.array([0.0, 0.0, 1.0]) + np.sin(tilt) * side
        out = []
        for height in np.asarray(heights, dtype=np.float64):
            radius, good = 0.0, -1.0
            while radius <= 2.0 * self.length[1]:
                tips = self.home + [0.0, 0.0, height] + radius * side
                if not self.reached(np.repeat(tips, headings, axis=0), np.tile(axes, (headings, 1))).all():
                    break
                radius, good = radius + step_mm, radius
            out.append(good)
        return np.array(out)


def _between(a: Floats, b: Floats) -> Floats:
    """rad between unit vectors."""
    return np.asarray(2.0 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)))
