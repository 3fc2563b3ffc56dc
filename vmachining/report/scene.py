"""Bodies, lines and points in three dimensions on a small page, drawn by the page's own program: `Scene`, and the pages of one
sweep (its solid, the way of the tip) and of the pulses of the DDA beside the programmed path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.geometry import Arc, Line
from vmachining.machine import PulseBlock
from vmachining.report.figures import html_name, write_page
from vmachining.report.numbers import plural
from vmachining.report.paper.body import COARSE_MM, facets
from vmachining.report.payload import Payload, packed
from vmachining.sweep import Sweep
from vmachining.tolerance import CHORD_MM


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Layer:
    """points : (n, 3) mm. With triangles (m, 3) a body; with values (n,) mm, coloured, and blocks (n,), -1 for none, places that
    tell them under the pointer; else a line, which NaN breaks. size : px of a place."""

    name: str
    points: Floats
    triangles: Ints | None = None
    values: Floats | None = None
    blocks: Ints | None = None
    colour: str = "#1b2733"
    opacity: float = 1.0
    size: float = 3.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """reach : mm at which the colours of values end, None without values. words : the view in a sentence."""

    title: str
    words: str
    layers: Sequence[Layer]
    reach: float | None = None

    def payload(self) -> Payload:
        arrays: dict[str, Any] = {}
        told = []
        for k, layer in enumerate(self.layers):
            kind = "body" if layer.triangles is not None else "line" if layer.values is None else "points"
            record = {"kind": kind, "name": layer.name, "opacity": layer.opacity, "size": layer.size}
            record["colour"] = None if kind == "points" else layer.colour
            for name, values, form in (
                ("points", layer.points, "<f4"), ("triangles", layer.triangles, "<u4"), ("values", layer.values, "<f4"),
                ("blocks", layer.blocks, "<i4"),
            ):  # fmt: skip
                if values is not None:
                    record[name] = f"{name}_{k}"
                    arrays[f"{name}_{k}"] = np.asarray(values).astype(form).ravel()
            told.append(record)
        return Payload(packed({"scene": told, "words": self.words, "reach": self.reach}, arrays), 1, 0)


TIP_PLACES = 33
"""Of the path of a tip."""


def plot_sweep(path: Path, sweep: Sweep, chord: float = CHORD_MM) -> None:
    """Write the picture as one HTML file that opens offline.

    chord : mm, of the facets; not finer than a picture shows.
    """
    chord = max(chord, COARSE_MM)
    corners, triangles = facets(sweep, chord)
    tip = np.array([sweep.path.position(float(t)) for t in np.linspace(0.0, 1.0, TIP_PLACES)])
    layers = [Layer(name="swept solid", points=corners, triangles=triangles, colour="#8fb1d0", opacity=0.75),
              Layer(name="tip of the tool", points=tip, colour="#b3261e")]  # fmt: skip
    write_page(
        path, [], kind="sweep", name=path.stem, subtitle=f"facets within {chord:g} mm · all lengths in mm",
        scene=Scene(title="Swept solid", words="The solid that the tool sweeps, and the path of its tip", layers=layers),
    )  # fmt: skip


ARC_PLACES = 91
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
    t = np.linspace(0.0, 1.0, ARC_PLACES)
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
