"""`VectorSettings`: what a job asks of discrete vectors; a value that `Options` can carry without loading the engine."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Literal

from vmachining.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class VectorSettings:
    """Lengths in mm, angles in rad.

    mode : upright vectors, vectors along the normals, or both (hybrid).
    pitch : gamma, of the grid of upright vectors. spacing : delta, of points on features. theta_v : slope above which a
        facet is a wall. What is None follows from the others: gamma = delta cos(theta_v).
    theta_sharp : angle between facets above which their edge is sharp.
    allowance : length of normal vectors before the first cut at most; None: `depth`.
    depth : largest overcut that normal vectors measure.
    casting : the raw part has this allowance everywhere, instead of its own stock.

    Raises InputError: A length or an angle out of range; gamma not below delta where theta_v has to follow from them.
    """

    mode: Literal["dvv", "dnv", "hybrid"] = "hybrid"
    pitch: float | None = None
    spacing: float | None = None
    theta_v: float | None = None
    theta_sharp: float = pi / 6
    allowance: float | None = None
    depth: float = 10.0
    casting: float | None = None

    def __post_init__(self) -> None:
        if self.mode not in ("dvv", "dnv", "hybrid"):
            raise InputError(f"mode {self.mode!r} of the vectors", remedy="one of dvv, dnv, hybrid")
        for name in ("pitch", "spacing", "allowance", "depth", "casting"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < float("inf"):
                raise InputError(f"vectors: {name} {value:g} mm is not a length")
        for name, value in (("theta_v", self.theta_v), ("theta_sharp", self.theta_sharp)):
            if value is not None and not 0.0 < value < pi / 2:
                raise InputError(f"vectors: {name} {value:g} rad is not between 0 and a right angle")
