"""A machine as a page: its chain as a picture, where its axes lie, class, travels, limits, legs and their reach."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.job.mill import Mill
from vmachining.machine import PRESETS, Axis, Machine, preset, preset_options
from vmachining.report.chart import Curve, chart
from vmachining.report.figures import Panel, write_page

CLASSES = {
    (2, 0): "both rotary axes carry the workpiece", (1, 1): "one rotary axis carries the workpiece, one the tool",
    (0, 2): "both rotary axes carry the tool", (0, 0): "no rotary axis",
    (1, 0): "one rotary axis, it carries the workpiece", (0, 1): "one rotary axis, it carries the tool",
}  # fmt: skip
"""Of the sources: rotary axes of the workpiece / of the tool."""

TILTS_DEG = (0.0, 10.0, 20.0, 30.0)
ISO = np.array([[0.82, 0.55, 0.0], [0.32, -0.42, -0.92]])
"""Rows: to the right and down of the picture, of x, y and z."""


def machine_record(mill: Mill) -> dict[str, Any]:
    """Name, configuration, class, axes, limits, options and legs of a machine; mm, degrees, minutes."""
    chain = mill.chain or preset("xyz")
    turning = [k < chain.table for k in chain.rotary]
    count = (sum(turning), len(turning) - sum(turning))
    stated = mill.keys.model_dump(exclude_unset=True, exclude={"chain", "options", "file"})
    name = mill.keys.chain or mill.name
    words = (
        "hexapod head; a machine file states its legs"
        if name == "hexa"
        else CLASSES.get(count, "a custom chain")
    )
    words = words if mill.legs is None else "six legs carry the spindle"
    given = mill.keys.options or {}
    return {
        "name": mill.name, "configuration": chain.chain,
        "class": "hexapod" if mill.legs is not None else "/".join(map(str, count)), "words": words,
        "axes": [_axis(axis, k < chain.table) for k, axis in enumerate(chain.axes)], "tool_axis": chain.tool.tolist(),
        "tip_mm": chain.tip.tolist(), "limits": stated,
        "options": {**preset_options(name), **given} if name in PRESETS else {},
        "legs": None if mill.legs is None else _legs(mill),
    }  # fmt: skip


def _axis(axis: Axis, on_table: bool) -> dict[str, Any]:
    turn = 180.0 / math.pi if axis.is_rotary else 1.0
    least, most, speed, push = (
        float(v) * turn if math.isfinite(v) else None for v in (axis.lower, axis.upper, axis.max_speed, axis.max_acceleration)
    )  # fmt: skip
    return {
        "name": axis.name, "kind": axis.kind.value, "carries": "work" if on_table else "tool", "unit": axis.unit,
        "direction": axis.direction.tolist(), "point_mm": axis.point.tolist() if axis.is_rotary else None, "sign": axis.sign,
        "min": least, "max": most, "max_speed_min": None if speed is None else 60.0 * speed, "max_acceleration_s2": push,
    }  # fmt: skip


def _legs(mill: Mill) -> dict[str, Any]:
    assert mill.legs is not None
    home = mill.legs.legs([mill.legs.home], [[0.0, 0.0, 1.0]]).length[0]
    reach = mill.legs.length[1] - mill.legs.length[0]
    heights = np.linspace(-reach, reach, 25)
    tilts = {t: mill.legs.workspace(heights, math.radians(t), step_mm=reach / 50.0) for t in TILTS_DEG}
    return {
        "length_mm": list(mill.legs.length), "home_mm": home.tolist(),
        "base_joint_deg": math.degrees(mill.legs.base_cone), "platform_joint_deg": math.degrees(mill.legs.platform_cone),
        "heights_mm": heights.tolist(),
        "radius_mm": {f"{t:g}": [None if v < 0 else v for v in r.tolist()] for t, r in tilts.items()},
    }  # fmt: skip


def write_machine(mill: Mill, out: Path) -> None:
    told, chain = machine_record(mill), mill.chain or preset("xyz")
    panels = [
        Panel(
            title=f"Chain {told['configuration']}", svg=_chain(chain),
            text="From the workpiece over the bed to the tool. A primed axis carries the workpiece.",
        ),
        Panel(title="Where the axes lie at home", svg=_places(chain), text="All joints zero, mm in machine axes."),
        Panel(
            title="Axes",
            head=("axis", "kind", "carries", "direction", "through, mm", "counts", "travel", "speed per min", "per s²"),
            rows=[
                (a["name"], a["kind"], a["carries"], _triple(a["direction"]), _triple(a["point_mm"]),
                 "with it" if a["sign"] > 0 else "against it", _travel(a), _number(a["max_speed_min"], a["unit"]),
                 _number(a["max_acceleration_s2"], a["unit"]))
                for a in told["axes"]
            ],
        ),
        Panel(
            title="Limits", head=("key of [machine]", "value"), rows=list(told["limits"].items()),
            text="" if told["limits"] else "Only those of the axes: a limit that is not stated does not apply.",
        ),
    ]  # fmt: skip
    if told["options"]:
        panels.append(
            Panel(title="Options of this preset", head=("option", "value"), rows=list(told["options"].items()),
                  text="In a job: options = { … } under [machine]; lengths in mm.")
        )  # fmt: skip
    if (legs := told["legs"]) is not None:
        curves = [Curve(f"tool at {t} degrees", np.array(legs["heights_mm"]), np.array(r, dtype=np.float64))
                  for t, r in legs["radius_mm"].items()]  # fmt: skip
        panels.append(
            Panel(title="Reach of the legs", svg=chart(curves, x="height of the tip from home, mm", y="radius, mm", zero=True),
                  text="Radius about the middle within which every tip is reached with the tool leaning to all sides.")
        )  # fmt: skip
        low, high = legs["length_mm"]
        panels.append(
            Panel(title="Legs at home", head=("leg", "length, mm", "to its ends, mm"),
                  rows=[(k + 1, f"{v:.3f}", f"{v - low:.3f} / {high - v:.3f}") for k, v in enumerate(legs["home_mm"])],
                  text=f"Joints lean from home by {legs['base_joint_deg']:g} degrees on the frame and by "
                       f"{legs['platform_joint_deg']:g} on the platform.")
        )  # fmt: skip
    write_page(
        out, panels, kind="machine", name=told["name"], subtitle=f"{told['configuration']} · {told['words']}",
        chips=[("", f"class {told['class']}"), ("", f"{len(chain.slides)} slides, {len(chain.rotary)} rotary axes")],
    )  # fmt: skip


def _triple(vector: Sequence[float] | None) -> str:
    return "" if vector is None else ", ".join(f"{v + 0.0:.6g}" for v in vector)


def _number(value: float | None, unit: str) -> str:
    return "not stated" if value is None else f"{value:.6g} {unit}"


def _travel(axis: dict[str, Any]) -> str:
    if axis["min"] is None and axis["max"] is None:
        return "not stated"
    low, high = ("∞" if v is None else f"{v:.6g}" for v in (axis["min"], axis["max"]))
    return f"{'-' * (low == '∞')}{low} to {high} {axis['unit']}"


def _svg(width: float, height: float, parts: Sequence[str], label: str) -> str:
    return (
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{escape(label)}" style="width:100%;max-width:'
        f'{width:.0f}px;height:auto" font-size="14" fill="var(--ink)">{"".join(parts)}</svg>'
    )


def _chain(chain: Machine) -> str:
    """Boxes in a row; a double arrow for a slide, a turning arrow for a rotary axis."""
    joints = [(axis, k < chain.table) for k, axis in enumerate(chain.axes)]
    boxes: list[tuple[str, Axis | None]] = [("workpiece", None)]
    boxes += [(f"{axis.name}'", axis) for axis, table in joints if table]
    boxes += [("bed", None), *((axis.name, axis) for axis, table in joints if not table), ("tool", None)]
    wide, gap, out = 92.0, 26.0, []
    for k, (name, axis) in enumerate(boxes):
        x = 4.0 + k * (wide + gap)
        mid = x + wide / 2.0
        if k:
            out.append(f'<path d="M{x - gap:.0f} 50H{x:.0f}" stroke="var(--muted)" stroke-width="3"/>')
        fill = "var(--code)" if axis is None else "var(--band)" if axis.is_rotary else "var(--panel)"
        top = 55 if axis is None else 30
        out += [
            f'<rect x="{x:.0f}" y="6" width="{wide:.0f}" height="88" rx="9" fill="{fill}" stroke="var(--muted)"/>',
            f'<text x="{mid:.0f}" y="{top}" text-anchor="middle" font-weight="600">{escape(name)}</text>',
        ]
        if axis is not None:
            if axis.is_rotary:
                out.append(_arrow(f"M{mid - 13:.1f} 58a13 9 0 1 1 22 6", mid + 9, 64, 0.55, 0.83))
            else:
                way = f"M{mid - 22:.1f} 54H{mid + 22:.1f}"
                out += [_arrow(way, mid + 22, 54, 1, 0), _arrow("", mid - 22, 54, -1, 0)]
            out.append(f'<text x="{mid:.0f}" y="86" text-anchor="middle" fill="var(--muted)" font-size="11">'
                       f"{'about' if axis.is_rotary else 'along'} {_along(axis.direction)}</text>")  # fmt: skip
    return _svg(len(boxes) * (wide + gap) - gap + 8.0, 100.0, out, f"chain {chain.chain}")


def _along(direction: Floats) -> str:
    """x, -y, or three numbers."""
    for letter, unit in zip("xyz", np.eye(3), strict=True):
        if abs(abs(direction @ unit) - 1.0) < 1e-12:
            return ("-" if direction @ unit < 0 else "") + letter
    return "(" + ", ".join(f"{v:.3g}" for v in direction) + ")"


def _arrow(way: str, x: float, y: float, dx: float, dy: float, colour: str = "ink") -> str:
    """A line and the head at its end, which points along (dx, dy)."""
    size = math.hypot(dx, dy) or 1.0
    a, b = 6.0 * dx / size, 6.0 * dy / size
    head = f"M{x - 1.6 * a + b:.1f} {y - 1.6 * b - a:.1f}L{x:.1f} {y:.1f}L{x - 1.6 * a - b:.1f} {y - 1.6 * b + a:.1f}"
    return f'<path d="{way}{head}" fill="none" stroke="var(--{colour})" stroke-width="1.8"/>'


def _places(chain: Machine) -> str:
    """Seen from the front, from the right and above: lines of the rotary axes, slides, and the tool."""
    turning = [chain.axes[k] for k in chain.rotary]
    points = np.array([np.zeros(3), chain.tip, *(axis.point for axis in turning)])
    reach = 0.9 * max(float(np.ptp(points, axis=0).max()), 50.0)
    flat = np.array([ISO @ (p + s * reach * d) for p in points for d in np.eye(3) for s in (-1.05, 1.05)])
    low, size = flat.min(axis=0), float(np.ptp(flat, axis=0).max())
    scale, out = 520.0 / size, []

    def at(p: Floats) -> Floats:
        return np.asarray((ISO @ p - low) * scale + 30.0)

    def line(a: Floats, b: Floats, colour: str, name: str, dash: str = "") -> None:
        (x0, y0), (x1, y1) = at(a), at(b)
        way = f'<path d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}" stroke="var(--{colour})" stroke-width="1.8" {dash}/>'
        out.append(way + _arrow("", x1, y1, x1 - x0, y1 - y0, colour))
        out.append(f'<text x="{x1 + 8:.1f}" y="{y1 + 4:.1f}" fill="var(--{colour})">{escape(name)}</text>')

    for k in chain.slides:
        line(np.zeros(3), 0.7 * reach * chain.axes[k].direction, "muted", chain.axes[k].name)
    for axis, colour in zip(turning, ("first", "fourth", "second", "third"), strict=False):
        ends = (axis.point - reach * axis.direction, axis.point + reach * axis.direction)
        through = f"{axis.name} through {_triple(axis.point.tolist())}"
        line(*ends, colour, through, 'stroke-dasharray="9 3 2 3"')
        side = np.cross(axis.direction, np.eye(3)[int(np.argmin(np.abs(axis.direction)))])
        side, up = side / np.linalg.norm(side), np.cross(axis.direction, side / np.linalg.norm(side))
        ring = [at(axis.point + 0.6 * reach * axis.direction + 0.18 * reach * (math.cos(t) * side + axis.sign * math.sin(t) * up))
                for t in np.linspace(0.3, 5.2, 30)]  # fmt: skip
        way = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in ring)
        (x, y), (dx, dy) = ring[-1], ring[-1] - ring[-2]
        out.append(_arrow(way, x, y, dx, dy, colour))
    line(chain.tip + 0.8 * reach * chain.tool, chain.tip, "accent", "tool")
    height = float(np.ptp(flat, axis=0)[1]) * scale + 60.0
    return _svg(float(np.ptp(flat, axis=0)[0]) * scale + 260.0, height, out, "where the axes lie")
