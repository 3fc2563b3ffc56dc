"""A single sweep as JSON: tool, start, end, and how the tool axis turns between them."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.errors import InputError, SweepError, ToolError
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.textfile import parse_json, read_text
from vmachining.tomlplaces import nearest
from vmachining.tool import Tool, tool_from_mapping

KEYS = ("tool", "start", "end", "interpolation", "chain", "control_height_mm")
POSE_KEYS = {"axis": ("cl_mm", "axis"), "rotary": ("cl_mm", "rotary_deg")}
LETTERS = {"ac": "ac", "bc": "bc", "ab": "ab", "hexa": "ac"}


def read_sweep(name: str) -> Sweep:
    """The sweep in a JSON file, or on standard input if `name` is "-".

    `interpolation` is "axis" (great circle between two axes, the default) or "rotary" (linear angles of `chain`,
    one of ac, bc, ab, hexa). Two equal axes make a motion without turning. `control_height_mm`: the point that moves
    linearly lies so far above the tip on the axis, and `cl_mm` says where it is.

    Raises InputError: Whatever cannot be read or swept; names the file and the key.
    """
    data = _read(name)
    mode = data.get("interpolation", "axis")
    if mode not in POSE_KEYS:
        raise InputError(f"interpolation {mode!r}: axis or rotary is expected", file=name)
    for where in ("start", "end"):
        _known(data[where], POSE_KEYS[mode], f"{where}.", name)
    tool = _tool(data["tool"], name)
    first, last = (_vector(data[where], "cl_mm", where, name) for where in ("start", "end"))
    height = data.get("control_height_mm", 0.0)
    if not _finite(height):
        raise InputError(f"control_height_mm = {height!r}: expected a finite number", file=name)
    try:
        if mode == "axis":
            begin, finish = (_axis(data[where], where, name) for where in ("start", "end"))
            if height == 0.0:
                return Sweep(tool, Pose(first, begin), Pose(last, finish))
            return Sweep.along(tool, Turn.through(first, last, "axis", begin, finish, control_height=height))
        chain = data.get("chain", "ac")
        if chain not in LETTERS:
            raise InputError(f"chain {chain!r}: one of {', '.join(LETTERS)} is expected", file=name)
        angles = [_angles(data[where], LETTERS[chain], where, name) for where in ("start", "end")]
        return Sweep.along(tool, Turn.through(first, last, chain, *angles, control_height=float(height)))
    except SweepError as exc:
        raise InputError(exc.message, file=name, remedy=exc.remedy) from exc


def _read(name: str) -> dict[str, Any]:
    try:
        text = sys.stdin.read() if name == "-" else read_text(Path(name), "sweep", InputError)
        data = parse_json(text)
    except OSError as exc:
        raise InputError(f"cannot read: {exc.strerror or exc}", file=name) from exc
    except UnicodeDecodeError as exc:
        raise InputError("not a UTF-8 text", file=name) from exc
    except json.JSONDecodeError as exc:
        raise InputError(f"not valid JSON: {exc.msg}", file=name, line=exc.lineno, col=exc.colno) from exc
    if not isinstance(data, dict):
        raise InputError("give one JSON object with tool, start and end", file=name)
    _known(data, KEYS, "", name)
    for key in ("tool", "start", "end"):
        if not isinstance(data.get(key), dict):
            raise InputError(f"{key} is missing or not an object", file=name)
    return data


def _known(data: Mapping[str, Any], keys: tuple[str, ...], where: str, name: str) -> None:
    for key in data:
        if key not in keys:
            close = nearest(key, keys)
            remedy = f"did you mean {close!r}?" if close else f"known: {', '.join(keys)}"
            raise InputError(f"unknown key {where + key!r}", file=name, remedy=remedy)


def _tool(mapping: Mapping[str, Any], name: str) -> Tool:
    try:
        return tool_from_mapping(mapping)
    except ToolError as exc:
        raise InputError(exc.message, file=name, word=exc.word, remedy=exc.remedy) from exc


def _vector(pose: Mapping[str, Any], key: str, where: str, name: str) -> Floats:
    value = pose.get(key)
    if not (isinstance(value, list) and len(value) == 3 and all(map(_finite, value))):
        raise InputError(f"{where}.{key} = {value!r}: expected three finite numbers", file=name)
    return np.array(value, dtype=np.float64)


def _axis(pose: Mapping[str, Any], where: str, name: str) -> Floats:
    return _vector(pose, "axis", where, name) if "axis" in pose else np.array([0.0, 0.0, 1.0])


def _angles(pose: Mapping[str, Any], letters: str, where: str, name: str) -> dict[str, float]:
    """rad by letter; a letter that is not given is 0."""
    given = pose.get("rotary_deg")
    if not isinstance(given, dict) or not set(given) <= set(letters) or not all(map(_finite, given.values())):
        raise InputError(
            f"{where}.rotary_deg = {given!r}: expected degrees of {' and '.join(letters)}", file=name
        )
    return {letter: math.radians(given.get(letter, 0.0)) for letter in letters}


def _finite(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
