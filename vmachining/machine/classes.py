"""Closed forms of the three classes of five-axis machines: 2/0, 1/1 and 0/2 (rotary axes on table / head).

The frames of the sources: O1 workpiece, O2 and O3 first and second rotary axis, O4 tool. T12, T23, T34 are the
offsets of their origins, each in the axes valid where it is added; a and b are the rotary angles. "First" and
"second" are meant by a and b, not the letters of ISO 841.

Matrices (table rotations turn the point, realignments and head rotations turn the frame):

    2/0   A = Rz(-a)   B = Ry(-b)   G = Ry(-90 deg)
    1/1   A = Rz(+a)   B = Ry(-b)   G = Ry(180 deg)
    0/2   A = Rz(+a)   B = Rx(+b)   G = [[0, -1, 0], [0, 0, 1], [-1, 0, 0]]

Equation numbers are those of chapter 2 of the Indonesian text on five-axis milling; corrections are marked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import KinematicsError
from vmachining.geometry.rotation import UNIT, rotation
from vmachining.machine.axis import Axis, Kind
from vmachining.machine.chain import Machine

__all__ = ["FrameMachine"]

REALIGN = {
    "2/0": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "1/1": np.diag([-1.0, 1.0, -1.0]),
    "0/2": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]),
}
"""G of each class; Ry(-90 deg), Ry(180 deg), Rx(-90 deg) Rz(90 deg)."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameMachine:
    """A machine of class `kind` "2/0", "1/1" or "0/2", by the offsets of its frames.

    t12, t23, t34 : (3,) mm. Class 0/2 has t12 in the realigned axes of O1, as eq. (2-23) reads; with an
    offset in workpiece axes pass G @ t12, which makes eq. (2-24) right.

    Raises KinematicsError: Another class.
    """

    kind: str
    t12: Floats
    t23: Floats
    t34: Floats

    def __init__(
        self,
        kind: str,
        *,
        t12: ArrayLike = (0.0, 0.0, 0.0),
        t23: ArrayLike = (0.0, 0.0, 0.0),
        t34: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        if kind not in REALIGN:
            raise KinematicsError(f"class {kind!r} of a machine", remedy=f"known: {', '.join(REALIGN)}")
        object.__setattr__(self, "kind", kind)
        for name, value in (("t12", t12), ("t23", t23), ("t34", t34)):
            object.__setattr__(self, name, rows(value, 3, name=name))

    def components(self, point: ArrayLike, a: ArrayLike, b: ArrayLike) -> Floats:
        """P4: the programmed point in the tool frame with the slides at zero.

        point : (..., 3) mm, workpiece axes; a, b : (...,) rad. Returns (..., 3).


        2/0 (2-11, brackets corrected)        P4 = G (B (A (W + T12) + T23)) + T34
        1/1 (2-21)                            P4 = B (G A (W + T12) + T23) + T34
        0/2 (2-32, T12 outside G, see class)  P4 = B (A (G W + T12) + T23) + T34
        """
        w = np.asarray(point, dtype=np.float64)
        ma, mb, g = self._matrices(a, b)
        if self.kind == "2/0":
            return _times(g @ mb, _times(ma, w + self.t12) + self.t23) + self.t34
        if self.kind == "1/1":
            return _times(mb, _times(g @ ma, w + self.t12) + self.t23) + self.t34
        return _times(mb, _times(ma, _times(g, w) + self.t12) + self.t23) + self.t34

    def slides(self, point: ArrayLike, a: ArrayLike, b: ArrayLike) -> Floats:
        """M: coordinates of the slides that bring the tip to the point, (..., 3) mm.

        The sources give P4, components along the axes of the tool. They are the coordinates of the slides
        only if no head axis turns the tool: M = P4 for 2/0, M = B^T P4 for 1/1, M = (B A)^T P4 for 0/2
        (slides inside the head axes).
        """
        ma, mb, _ = self._matrices(a, b)
        p4 = self.components(point, a, b)
        if self.kind == "2/0":
            return p4
        return _times(_t(mb if self.kind == "1/1" else mb @ ma), p4)

    def axis(self, a: ArrayLike, b: ArrayLike) -> Floats:
        """Tool axis in workpiece coordinates, (..., 3).

        2/0: (cos a cos b, sin a cos b, -sin b); 1/1: (-sin b cos a, sin b sin a, -cos b);
        0/2: (-cos b, -sin a sin b, cos a sin b).
        """
        ca, sa, cb, sb = (f(np.asarray(v, dtype=np.float64)) for v in (a, b) for f in (np.cos, np.sin))
        if self.kind == "2/0":
            parts = (ca * cb, sa * cb, -sb)
        elif self.kind == "1/1":
            parts = (-sb * ca, sb * sa, -cb)
        else:
            parts = (-cb, -sa * sb, ca * sb)
        return np.stack(np.broadcast_arrays(*parts), axis=-1)

    def point(self, components: ArrayLike, a: ArrayLike, b: ArrayLike) -> Floats:
        """W from P4, the inverse of `components`."""
        p4 = np.asarray(components, dtype=np.float64)
        ma, mb, g = self._matrices(a, b)
        if self.kind == "2/0":
            return _times(_t(ma), _times(_t(g @ mb), p4 - self.t34) - self.t23) - self.t12
        back = _times(_t(mb), p4 - self.t34) - self.t23
        if self.kind == "1/1":
            return _times(_t(g @ ma), back) - self.t12
        return _times(g.T, _times(_t(ma), back) - self.t12)

    def angles(self, axis: ArrayLike) -> Floats:
        """Both pairs (a, b) of a unit tool axis, (..., 2, 2) rad: [..., branch, (a, b)].

        a is 0 where the axis leaves it free: k = +-1 for 2/0 and 1/1, i = +-1 for 0/2.
        """
        i, j, k = np.moveaxis(np.asarray(axis, dtype=np.float64), -1, 0)
        if self.kind == "2/0":
            first = np.arctan2(-k, np.hypot(i, j))  # -asin k, with all digits near the poles
            second = np.array([first, np.pi - first])
            size = np.cos(second)
            free = np.hypot(i, j) == 0.0
            a = np.arctan2(j * np.sign(size), i * np.sign(size))
        elif self.kind == "1/1":
            first = np.arctan2(np.hypot(i, j), -k)
            second = np.array([first, -first])
            free = np.hypot(i, j) == 0.0
            a = np.arctan2(j * np.sign(second), -i * np.sign(second))
        else:
            first = np.arctan2(np.hypot(j, k), -i)
            second = np.array([first, -first])
            free = np.hypot(j, k) == 0.0
            a = np.arctan2(-j * np.sign(second), k * np.sign(second))
        return np.moveaxis(np.array([np.where(free, 0.0, a), second]), (0, 1), (-1, -2))

    def chain(self) -> Machine:
        """The same machine as a serial chain: joints A (first), B (second), X, Y, Z with the values a, b, M.

        Machine axes are those of O4 for 2/0 and the realigned ones behind G for the other two, in which the
        slides move.
        """
        g = REALIGN[self.kind]
        work = np.eye(4)
        work[:3, :3] = g
        along = [Axis(letter.upper(), Kind.LINEAR, UNIT[letter]) for letter in "xyz"]
        name = f"class {self.kind}"
        if self.kind == "2/0":
            work[:3, 3] = g @ (self.t12 + self.t23) + self.t34
            first = Axis("A", Kind.ROTARY, g @ UNIT["z"], point=self.t34 + g @ self.t23)
            second = Axis("B", Kind.ROTARY, g @ UNIT["y"], point=self.t34)
            return Machine(name, [first, second, *along], work=work, table=2)
        if self.kind == "1/1":
            work[:3, 3] = g @ self.t12 + self.t23
            first = Axis("A", Kind.ROTARY, g @ UNIT["z"], point=self.t23, sign=-1)
            second = Axis("B", Kind.ROTARY, UNIT["y"])
            return Machine(name, [first, *along, second], tip=-self.t34, work=work, table=1)
        work[:3, 3] = self.t12
        first = Axis("A", Kind.ROTARY, UNIT["z"], sign=-1)
        second = Axis("B", Kind.ROTARY, UNIT["x"], point=-self.t23, sign=-1)
        return Machine(name, [*along, first, second], tip=-self.t23 - self.t34, work=work)

    def _matrices(self, a: ArrayLike, b: ArrayLike) -> tuple[Floats, Floats, Floats]:
        first, second = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
        g = REALIGN[self.kind]
        if self.kind == "2/0":
            return rotation(UNIT["z"], -first), rotation(UNIT["y"], -second), g
        if self.kind == "1/1":
            return rotation(UNIT["z"], first), rotation(UNIT["y"], -second), g
        return rotation(UNIT["z"], first), rotation(UNIT["x"], second), g


def _times(matrix: Floats, vector: Floats) -> Floats:
    return np.asarray((matrix @ vector[..., None])[..., 0])


def _t(matrix: Floats) -> Floats:
    return np.swapaxes(matrix, -1, -2)
