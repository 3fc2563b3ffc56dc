"""Machines by name. Pivots and offsets are options; home has the tool along +z.

Names of the five-axis presets list the joints from the workpiece to the tool: `c-table-b-head` has C under the
workpiece and B in the head. Table joints count positive in the physical right-hand motion of the table
(sign -1), as in LinuxCNC's `xyzac-trt`; `iso=True` gives them the ISO 841 sense (the tool moves relative to the
work).
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import rows
from vmachining.errors import KinematicsError
from vmachining.geometry.rotation import UNIT
from vmachining.machine.axis import Axis, Kind
from vmachining.machine.chain import Machine

ABOUT = {"A": "x", "B": "y", "C": "z"}
ORIGIN = (0.0, 0.0, 0.0)
REALIGN = {
    "2/0": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "1/1": np.diag([-1.0, 1.0, -1.0]),
    "0/2": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]),
}
"""G of each class, see `class_chain`."""


def class_chain(
    kind: str, *, t12: ArrayLike = ORIGIN, t23: ArrayLike = ORIGIN, t34: ArrayLike = ORIGIN
) -> Machine:
    """A machine of class "2/0", "1/1" or "0/2" (rotary axes on table / head): joints A, B, X, Y, Z with the values a, b, M.

    The frames of the sources: O1 workpiece, O2 and O3 first and second rotary axis, O4 tool; A and B mean them, not the
    letters of ISO 841. Table rotations turn the point, realignments and head rotations turn the frame:

        2/0   A = Rz(-a)   B = Ry(-b)   G = Ry(-90 deg)
        1/1   A = Rz(+a)   B = Ry(-b)   G = Ry(180 deg)
        0/2   A = Rz(+a)   B = Rx(+b)   G = Rx(-90 deg) Rz(90 deg)

    Machine axes are those of O4 for 2/0 and the realigned ones after G for the other two, in which the slides move.

    t12, t23, t34 : (3,) mm, offsets of their origins, each in the axes valid where it is added. Class 0/2 has t12 in the
    realigned axes of O1, as eq. (2-23) of the Indonesian text on five-axis milling reads; with an offset in workpiece axes
    pass G @ t12, which makes eq. (2-24) right.
    Raises KinematicsError: Another class.
    """
    if kind not in REALIGN:
        raise KinematicsError(f"class {kind!r} of a machine", remedy=f"known: {', '.join(REALIGN)}")
    t12, t23, t34 = (rows(v, 3, name=n) for n, v in (("t12", t12), ("t23", t23), ("t34", t34)))
    g = REALIGN[kind]
    work = np.eye(4)
    work[:3, :3] = g
    along, name = _slides(), f"class {kind}"
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


def _slides() -> list[Axis]:
    return [Axis(letter.upper(), Kind.LINEAR, UNIT[letter]) for letter in "xyz"]


def _rotary(letter: str, point: ArrayLike, sign: int) -> Axis:
    return Axis(letter, Kind.ROTARY, UNIT[ABOUT[letter]], point=point, sign=sign)


def xyz() -> Machine:
    """Three slides, no rotary axis."""
    return Machine("xyz", _slides())


def table_table(
    first: str,
    second: str,
    *,
    first_point: ArrayLike = ORIGIN,
    second_point: ArrayLike = ORIGIN,
    iso: bool = False,
) -> Machine:
    """Both rotary axes carry the workpiece (class 2/0), `first` is nearest to it.

    first_point, second_point : (3,) mm, a point on each axis at home, machine axes.
    """
    sign = 1 if iso else -1
    axes = [_rotary(first, first_point, sign), _rotary(second, second_point, sign), *_slides()]
    return Machine(f"{first}{second} table".lower(), axes, table=2)


def head_head(first: str, second: str, *, pivot_mm: float = 0.0, first_offset: ArrayLike = ORIGIN) -> Machine:
    """Both rotary axes carry the tool (class 0/2), `second` is nearest to it.

    pivot_mm : from the tip (or the gauge point, see `Machine.with_tool`) up to the second axis.
    first_offset : (3,) mm from the pivot of the second axis to the first axis.
    """
    pivot = np.array([0.0, 0.0, pivot_mm])
    axes = [*_slides(), _rotary(first, pivot + np.asarray(first_offset), 1), _rotary(second, pivot, 1)]
    return Machine(f"{first}{second} head".lower(), axes)


def table_head(
    table: str, head: str, *, table_point: ArrayLike = ORIGIN, pivot_mm: float = 0.0, iso: bool = False
) -> Machine:
    """One rotary axis under the workpiece and one in the head (class 1/1)."""
    axes = [
        _rotary(table, table_point, 1 if iso else -1), *_slides(), _rotary(head, (0.0, 0.0, pivot_mm), 1)
    ]  # fmt: skip
    return Machine(f"{table} table {head} head".lower(), axes, table=1)


def nutating_head(*, nutation_deg: float = 45.0, pivot_mm: float = 0.0) -> Machine:
    """C in the head and B about an axis inclined by `nutation_deg` to the tool: tilts up to twice that."""
    n, pivot = math.radians(nutation_deg), (0.0, 0.0, pivot_mm)
    inclined = Axis("B", Kind.ROTARY, (0.0, math.sin(n), math.cos(n)), point=pivot)
    return Machine("nutating head", [*_slides(), _rotary("C", pivot, 1), inclined])


def nutating_table(*, nutation_deg: float = 45.0, table_point: ArrayLike = ORIGIN) -> Machine:
    """C under the workpiece on B, whose axis is inclined by `nutation_deg`; both through `table_point`."""
    n = math.radians(nutation_deg)
    inclined = Axis("B", Kind.ROTARY, (0.0, math.sin(n), math.cos(n)), point=table_point, sign=-1)
    return Machine("nutating table", [_rotary("C", table_point, -1), inclined, *_slides()], table=2)


def _limited(axis: Axis, lower: float, upper: float, speed: float, acceleration: float) -> Axis:
    return replace(axis, lower=lower, upper=upper, max_speed=speed, max_acceleration=acceleration)


def _trt(tilt: str, tilt_point: ArrayLike, rot_point: ArrayLike) -> Machine:
    """Travels and speeds of LinuxCNC's simulated table-rotary-tilting mills; 300 deg/s^2 like its slides."""
    turn = math.radians
    axes = [
        _limited(_rotary("C", rot_point, -1), turn(-36000), turn(36000), turn(30), turn(300)),
        _limited(_rotary(tilt, tilt_point, -1), turn(-100), turn(50), turn(30), turn(300)),
        *(_limited(slide, -reach, reach, 20.0, 300.0)
          for slide, reach in zip(_slides(), (200.0, 100.0, 120.0), strict=True)),
    ]  # fmt: skip
    return Machine(f"xyz{tilt}c-trt".lower(), axes, table=2)


def xyzac_trt(
    *, rot_point: ArrayLike = ORIGIN, y_offset_mm: float = 20.0, z_offset_mm: float = 10.0
) -> Machine:
    """LinuxCNC's `xyzac-trt`: C through `rot_point`, A next to it by the offsets in y and z."""
    point = np.asarray(rot_point, dtype=np.float64)
    return _trt("A", point + [0.0, y_offset_mm, z_offset_mm], point)


def xyzbc_trt(
    *, rot_point: ArrayLike = ORIGIN, x_offset_mm: float = 20.0, z_offset_mm: float = 10.0
) -> Machine:
    """LinuxCNC's `xyzbc-trt`: C through `rot_point`, B next to it by the offsets in x and z."""
    point = np.asarray(rot_point, dtype=np.float64)
    return _trt("B", point + [x_offset_mm, 0.0, z_offset_mm], point)


PRESETS: Mapping[str, Callable[..., Machine]] = {
    "xyz": xyz,
    # axis formulas of the sweep files: Rz(c) Rx(a) ez, Rz(c) Ry(b) ez, Rx(a) Ry(b) ez
    "ac": partial(head_head, "C", "A"),
    "bc": partial(head_head, "C", "B"),
    "ab": partial(head_head, "A", "B"),
    # the hexapod has the tip and the axis of this chain; it differs by a spin about the tool axis
    "hexa": partial(head_head, "C", "A"),
    "ac-table": partial(table_table, "C", "A"),
    "bc-table": partial(table_table, "C", "B"),
    "ba-table": partial(table_table, "B", "A"),
    "ab-table": partial(table_table, "A", "B"),
    "ca-head": partial(head_head, "C", "A"),
    "cb-head": partial(head_head, "C", "B"),
    "ab-head": partial(head_head, "A", "B"),
    "ba-head": partial(head_head, "B", "A"),
    "c-table-b-head": partial(table_head, "C", "B"),
    "c-table-a-head": partial(table_head, "C", "A"),
    "nutating-head": nutating_head,
    "nutating-table": nutating_table,
    "xyzac-trt": xyzac_trt,
    "xyzbc-trt": xyzbc_trt,
    "2/0": partial(class_chain, "2/0"),
    "1/1": partial(class_chain, "1/1"),
    "0/2": partial(class_chain, "0/2"),
}
"""Every preset by name."""


def _nearest(name: str) -> list[str]:
    """Presets that a name may mean: it begins them, names their rotary axes, or resembles one."""
    from difflib import get_close_matches

    if begun := [known for known in PRESETS if known.startswith(name) and name]:
        return begun
    axes = sorted(name.removeprefix("xyz"))
    if 0 < len(axes) <= 2 and set(axes) <= set("abc"):
        return with_axes("".join(axes).upper())
    return get_close_matches(name, PRESETS, n=1)


def with_axes(letters: str) -> list[str]:
    """Presets with at least these rotary axes ("AC"), those with limits first, the short names of sweep files left out."""
    named = [name for name, make in PRESETS.items() if "-" in name and set(letters) <= set(make().names)]
    return sorted(named, key=lambda name: not name.endswith("-trt"))


def preset(name: str, **options: Any) -> Machine:
    """A machine by name.

    Raises KinematicsError: No such preset, or an option it does not have.
    """
    make = PRESETS.get(name)
    if make is None:
        close = _nearest(name.lower())
        meant = f"did you mean {' or '.join(close)}? " if close else ""
        raise KinematicsError(f"no machine {name!r}", remedy=f"{meant}known: {', '.join(PRESETS)}")
    known = preset_options(name)
    if wrong := next((key for key in options if key not in known), None):
        raise KinematicsError(
            f"machine {name} has no option {wrong!r}", remedy=f"it has {', '.join(known) or 'none'}"
        )
    try:
        return make(**options)
    except (TypeError, ValueError) as exc:
        raise KinematicsError(f"machine {name}: {exc}") from exc


def preset_options(name: str) -> dict[str, Any]:
    """Options of a preset with their defaults; mm."""
    given = inspect.signature(PRESETS[name]).parameters.values()
    if any(p.kind is p.VAR_KEYWORD for p in given):
        return dict.fromkeys(("t12", "t23", "t34"), ORIGIN)
    return {p.name: p.default for p in given if p.kind is p.KEYWORD_ONLY}


def described(machine: Machine) -> dict[str, Any]:
    """A machine in words. name; axes from the workpiece to the tool; rotary: where each rotary axis lies, lengths in mm."""
    rotary = [
        f"{axis.name} turns about {_triple(axis.direction)} through {_triple(axis.point)} mm"
        for axis in machine.axes
        if axis.kind is Kind.ROTARY
    ]
    return {"name": machine.name, "axes": [axis.name for axis in machine.axes], "rotary": rotary}


def _triple(vector: Any) -> str:
    return f"({', '.join(f'{v + 0.0:.6g}' for v in vector)})"
