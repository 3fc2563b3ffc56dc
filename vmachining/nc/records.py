"""Moves and findings as plain dictionaries, ready for JSON."""

from __future__ import annotations

import math
from typing import Any

from vmachining.nc.arcs import PLANES
from vmachining.nc.model import Finding, Motion, Move

_AXES = {plane.name: (plane.first, plane.second) for plane in PLANES.values()}


def move_record(move: Move, coordinates: str = "machine") -> dict[str, Any]:
    """One canonical motion.

    coordinates : "machine" (all offsets and tool length applied) or "program" (what the active work offset
        sees). The arc centre is shifted like the end point.
    Raises ValueError: Other coordinates.
    """
    if coordinates not in ("machine", "program"):
        raise ValueError(f"coordinates '{coordinates}': machine or program is expected")
    end = move.end_machine if coordinates == "machine" else move.end_program
    rotary = move.rotary_deg if coordinates == "machine" else move.rotary_program
    center = None
    if move.center is not None:
        a, b = _AXES[move.plane]
        aside = (move.center[0] - move.end[a], move.center[1] - move.end[b])
        if coordinates == "program" and move.rotation_deg != 0.0:  # arcs lie in XY then
            c, s = math.cos(math.radians(move.rotation_deg)), math.sin(math.radians(move.rotation_deg))
            aside = (c * aside[0] + s * aside[1], c * aside[1] - s * aside[0])
        center = [end[a] + aside[0], end[b] + aside[1]]
    arc = move.motion in (Motion.ARC_CW, Motion.ARC_CCW)
    return {
        "line": move.line,
        "n": move.n,
        "motion": move.motion.value,
        "end_mm": list(end),
        "rotary_deg": dict(rotary or {}),
        "plane": move.plane,
        "center_mm": center,
        "turns": move.turns if arc else None,
        "feed_mm_min": move.feed_mm_min,
        "tool": move.tool,
        "spindle_rpm": move.spindle_rpm,
        "coolant": move.coolant,
        "dwell_s": move.dwell_s if move.motion is Motion.DWELL else None,
        **(
            {}
            if move.circle is None
            else {"circle": {"center_mm": list(move.circle[0]), "normal": list(move.circle[1])}}
        ),
        **({} if move.axis_end is None else {"axis": list(move.axis_end)}),
        **({"tcp": True} if move.tcp and move.rotary_deg is not None else {}),
    }


def finding_record(finding: Finding) -> dict[str, Any]:
    """One finding of the tester."""
    return {
        "line": finding.line,
        "col": finding.col,
        "len": finding.length,
        "n": finding.n,
        "word": finding.word,
        "code": finding.code,
        "severity": finding.severity,
        "message": finding.message,
        "hint": finding.hint,
    }
