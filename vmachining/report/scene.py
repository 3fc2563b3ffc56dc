"""Bodies, lines and points in three dimensions on a small page, drawn by the page's own program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.report.payload import Payload, packed


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
