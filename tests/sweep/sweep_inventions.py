"""Named tools and motions, and points, for the sweep tests, and truths that do not use the package's kernels."""

from __future__ import annotations

from math import pi

import numpy as np

from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep
from vmachining.tool import AptTool, BallNose, BullNose, FlatEnd, Profile, ProfileTool, Taper

FLAT = FlatEnd(diameter=20, length=50)
BALL = BallNose(diameter=10, length=50)
BULL = BullNose(diameter=20, corner_radius=5, length=50)
CONE = Taper(diameter=6, corner_radius=3, taper_deg=5, length=40)
DRILL = AptTool(d=10, r=0, e=5, f=0, alpha_deg=31, beta_deg=0, h=30)
STEPPED = ProfileTool(points=[(3, 0), (3, 10), (8, 10), (8, 20), (5, 20), (7, 30)])
TOOLS = {"flat": FLAT, "ball": BALL, "bull": BULL, "cone": CONE, "drill": DRILL, "stepped": STEPPED}

PATHS = {
    "rest": Line((1, 2, 3), (1, 2, 3)),
    "level": Line((0, 0, 0), (40, 30, 0)),
    "ramp": Line((0, 0, 0), (20, 30, -10)),
    "plunge": Line((5, 5, 0), (5, 5, -20)),
    "retract": Line((5, 5, 0), (5, 5, 25)),
    "arc": Arc((30, 0, 0), (0, 0, 0), 2, angle=pi / 2),
    "pivot": Arc((3, 1, 0), (0, 0, 0), 2, angle=-4),
    "turns": Arc((30, 0, 0), (0, 0, 0), 2, angle=7),
    "helix": Arc((30, 0, 0), (0, 0, 0), 2, angle=-2.5, rise=-10),
    "screw": Arc((6, 0, 0), (0, 0, 0), 2, angle=9, rise=-12),
    "upright": Arc((30, 0, 0), (0, 0, 0), 1, angle=2.0),
    "sideways": Arc((0, 12, 0), (0, 0, 0), 0, angle=-4, rise=5),
}


def sphere(radius: float) -> Profile:
    """Ball whose lowest point is the origin."""
    return Profile([(0, 0), (0, 2 * radius)], [(0, radius)], [radius])


def holds(profile: Profile, points: np.ndarray) -> np.ndarray:
    """Whether points lie in the body at rest, by its radius at their height."""
    z = points[..., 2]
    rho = np.hypot(points[..., 0], points[..., 1])
    inside = (z >= profile.z_min) & (z <= profile.z_max)
    return inside & (rho <= profile.radius_at(z))


def around(sweep: Sweep, n: int, seed: int = 0) -> np.ndarray:
    """Random points in the box of a sweep, enlarged a little."""
    low, high = sweep.bounds
    return low - 3 + (high - low + 6) * np.random.default_rng(seed).random((n, 3))


def lines(sweep: Sweep, n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Origins and unit directions of random lines through the box of a sweep."""
    a, b = around(sweep, n, seed), around(sweep, n, seed + 1)
    return a, (b - a) / np.linalg.norm(b - a, axis=1)[:, None]


def smooth_rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss points on [0, 1] after x = 3 t^2 - 2 t^3: square roots at the ends do no harm."""
    t, w = np.polynomial.legendre.leggauss(n)
    t, w = 0.5 * (t + 1), 0.5 * w
    return t * t * (3 - 2 * t), w * 6 * t * (1 - t)


def lengths_volume(sweep: Sweep, axis: int, n: int) -> float:
    """Midpoint rule over n x n rays along a coordinate axis. Error about h^1.5 at rims."""
    low, high = sweep.bounds
    a, b = (k for k in range(3) if k != axis)
    step = (high - low) / n
    u, v = np.meshgrid(*(low[k] + step[k] * (np.arange(n) + 0.5) for k in (a, b)), indexing="ij")
    origins = np.zeros((n * n, 3))
    origins[:, a], origins[:, b], origins[:, axis] = u.ravel(), v.ravel(), low[axis]
    direction = np.zeros(3)
    direction[axis] = 1
    return float(sweep.ray_intervals(origins, direction).lengths.sum() * step[a] * step[b])
