"""sweep and bench."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.cli.main import Code
from vmachining.cli.screen import emit
from vmachining.errors import InputError, ToolError
from vmachining.tool import tool_from_mapping

__all__ = ["bench", "sweep"]

PARALLEL = 1e-12
"""Axes that differ by less are one: some ulp of a unit vector."""


def _read(name: str) -> dict[str, Any]:
    try:
        text = sys.stdin.read() if name == "-" else Path(name).read_text(encoding="utf-8")
        data = json.loads(text)
    except OSError as exc:
        raise InputError(f"cannot read: {exc.strerror or exc}", file=name) from exc
    except UnicodeDecodeError as exc:
        raise InputError("not a UTF-8 text", file=name) from exc
    except json.JSONDecodeError as exc:
        raise InputError(f"not valid JSON: {exc.msg}", file=name, line=exc.lineno, col=exc.colno) from exc
    if not isinstance(data, dict):
        raise InputError("want one JSON object with tool, start and end", file=name)
    known = {"tool", "start", "end", "interpolation", "chain"}
    if extra := sorted(set(data) - known):
        raise InputError(f"unknown key {extra[0]!r}", file=name, remedy=f"known: {', '.join(sorted(known))}")
    for key in ("tool", "start", "end"):
        if not isinstance(data.get(key), dict):
            raise InputError(f"{key} is missing or not an object", file=name)
    return data


def _vector(pose: Mapping[str, Any], key: str, where: str, name: str) -> Floats:
    value = pose.get(key)
    good = isinstance(value, list) and len(value) == 3 and all(
        isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in value
    )  # fmt: skip
    if not good:
        raise InputError(f"{where}.{key} = {value!r}: want three finite numbers", file=name)
    return np.array(value, dtype=np.float64)


def _axis(pose: Mapping[str, Any], where: str, name: str) -> Floats:
    axis = _vector(pose, "axis", where, name) if "axis" in pose else np.array([0.0, 0.0, 1.0])
    size = float(np.linalg.norm(axis))
    if size == 0.0:
        raise InputError(f"{where}.axis has no direction", file=name)
    return np.asarray(axis / size)


def _tool_frame(axis: Floats) -> Floats:
    """(3, 3) rotation that takes `axis` to +z."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis])


def sweep(name: str, *, chord: float, as_json: bool) -> int:
    """`vmachining sweep`: the tool keeps its direction; turning it is refused by name."""
    if not (math.isfinite(chord) and chord > 0):
        raise InputError(f"--chord {chord}: want a positive number")
    data = _read(name)
    mode = data.get("interpolation", "axis")
    if mode not in ("axis", "rotary"):
        raise InputError(f"interpolation {mode!r}: axis or rotary is wanted", file=name)
    if mode == "rotary":
        raise InputError("interpolation 'rotary' is not supported yet", file=name, remedy="take axis")
    try:
        tool = tool_from_mapping(data["tool"])
    except ToolError as exc:
        raise InputError(exc.message, file=name, word=exc.word, remedy=exc.remedy) from exc
    axes = [_axis(data[where], where, name) for where in ("start", "end")]
    if float(np.linalg.norm(axes[0] - axes[1])) > PARALLEL:
        raise InputError(
            "a tool that turns while it moves is not supported yet", file=name, remedy="give equal axes"
        )
    start, end = (
        _tool_frame(axes[0]) @ _vector(data[where], "cl_mm", where, name) for where in ("start", "end")
    )
    from vmachining.job import swept_volume
    from vmachining.sweep import Sweep

    begin = time.perf_counter()
    bracket = swept_volume(Sweep(tool, start, end), chord)
    record = {
        "volume_mm3": bracket.estimate, "lo_mm3": bracket.lo, "hi_mm3": bracket.hi,
        "brep_mm3": None, "brep_valid": None, "brep_faces": None,
        "seconds": {"mesh": time.perf_counter() - begin},
    }  # fmt: skip
    if as_json:
        emit(record)
    else:
        print(f"{bracket.estimate:.9g} mm3   [{bracket.lo:.9g}, {bracket.hi:.9g}]")
    return Code.DONE


def bench(names: list[str], *, as_json: bool) -> int:
    """`vmachining bench`."""
    from vmachining.bench import CASES

    for case in names:
        if case not in CASES:
            raise InputError(f"unknown case {case!r}", remedy=f"known: {', '.join(sorted(CASES))}")
    for case in names or sorted(CASES):
        for record in CASES[case]():
            emit(record)
            sys.stdout.flush()
    return Code.DONE
