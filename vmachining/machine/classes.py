"""Chains of the three classes of five-axis machines: 2/0, 1/1 and 0/2 (rotary axes on table / head).

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

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import rows
from vmachining.errors import KinematicsError
from vmachining.geometry.rotation import UNIT
from vmachining.machine.axis import Axis, Kind
from vmachining.machine.chain import Machine

REALIGN = {
    "2/0": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "1/1": np.diag([-1.0, 1.0, -1.0]),
    "0/2": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]),
}
"""G of each class; Ry(-90 deg), Ry(180 deg), Rx(-90 deg) Rz(90 deg)."""


def class_chain(
    kind: str,
    *,
    t12: ArrayLike = (0.0, 0.0, 0.0),
    t23: ArrayLike = (0.0, 0.0, 0.0),
    t34: ArrayLike = (0.0, 0.0, 0.0),
) -> Machine:
    """A machine of class "2/0", "1/1" or "0/2": joints A (first), B (second), X, Y, Z with the values a, b, M.

    Machine axes are those of O4 for 2/0 and the realigned ones after G for the other two, in which the slides move.

    t12, t23, t34 : (3,) mm. Class 0/2 has t12 in the realigned axes of O1, as eq. (2-23) reads; with an
    offset in workpiece axes pass G @ t12, which makes eq. (2-24) right.

    Raises KinematicsError: Another class.
    """
    if kind not in REALIGN:
        raise KinematicsError(f"class {kind!r} of a machine", remedy=f"known: {', '.join(REALIGN)}")
    t12, t23, t34 = (rows(v, 3, name=n) for n, v in (("t12", t12), ("t23", t23), ("t34", t34)))
    g = REALIGN[kind]
    work = np.eye(4)
    work[:3, :3] = g
    along = [Axis(letter.upper(), Kind.LINEAR, UNIT[letter]) for letter in "xyz"]
    name = f"class {kind}"
    if kind == "2/0":
        work[:3, 3] = g @ (t12 + t23) + t34
        first = Axis("A", Kind.ROTARY, g @ UNIT["z"], point=t34 + g @ t23)
        second = Axis("B", Kind.ROTARY, g @ UNIT["y"], point=t34)
        return Machine(name, [first, second, *along], work=work, table=2)
    if kind == "1/1":
        work[:3, 3] = g @ t12 + t23
        first = Axis("A", Kind.ROTARY, g @ UNIT["z"], point=t23, sign=-1)
        second = Axis("B", Kind.ROTARY, UNIT["y"])
        return Machine(name, [first, *along, second], tip=-t34, work=work, table=1)
    work[:3, 3] = t12
    first = Axis("A", Kind.ROTARY, UNIT["z"], sign=-1)
    second = Axis("B", Kind.ROTARY, UNIT["x"], point=-t23, sign=-1)
    return Machine(name, [*along, first, second], tip=-t23 - t34, work=work)
