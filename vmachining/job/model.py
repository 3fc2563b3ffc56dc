"""The job file as data: which keys exist, of which type and within which limits.

Units: a key that names its unit (`diameter_mm`, `chord_mm`, `rapid_mm_min`; the pairs of `holder`, which are
documented as `[r_mm, z_mm]`) keeps it whatever `units` says. `units = "inch"` applies to the lengths that do
not: `home`, the stock's `box` and `cylinder`, `apt`, `profile`, and the coordinates of an STL file. A program
states its own unit (G20, G21); a STEP file carries its own.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

__all__ = [
    "LATER",
    "TOOL_KEYS",
    "Accuracy",
    "Box",
    "Cylinder",
    "Feed",
    "JobFile",
    "Machine",
    "ProgramKeys",
    "Stock",
]

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
Text = Annotated[str, Field(strict=True, min_length=1)]
Pair = tuple[Number, Number]
Triple = tuple[Number, Number, Number]

TOOL_KEYS = frozenset(
    (
        "number", "type", "name", "diameter_mm", "corner_radius_mm", "flute_length_mm", "length_mm", "flutes",
        "helix_deg", "taper_deg", "apt", "profile", "shank_diameter_mm", "holder",
    )
)  # fmt: skip

LATER: dict[tuple[str, str], tuple[str, frozenset[str]]] = {
    ("feed", "strategy"): ("volume", frozenset(("chip_area", "force"))),
}
"""Values that the interface names and that this version refuses by name rather than ignores, and what it has."""


class Keys(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ProgramKeys(Keys):
    """[program]; subroutines : folders, relative to the job file."""

    file: Text
    dialect: Literal["iso", "mts", "apt", "poses"] = "iso"
    home: Triple = (0.0, 0.0, 100.0)
    block_delete: Annotated[bool, Field(strict=True)] = False
    crc_entry: Literal["prev", "next"] = "prev"
    crc_corner: Literal["arc", "exact", "miter"] = "arc"
    taps: Literal["reference", "axis"] = "reference"
    subroutines: tuple[Text, ...] = ()


class Machine(Keys):
    """[machine]; a limit that is not given does not bind.

    chain : name of a machine, see `vmachining.machine.PRESETS`. file : a machine file instead.
    """

    chain: Text | None = None
    file: Text | None = None
    rapid_mm_min: Positive | None = None
    max_feed_mm_min: Positive | None = None
    max_acceleration_mm_s2: Positive | None = None
    axis_feed_mm_min: tuple[Positive, Positive, Positive] | None = None


class Box(Keys):
    """An axis-aligned block, opposite corners."""

    min: Triple
    max: Triple

    @model_validator(mode="after")
    def _ordered(self) -> Box:
        if any(lo >= hi for lo, hi in zip(self.min, self.max, strict=True)):
            raise ValueError(f"box min {list(self.min)} must lie below max {list(self.max)} in x, y and z")
        return self


class Cylinder(Keys):
    """A round bar standing along z: centre (x, y), radius, lowest and highest z."""

    center: Pair
    radius: Positive
    z: Pair

    @model_validator(mode="after")
    def _ordered(self) -> Cylinder:
        if self.z[0] >= self.z[1]:
            raise ValueError(f"cylinder z {list(self.z)}: the first value must lie below the second")
        return self


class Stock(Keys):
    """[stock]: exactly one of four ways to say it."""

    box: Box | None = None
    cylinder: Cylinder | None = None
    step: Text | None = None
    stl: Text | None = None

    @model_validator(mode="after")
    def _one(self) -> Stock:
        given = [name for name in ("box", "cylinder", "step", "stl") if getattr(self, name) is not None]
        if len(given) != 1:
            got = "none of them" if not given else " and ".join(given)
            raise ValueError(f"[stock] wants exactly one of box, cylinder, step, stl, got {got}")
        return self


class Accuracy(Keys):
    """[accuracy]"""

    chord_mm: Positive = 0.01


class Feed(Keys):
    """[feed]; see the feed room for what tau, min_length_mm and rule do."""

    strategy: Literal["volume"] = "volume"
    reference: Literal["auto", "max", "mean"] | Positive = "auto"
    min_mm_min: Positive = 60.0
    max_mm_min: Positive = 3000.0
    insert_blocks: Annotated[bool, Field(strict=True)] = False
    tau: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0)] = 0.25
    min_length_mm: Positive = 0.5
    rule: Literal["safe", "mean"] = "safe"

    @model_validator(mode="after")
    def _ordered(self) -> Feed:
        if self.min_mm_min > self.max_mm_min:
            raise ValueError(f"min_mm_min {self.min_mm_min:g} is above max_mm_min {self.max_mm_min:g}")
        return self


class JobFile(Keys):
    """The whole file."""

    name: Text = "job"
    units: Literal["mm", "inch"] = "mm"
    program: ProgramKeys
    machine: Machine = Machine()
    tools: Annotated[list[dict[str, Any]], Field(min_length=1)]
    stock: Stock
    accuracy: Accuracy = Accuracy()
    feed: Feed | None = None
