"""How far a joint-linear block leaves the straight line.

Symbols: p tip, p'' its second derivative by t in [0, 1].
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import KinematicsError
from vmachining.geometry.rotation import great_circle
from vmachining.machine.chain import Machine

SAMPLES = 65
ZOOMS, ZOOM_SAMPLES = 6, 17
"""Each zoom narrows the place of a maximum by 8; six give 1e-7 of the block and the value to 1e-12."""


class TipDeviation(NamedTuple):
    """Columns (n,), mm.

    parametric : largest distance between tip and the point of the straight line with the same t.
    geometric : largest distance between tip and the straight line between the ends.
    bound : proven, max |p''| / 8 >= parametric >= geometric.
    """

    parametric: Floats
    geometric: Floats
    bound: Floats


class AxisDeviation(NamedTuple):
    """Columns (n,), rad: of a tool axis whose rotary joints are linear.

    out_of_plane : largest angle between the axis and the plane of its ends.
    from_circle : largest angle to the axis on the great circle with the same t.
    bound : proven, of the distance |u(t) - ((1 - t) u0 + t u1)| to the chord.
    """

    out_of_plane: Floats
    from_circle: Floats
    bound: Floats


def tip_deviation(
    machine: Machine, start: ArrayLike, end: ArrayLike, *, samples: int = SAMPLES
) -> TipDeviation:
    """Deviation of joint-linear blocks from the straight tip path.

    start, end : (n, m) joints.
    samples : per block, at least 3; more of them make `bound` tighter.

    The interpolation error of a straight line is at most max |p''| / 8. The maximum of g = |p''|^2 is taken
    from samples a step h apart, plus h^2/8 max|g''| <= h^2/4 (M3^2 + M2 M4) with the bounds M_k of
    `derivative_bounds`. For one rotary axis and a tip at the radius r it is about r dtheta^2 / 8.
    """
    q0, q1 = _blocks(machine, start, end, samples)
    speed = q1 - q0
    p0, p1 = machine.forward(q0).tip, machine.forward(q1).tip

    def joints(t: Floats) -> Floats:
        return np.asarray(q0[:, None, :] + t[..., None] * speed[:, None, :])

    def parametric(t: Floats) -> Floats:
        straight = (1.0 - t[..., None]) * p0[:, None, :] + t[..., None] * p1[:, None, :]
        return np.asarray(np.linalg.norm(machine.forward(joints(t)).tip - straight, axis=-1))

    def geometric(t: Floats) -> Floats:
        along = (p1 - p0)[:, None, :]
        square = (along * along).sum(axis=-1)
        r = machine.forward(joints(t)).tip - p0[:, None, :]
        s = np.divide((r * along).sum(axis=-1), square, out=np.zeros_like(t), where=square > 0)
        return np.asarray(np.linalg.norm(r - np.clip(s, 0.0, 1.0)[..., None] * along, axis=-1))

    grid = np.broadcast_to(np.linspace(0.0, 1.0, samples), (len(q0), samples))
    bound = _bound(machine, q0, q1, samples)
    return TipDeviation(_largest(parametric, grid), _largest(geometric, grid), bound)


def axis_deviation(
    machine: Machine, start: ArrayLike, end: ArrayLike, *, samples: int = SAMPLES
) -> AxisDeviation:
    """Deviation of the tool axis from the great circle while the rotary joints are linear.

    start, end : (n, m) joints. Blocks whose tool axes are equal have no plane: `out_of_plane` is the largest
    angle to that axis. KinematicsError for opposite axes.
    """
    q0, q1 = _blocks(machine, start, end, samples)
    u0, u1 = machine.forward(q0).axis, machine.forward(q1).axis
    normal = np.cross(u0, u1)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0)

    speed = (q1 - q0)[:, None, :]

    def joints(t: Floats) -> Floats:
        return np.asarray(q0[:, None, :] + t[..., None] * speed)

    def axis(t: Floats) -> Floats:
        return machine.forward(joints(t)).axis

    def circle(t: Floats) -> Floats:
        try:
            on = great_circle(u0[:, None, :], u1[:, None, :], t)
        except ValueError as exc:
            raise KinematicsError(f"tool axes: {exc}") from exc
        return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(axis(t) - on, axis=-1), 1.0)))

    def across(t: Floats) -> Floats:
        out = np.arcsin(np.minimum(np.abs((axis(t) * normal[:, None, :]).sum(axis=-1)), 1.0))
        return np.where(size > 0, out, circle(t))

    grid = np.broadcast_to(np.linspace(0.0, 1.0, samples), (len(q0), samples))
    turned = np.abs(q1 - q0)[:, list(machine.rotary)].sum(axis=1)
    second = machine.rates(joints(grid), speed)
    top = (second.axis_acceleration**2).sum(axis=-1).max(axis=1)
    bound = np.sqrt(top + 2.0 * turned**6 / (4.0 * (samples - 1) ** 2)) / 8.0
    return AxisDeviation(_largest(across, grid), _largest(circle, grid), np.minimum(bound, turned**2 / 8.0))


def derivative_bounds(machine: Machine, start: ArrayLike, end: ArrayLike) -> Floats:
    """Bounds of the norms of the second, third and fourth derivative of the tip in a joint-linear block.

    The tip is a sum of vectors r_j(t), linear in t, each turned by the first j rotary joints, R_j(t) r_j(t).
    With W_j the sum of their turns, |d^k R_j / dt^k| <= W_j^k, so

        |d^k p / dt^k| <= sum_j W_j^k max|r_j| + k W_j^(k-1) |r_j'|

    start, end : (..., m). Returns (..., 3).
    """
    q0, q1 = np.broadcast_arrays(np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64))
    shape = q0.shape[:-1]
    before, after, turned = np.zeros((*shape, 3)), np.zeros((*shape, 3)), np.zeros(shape)
    out = np.zeros((*shape, 3))
    k = np.array([2.0, 3.0, 4.0])

    def add() -> None:
        reach = np.maximum(np.linalg.norm(before, axis=-1), np.linalg.norm(after, axis=-1))[..., None]
        change = np.linalg.norm(after - before, axis=-1)[..., None]
        w = turned[..., None]
        out[...] += w**k * reach + k * w ** (k - 1.0) * change

    for i, axis in enumerate(machine.axes):
        if axis.is_rotary:
            before, after = before + axis.point, after + axis.point
            add()
            before, after = (np.broadcast_to(-axis.point, (*shape, 3)) for _ in range(2))
            turned = turned + np.abs(q1[..., i] - q0[..., i])
        else:
            before = before + axis.sign * q0[..., i, None] * axis.direction
            after = after + axis.sign * q1[..., i, None] * axis.direction
    before, after = before + machine.tip, after + machine.tip
    add()
    return out


def _bound(machine: Machine, q0: Floats, q1: Floats, samples: int) -> Floats:
    """(n,) max |p''| / 8, proven; see `tip_deviation`."""
    t = np.linspace(0.0, 1.0, samples)[:, None]
    speed = (q1 - q0)[:, None, :]
    second = machine.rates(q0[:, None, :] + t * speed, speed).acceleration
    m2, m3, m4 = derivative_bounds(machine, q0, q1).T
    slack = (m3**2 + m2 * m4) / (4.0 * (samples - 1) ** 2)
    largest = np.sqrt((second * second).sum(axis=-1).max(axis=1) + slack)
    return np.asarray(np.minimum(largest, m2) / 8.0)


def _blocks(machine: Machine, start: ArrayLike, end: ArrayLike, samples: int) -> tuple[Floats, Floats]:
    m = len(machine.axes)
    try:
        q0, q1 = rows(start, -1, m, name="start"), rows(end, -1, m, name="end")
    except ValueError as exc:
        raise KinematicsError(f"machine {machine.name}: {exc}") from exc
    if len(q0) != len(q1) or samples < 3:
        raise KinematicsError(f"{len(q0)} starts, {len(q1)} ends, {samples} samples")
    return q0, q1


def _largest(f: Callable[[Floats], Floats], grid: Floats) -> Floats:
    """(n,) maxima of f over [0, 1], from samples on a grid (n, s) and zooms around the best one."""
    t, best = grid, np.zeros(len(grid))
    step = 1.0 / (grid.shape[1] - 1)
    for _ in range(ZOOMS + 1):
        values = f(t)
        k = values.argmax(axis=1)[:, None]
        best = np.maximum(best, np.take_along_axis(values, k, axis=1)[:, 0])
        center = np.take_along_axis(t, k, axis=1)
        t = np.clip(center + step * np.linspace(-1.0, 1.0, ZOOM_SAMPLES), 0.0, 1.0)
        step *= 2.0 / (ZOOM_SAMPLES - 1)
    return best
