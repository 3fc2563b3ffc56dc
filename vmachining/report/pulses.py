"""Pulses of the DDA beside the programmed path, as a page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line
from vmachining.machine import PulseBlock
from vmachining.report.figures import html_name, write_page
from vmachining.report.numbers import plural
from vmachining.report.scene import Layer, Scene

PLACES = 91
"""Of a drawn arc."""


def write_pulses(
    path: Path,
    blocks: Sequence[PulseBlock],
    paths: Sequence[Line | Arc],
    blu_mm: float,
    *,
    name: str = "pulses",
) -> None:
    """One page, whole or not at all; a path in one plane is seen from above.

    Raises InputError: The name does not end in .html.
    """
    t = np.linspace(0.0, 1.0, PLACES)
    asked = [p.position(t if isinstance(p, Arc) else [0.0, 1.0]) for p in paths]
    made = [block.train.positions(block.start) * np.float64(blu_mm) for block in blocks]
    layers = [Layer(name="programmed", points=_joined(asked), colour="#66758a"),
              Layer(name="pulses", points=_joined(made), colour="#d92d20")]  # fmt: skip
    write_page(
        html_name(path, "--plot"), [], kind="dda pulses", name=Path(name).name,
        subtitle=f"{plural(len(blocks), 'block')} · {plural(sum(len(b.train.tick) for b in blocks), 'pulsing tick')} · "
        f"basic length unit {blu_mm:g} mm",
        scene=Scene(title="Path and pulses", words="The programmed path and the steps that the pulses make", layers=layers),
    )  # fmt: skip


def _joined(lines: Sequence[Floats]) -> Floats:
    """All polylines in one array, NaN between them."""
    gap = np.full((1, 3), np.nan)
    return np.concatenate([np.zeros((0, 3)), *(part for line in lines for part in (line, gap))])
