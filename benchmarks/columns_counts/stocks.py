"""Random stocks of the counts: what the engine is given, and its height over a place in plain formulas."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.columns import FlatStock
from vmachining.stock import MeshStock, closed_mesh

__all__ = ["drawn_stock"]

Heights = Callable[[Floats], Floats]


def drawn_stock(
    rng: np.random.Generator, family: str, low: Floats, high: Floats, at: Floats
) -> tuple[FlatStock, Heights, Floats, Floats]:
    """(stock for the engine, heights over places, its box); the engine's is moved by `at`."""
    bottom, top = float(low[2]), float(high[2])
    if family == "round stock":
        low, high = np.array([-5.0, -5.0, bottom]), np.array([6.0, 6.0, top])
        stock = FlatStock(tuple(low), tuple(high), 5.5)
        return stock, lambda p: np.where(np.hypot(*(p - 0.5).T) <= 5.5, top, bottom), low, high
    if family in ("prism", "steps"):
        angles = np.sort(rng.uniform(0.0, 2 * np.pi, rng.integers(4, 9)))
        ring = 0.5 + rng.uniform(3.0, 5.5) * np.column_stack([np.cos(angles), np.sin(angles)])
        low_of = bottom if family == "prism" else top - rng.choice([0.5, 3.0, 7.0])
        stock, box = _stepped(ring, bottom, float(low_of), top, low, high)
        return stock, lambda p: np.where(_inside(ring, p), top, low_of), *box
    if family == "facets":
        nodes = int(rng.choice([2, 4, 12]))
        z = rng.uniform(top - rng.choice([0.2, 3.0, 8.0]), top, (nodes + 1, nodes + 1))
        z[0, 0] = top
        return FlatStock.of(_terrain(z, low, high)), lambda p: _over(z, low, high, p), low, high
    return FlatStock(tuple(low + at), tuple(high + at)), lambda p: np.full(len(p), top), low, high


def _inside(ring: Floats, places: Floats) -> np.ndarray:
    ahead = np.roll(ring, -1, axis=0) - ring
    off = places[:, None] - ring
    return np.asarray((ahead[:, 0] * off[..., 1] - ahead[:, 1] * off[..., 0] >= 0.0).all(axis=1))


def _stepped(
    ring: Floats, bottom: float, step: float, top: float, low: Floats, high: Floats
) -> tuple[FlatStock, tuple[Floats, Floats]]:
    """A prism over a convex ring, on a plate as wide as the box if the step lies above the bottom."""
    from manifold3d import CrossSection, Manifold

    solid = Manifold.extrude(CrossSection([ring]), top - bottom).translate((0.0, 0.0, bottom))
    if step > bottom:
        plate = Manifold.cube((high - low) * [1.0, 1.0, 0.0] + [0.0, 0.0, step - bottom]).translate(low)
        solid = solid + plate
    mesh = solid.to_mesh64()
    points, faces = np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, dtype=np.int64)
    stock = FlatStock.of(closed_mesh(points, faces, source="steps"))
    return stock, (np.array(stock.low), np.array(stock.high))


def _terrain(z: Floats, low: Floats, high: Floats) -> MeshStock:
    """Heights over the nodes of a grid, cells halved along their rising diagonals."""
    m, n = z.shape
    x, y = np.linspace(low[0], high[0], n), np.linspace(low[1], high[1], m)
    plan = np.column_stack([a.ravel() for a in np.meshgrid(x, y)])
    points = np.concatenate([
        np.column_stack([plan, np.full(m * n, low[2])]), np.column_stack([plan, z.ravel()])
    ])  # fmt: skip
    at = np.arange(m * n).reshape(m, n)
    a, b, c, d = (v.ravel() for v in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    top = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    around = np.concatenate([at[0, :-1], at[:-1, -1], at[-1, :0:-1], at[:0:-1, 0]])
    ahead = np.roll(around, -1)
    walls = np.concatenate([
        np.stack([around, ahead, ahead + m * n], axis=1), np.stack([around, ahead + m * n, around + m * n], axis=1)
    ])  # fmt: skip
    return MeshStock(points, np.concatenate([top + m * n, top[:, ::-1], walls]))


def _over(z: Floats, low: Floats, high: Floats, places: Floats) -> Floats:
    """Height of the same over places."""
    m, n = np.array(z.shape) - 1
    u, v = ((places - low[:2]) / (high[:2] - low[:2]) * [n, m]).T
    i, j = np.minimum(u.astype(np.int64), n - 1), np.minimum(v.astype(np.int64), m - 1)
    s, t = u - i, v - j
    a, b, c, d = z[j, i], z[j, i + 1], z[j + 1, i + 1], z[j + 1, i]
    return np.asarray(np.where(s >= t, a + s * (b - a) + t * (c - b), a + t * (d - a) + s * (c - d)))
