"""The rotary angles of a posted path as a page: curves with their travels, every rewind and pole."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vmachining.machine import JointPath, Machine
from vmachining.report.chart import Curve, Mark, chart
from vmachining.report.figures import Panel, write_page


def write_joints(
    machine: Machine, path: JointPath, lines: Sequence[int], out: Path, *, name: str = "path"
) -> None:
    """lines : (n,) line of the program for every pose."""
    number = np.arange(len(path.joints), dtype=np.float64)
    marks = [
        Mark(j.pose, f"line {lines[j.pose]}: {j.name} turns by {np.degrees(j.turn):.0f} degrees ({j.kind})")
        for j in path.jumps
    ]
    poles = np.flatnonzero(path.singular)
    panels = []
    for k in machine.rotary:
        axis = machine.axes[k]
        angle = np.degrees(path.joints[:, k])
        near = np.ptp(angle) + 90.0  # a travel far outside what is driven would flatten the curve
        levels = [
            (f"end of {axis.name}", limit)
            for limit in (np.degrees(axis.lower), np.degrees(axis.upper))
            if np.isfinite(limit) and angle.min() - near <= limit <= angle.max() + near
        ]
        own = [m for m, j in zip(marks, path.jumps, strict=True) if j.name == axis.name]
        if k == machine.rotary[0]:
            own += [
                Mark(float(p), f"line {lines[p]}: the tool is parallel to {axis.name}", "muted")
                for p in poles[:: max(len(poles) // 200, 1)]
            ]
        travel = (
            f"{np.degrees(axis.lower):g} to {np.degrees(axis.upper):g} degrees"
            if np.isfinite(axis.lower + axis.upper)
            else "no ends"
        )
        curves = [Curve(f"{axis.name} of {machine.name}", number, angle)]
        svg = chart(curves, x="pose", y="degrees", marks=own, levels=levels)
        panels.append(Panel(title=f"{axis.name} · travel: {travel}", svg=svg))
    rewinds = sum(j.kind == "rewind" for j in path.jumps)
    if path.jumps:
        panels.append(Panel(
            title="Where an axis turns far more than the tool",
            head=("pose", "line", "axis", "turns by, degrees", "tool turns by, degrees", "kind"),
            rows=[(j.pose, lines[j.pose], j.name, f"{np.degrees(j.turn):.1f}", f"{np.degrees(j.tool):.2f}", j.kind)
                  for j in path.jumps],
        ))  # fmt: skip
    write_page(
        out, panels, kind="rotary angles", name=name,
        subtitle=f"{machine.name} ({machine.chain}) · {len(number)} poses, fewest rewinds over the whole path",
        chips=[("warn" if rewinds else "ok", f"{rewinds} rewinds"),
               ("warn" if len(path.jumps) > rewinds else "ok", f"{len(path.jumps) - rewinds} swings near a pole"),
               ("", f"{len(poles)} poses parallel to {machine.names[machine.rotary[0]]}")],
    )  # fmt: skip
