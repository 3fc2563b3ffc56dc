"""A machine in words, for who must know where its rotary axes lie: presets have their own offsets."""

from __future__ import annotations

from typing import Any

from vmachining.machine.axis import Kind
from vmachining.machine.chain import Machine


def described(machine: Machine) -> dict[str, Any]:
    """name; axes from the workpiece to the tool; rotary: a sentence for each rotary axis, lengths in mm."""
    rotary = [
        f"{axis.name} turns about {_triple(axis.direction)} through {_triple(axis.point)} mm"
        for axis in machine.axes
        if axis.kind is Kind.ROTARY
    ]
    return {"name": machine.name, "axes": [axis.name for axis in machine.axes], "rotary": rotary}


def _triple(vector: Any) -> str:
    return f"({', '.join(f'{v + 0.0:.6g}' for v in vector)})"
