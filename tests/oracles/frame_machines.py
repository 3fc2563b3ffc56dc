"""Closed forms of the classes 2/0, 1/1 and 0/2, as the sources print them, with their corrections: the judge of the chains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vmachining.geometry import rotation

__all__ = ["FrameMachine"]

X, Y, Z = np.eye(3)
REALIGN = {
    "2/0": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "1/1": np.diag([-1.0, 1.0, -1.0]),
    "0/2": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]),
}


@dataclass(frozen=True)
class FrameMachine:
    """A machine by the offsets (3,) mm of its frames; a and b are the rotary angles, rad."""

    kind: str
    t12: np.ndarray = (0.0, 0.0, 0.0)
    t23: np.ndarray = (0.0, 0.0, 0.0)
    t34: np.ndarray = (0.0, 0.0, 0.0)

    def components(self, point, a, b):
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

    def slides(self, point, a, b):
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

    def axis(self, a, b):
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

    def point(self, components, a, b):
        """W from P4, the inverse of `components`."""
        p4 = np.asarray(components, dtype=np.float64)
        ma, mb, g = self._matrices(a, b)
        if self.kind == "2/0":
            return _times(_t(ma), _times(_t(g @ mb), p4 - self.t34) - self.t23) - self.t12
        back = _times(_t(mb), p4 - self.t34) - self.t23
        if self.kind == "1/1":
            return _times(_t(g @ ma), back) - self.t12
        return _times(g.T, _times(_t(ma), back) - self.t12)

    def angles(self, axis):
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

    def _matrices(self, a, b):
        first, second = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
        g = REALIGN[self.kind]
        if self.kind == "2/0":
            return rotation(Z, -first), rotation(Y, -second), g
        if self.kind == "1/1":
            return rotation(Z, first), rotation(Y, -second), g
        return rotation(Z, first), rotation(X, second), g


def _times(matrix, vector):
    return np.asarray((matrix @ vector[..., None])[..., 0])


def _t(matrix):
    return np.swapaxes(matrix, -1, -2)
