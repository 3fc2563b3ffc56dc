"""A machine from a small TOML file; every refusal names file, line and key. [legs] and [machine]: docs/kinematics.md.

name = "trunnion"
tool_axis = [0, 0, 1]        # at home, from tip to spindle; default +z
gauge_mm = [0, 0, 0]         # gauge point at home, machine axes
tool_length_mm = 0           # the tip hangs this far below it
work = { origin_mm = [0, 0, 0], rotation_deg = [0, 0, 0] }   # part frame; turned about x, then y, then z

[[axes]]                     # from the workpiece over the bed to the tool
name = "C"
kind = "rotary"              # rotary | linear
carries = "work"             # work | tool
direction = "z"              # x y z -x -y -z, or [i, j, k]
point_mm = [0, 0, 0]         # rotary only
sign = -1                    # -1: counts the physical motion of a table; +1 (default): ISO 841, and heads
min_deg = -120               # linear: min_mm, max_mm, max_speed_mm_min, max_acceleration_mm_s2
max_deg = 30
max_speed_deg_min = 3600
max_acceleration_deg_s2 = 500
"""

from __future__ import annotations

import dataclasses
import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.errors import KinematicsError
from vmachining.geometry.rotation import UNIT, rotation
from vmachining.machine.axis import Axis, Kind
from vmachining.machine.chain import Machine
from vmachining.machine.hexapod import Hexapod
from vmachining.machine.presets import PRESETS, preset
from vmachining.textfile import parse_toml, read_text
from vmachining.tomlplaces import key_positions, position_of, said_by_toml

TOP_KEYS = ("name", "tool_axis", "gauge_mm", "tool_length_mm", "work", "axes", "legs", "machine")
LEG_KEYS = ("base_mm", "platform_mm", "length_mm", "base_joint_deg", "platform_joint_deg")
WORK_KEYS = ("origin_mm", "rotation_deg")
AXIS_KEYS = ("name", "kind", "carries", "direction", "point_mm", "sign")
LIMIT_KEYS = {
    Kind.LINEAR: ("min_mm", "max_mm", "max_speed_mm_min", "max_acceleration_mm_s2"),
    Kind.ROTARY: ("min_deg", "max_deg", "max_speed_deg_min", "max_acceleration_deg_s2"),
}


def load(name_or_file: str | Path, **options: Any) -> Machine:
    """A machine: the name of a preset (with its options), or a TOML file.

    A Path, and a text that ends in `.toml`, is a file.

    Raises KinematicsError: No such preset or file, or a file that describes no machine.
    """
    if not isinstance(name_or_file, Path) and not name_or_file.lower().endswith(".toml"):
        return preset(name_or_file, **options)
    if options:
        raise KinematicsError("options belong to presets, not to files", file=str(name_or_file))
    return read_machine(name_or_file)


def read_machine(path: str | Path) -> Machine:
    """The machine in a TOML file. Raises KinematicsError with file and line."""
    chain = read_parts(path)[0]
    if chain is None:
        raise KinematicsError(
            "no [[axes]]", file=str(path), remedy="list the joints from the workpiece to the tool"
        )
    return chain


def read_parts(path: str | Path) -> tuple[Machine | None, Hexapod | None, Mapping[str, Any]]:
    """Chain and legs of a machine file, and its table [machine] as it stands. Of a job file only [machine] counts.

    Raises KinematicsError: No such file, or nothing of these is in it.
    """
    path = Path(path)
    text = read_text(path, "machine file", KinematicsError, missing=f"presets: {', '.join(PRESETS)}")
    try:
        data = parse_toml(text)
    except tomllib.TOMLDecodeError as exc:
        what, line, col = said_by_toml(exc)
        raise KinematicsError(what, file=str(path), line=line, col=col) from exc
    reader, keys = _Reader(str(path), text), data.get("machine", {})
    if not isinstance(keys, dict):
        raise reader.refuse("machine is not a table", "machine")
    if "program" in data:
        return None, None, keys
    if "machine" in data and "axes" not in data and "legs" not in data:
        reader.known(data, ("name", "machine"), None)
        return None, None, keys
    chain = reader.machine(data)
    return chain, reader.legs(data) if "legs" in data else None, keys


def machine_from_mapping(data: Mapping[str, Any]) -> Machine:
    """The machine in a mapping with the keys of a machine file. Raises KinematicsError."""
    return _Reader(None, "").machine(data)


class _Reader:
    """Checks keys and values; knows where they stand."""

    def __init__(self, file: str | None, text: str) -> None:
        self.file, self.places = file, key_positions(text)

    def refuse(
        self, message: str, key: str | None = None, axis: int | None = None, remedy: str | None = None
    ) -> KinematicsError:
        path: tuple[str | int, ...] = (str(key),)
        if axis is not None:
            path = ("axes", axis, *path)
        else:  # keys of the tables beside the axes have names of their own
            path = next((p for p in (path, ("work", *path), ("legs", *path)) if p in self.places), path)
        place = position_of(path, self.places)
        return KinematicsError(message, file=self.file, line=place[0] if place else None, remedy=remedy)

    def machine(self, data: Mapping[str, Any]) -> Machine:
        self.known(data, TOP_KEYS, None)
        blocks = data.get("axes")
        if blocks is None and "legs" in data:
            name = data.get("name", self.file or "hexapod")
            return dataclasses.replace(preset("hexa"), name=str(name))
        if not isinstance(blocks, list) or not blocks or not all(isinstance(b, dict) for b in blocks):
            raise self.refuse("no [[axes]]", "axes", remedy="list the joints from the workpiece to the tool")
        axes = [self.axis(block, i) for i, block in enumerate(blocks)]
        table = [self.carries(block, i) for i, block in enumerate(blocks)]
        late = next((i for i in range(1, len(table)) if table[i] and not table[i - 1]), None)
        if late is not None:
            raise self.refuse(
                f"axis {axes[late].name} carries the work but comes after one that carries the tool",
                "carries", late, "list the joints from the workpiece over the bed to the tool",
            )  # fmt: skip
        frame = data.get("work", {})
        if not isinstance(frame, dict):
            raise self.refuse("work is not a table", "work")
        self.known(frame, WORK_KEYS, None)
        rx, ry, rz = np.radians(self.vector(frame, "rotation_deg", (0.0, 0.0, 0.0)))
        work = np.eye(4)
        work[:3, :3] = rotation(UNIT["z"], rz) @ rotation(UNIT["y"], ry) @ rotation(UNIT["x"], rx)
        work[:3, 3] = self.vector(frame, "origin_mm", (0.0, 0.0, 0.0))
        tool = self.vector(data, "tool_axis", (0.0, 0.0, 1.0))
        if not tool.any():
            raise self.refuse("tool_axis has no direction", "tool_axis")
        name = data.get("name", self.file or "machine")
        if not isinstance(name, str):
            raise self.refuse(f"name = {name!r}: expected a text", "name")
        try:
            machine = Machine(
                name, axes, tip=self.vector(data, "gauge_mm", (0.0, 0.0, 0.0)), tool=tool, work=work, table=sum(table)
            )  # fmt: skip
        except KinematicsError as exc:
            raise self.refuse(exc.message) from exc
        return machine.with_tool(self.number(data, "tool_length_mm", 0.0))

    def legs(self, data: Mapping[str, Any]) -> Hexapod:
        block = data["legs"]
        if not isinstance(block, dict):
            raise self.refuse("legs is not a table", "legs")
        if "axes" in data:
            raise self.refuse("legs and axes exclude each other", "legs")
        self.known(block, LEG_KEYS, None)
        places = {}
        for key, what in (("base_mm", "on the frame"), ("platform_mm", "on the platform")):
            rows = block.get(key)
            if not isinstance(rows, list) or len(rows) != 6:
                raise self.refuse(f"{key}: six joint positions {what} are needed", key)
            places[key] = [self.vector({key: row}, key, None) for row in rows]
        low_high = block.get("length_mm")
        if not isinstance(low_high, list) or len(low_high) != 2:
            raise self.refuse("length_mm: shortest and longest leg are needed", "length_mm")
        low, high = (self.number({"length_mm": v}, "length_mm", 0.0) for v in low_high)
        lean, tilt = (math.radians(self.number(block, f"{k}_joint_deg", 180.0)) for k in ("base", "platform"))
        try:
            return Hexapod(
                np.array(places["base_mm"]), np.array(places["platform_mm"]), self.vector(data, "gauge_mm", (0.0, 0.0, 0.0)),
                (low, high), lean, tilt, self.number(data, "tool_length_mm", 0.0),
            )  # fmt: skip
        except KinematicsError as exc:
            raise self.refuse(exc.message, "length_mm", remedy=exc.remedy) from exc

    def axis(self, block: Mapping[str, Any], i: int) -> Axis:
        kinds = [k.value for k in Kind]
        kind = block.get("kind")
        if kind not in kinds:
            got = f"kind = {kind!r}" if "kind" in block else "kind is missing"
            raise self.refuse(f"axis {i + 1}: {got}", "kind", i, f"give {' or '.join(kinds)}")
        limits = LIMIT_KEYS[Kind(kind)]
        self.known(block, (*AXIS_KEYS, *limits), i)
        name = block.get("name")
        if not (isinstance(name, str) and re.fullmatch(r"[A-Za-z]\w*", name)):
            raise self.refuse(f"axis {i + 1}: name = {name!r}", "name", i, "give a letter, e.g. X or C")
        direction = block.get("direction")
        if isinstance(direction, str) and direction.lstrip("-").lower() in UNIT:
            way = np.array(UNIT[direction.lstrip("-").lower()]) * (-1 if direction.startswith("-") else 1)
        elif isinstance(direction, list):
            way = self.vector(block, "direction", None, i)
        else:
            raise self.refuse(
                f"axis {name}: direction = {direction!r}", "direction", i, "give x, y, z, -x, -y, -z or [i, j, k]"
            )  # fmt: skip
        if "point_mm" in block and kind == Kind.LINEAR:
            raise self.refuse(f"axis {name}: a slide has no point_mm", "point_mm", i, "leave it out")
        lowest, highest, speed, acceleration = limits
        to = math.radians(1.0) if kind == Kind.ROTARY else 1.0
        try:
            return Axis(
                name.upper(), kind, way,
                point=self.vector(block, "point_mm", (0.0, 0.0, 0.0), i),
                sign=self.whole(block, "sign", 1, i),
                lower=to * self.number(block, lowest, -math.inf, i),
                upper=to * self.number(block, highest, math.inf, i),
                max_speed=to / 60.0 * self.number(block, speed, math.inf, i),
                max_acceleration=to * self.number(block, acceleration, math.inf, i),
            )  # fmt: skip
        except KinematicsError as exc:
            if exc.line is not None:
                raise
            blamed = {"sign": "sign", "travel": lowest, "direction": "direction", "max_speed": speed,
                      "max_acceleration": acceleration}  # fmt: skip
            key = next((key for word, key in blamed.items() if word in exc.message), None)
            raise self.refuse(exc.message, key, i, exc.remedy) from exc

    def carries(self, block: Mapping[str, Any], i: int) -> bool:
        what = block.get("carries")
        if what not in ("work", "tool"):
            got = f"carries = {what!r}" if "carries" in block else "carries is missing"
            raise self.refuse(f"axis {block.get('name')}: {got}", "carries", i, "give work or tool")
        return bool(what == "work")

    def known(self, block: Mapping[str, Any], keys: Iterable[str], axis: int | None) -> None:
        allowed = list(keys)
        for key in block:
            if key not in allowed:
                close = get_close_matches(key, allowed, n=1)
                meant = f"did you mean {close[0]}? " if close else ""
                raise self.refuse(f"unknown key {key!r}", key, axis, f"{meant}known: {', '.join(allowed)}")

    def number(self, block: Mapping[str, Any], key: str, default: float, axis: int | None = None) -> float:
        value = block.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
            raise self.refuse(f"{key} = {value!r}: expected a number", key, axis)
        if key in block and not math.isfinite(value):
            raise self.refuse(
                f"{key} = {value!r}: expected a finite number", key, axis, "leave it out for no limit"
            )
        return float(value)

    def whole(self, block: Mapping[str, Any], key: str, default: int, axis: int) -> int:
        value = self.number(block, key, default, axis)
        return int(value) if value == int(value) else 0

    def vector(
        self,
        block: Mapping[str, Any],
        key: str,
        default: tuple[float, float, float] | None,
        axis: int | None = None,
    ) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        value = block.get(key, default)
        good = isinstance(value, list | tuple) and len(value) == 3 and all(
            isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in value
        )  # fmt: skip
        if not good:
            raise self.refuse(f"{key} = {value!r}: expected three finite numbers", key, axis)
        return np.array(value, dtype=np.float64)
