"""The job file as data: which keys exist, of which type and within which limits.

Units: a key that names its unit (`diameter_mm`, `chord_mm`, `rapid_mm_min`; the pairs of `holder`, which are
documented as `[r_mm, z_mm]`) keeps it whatever `units` says. `units = "inch"` applies to the lengths that do
not: `home`, the stock's `box` and `cylinder`, `apt`, `profile`, and the coordinates of an STL file. A program
states its own unit (G20, G21); a STEP file carries its own.
"""

from __future__ import annotations

import ast
import inspect
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticKnownError

from vmachining.machine import CORNER_TOLERANCE_MM
from vmachining.nc.settings import (
    AlongZ,
    ArcCentres,
    Compensation,
    CrcCorner,
    CrcEntry,
    Dwell,
    Increments,
    Lathe,
    Taps,
    UnitName,
)
from vmachining.tolerance import CHORD_MM, WIDTH, WIDTH_MM3
from vmachining.tool.table import MEANINGS

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Yes = Annotated[bool, Field(strict=True)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
NotNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0)]
Text = Annotated[str, Field(strict=True, min_length=1)]
Pair = tuple[Number, Number]
Triple = tuple[Number, Number, Number]


def _dialect(name: str) -> str:
    """A language that is read here, or by an installed package."""
    from vmachining.nc.dialects import AUTO, TABLE

    if name != AUTO and name not in TABLE:
        *names, last = (repr(choice) for choice in (AUTO, *TABLE))
        raise PydanticKnownError("literal_error", {"expected": f"{', '.join(names)} or {last}"})
    return name


Dialect = Annotated[Text, AfterValidator(_dialect)]


def _rising(pair: tuple[float, float]) -> tuple[float, float]:
    if pair[0] >= pair[1]:
        raise ValueError(f"{list(pair)}: give the lower value first")
    return pair


Range = Annotated[Pair, AfterValidator(_rising)]

TOOL_KEYS = frozenset(MEANINGS)


def meanings(model: type[Any]) -> dict[str, str]:
    """What the keys of a table mean, as written below them; pydantic would read it from the source at every start."""
    table: Any = ast.parse(inspect.getsource(model)).body[0]
    found = {}
    for key, text in pairwise(table.body):
        match key, text:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(meaning))):
                found[name] = inspect.cleandoc(meaning)
    return found


def _explain(schema: dict[str, Any], model: type[Any]) -> None:
    for key, text in meanings(model).items():
        schema["properties"][key]["description"] = text


class Keys(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, json_schema_extra=_explain)


def _exactly_one(keys: Keys, table: str, *names: str) -> None:
    given = [name for name in names if getattr(keys, name) is not None]
    if len(given) != 1:
        got = "both" if len(given) == len(names) == 2 else " and ".join(given) or "none of them"
        raise ValueError(f"[{table}] needs exactly one of {', '.join(names)}, got {got}")


class ProgramKeys(Keys):
    """What is milled, and how the control reads it."""

    file: Text
    """the program, relative to the job file"""
    dialect: Dialect = "auto"
    """auto: detected and reported; see the page on dialects"""
    units: UnitName = ""
    """of the program, where it names none; left out: inferred, and said"""
    home: Annotated[Triple, Field(examples=["[0, 0, 100]"])] = (0.0, 0.0, 100.0)
    """tool tip at the start, work coordinates; also where G28 goes"""
    work_offsets: Annotated[
        dict[str, Triple], Field(examples=["{ G54 = [0, 0, 0], G55 = [120, 0, 0] }"])
    ] = {}
    """zeros of G54 to G59.3 in machine coordinates, if the program needs them: G53, or several; G54 is that of the job"""
    block_delete: Yes = False
    """skip lines that open with a slash"""
    crc_entry: CrcEntry = ""
    """how cutter radius compensation enters the path; left out: as the dialect does"""
    crc_corner: CrcCorner = ""
    """what it does at outer corners; left out: as the dialect does"""
    taps: Taps = "reference"
    """where taps in G18 and G19 go: beside their holes as a known control does, or into them"""
    dwell: Dwell = "s"
    """unit of P in G4 and in canned cycles"""
    max_steps: Annotated[int, Field(strict=True, ge=1)] = 1_000_000
    """lines that loops and calls may repeat before the program is taken to run for ever"""
    subroutines: tuple[Text, ...] = ()
    """folders with subprograms in separate files, relative to the job file"""
    control: ControlKeys | None = None
    """what the parameters of a Fanuc-like control say, see the page on dialects"""


class ControlKeys(Keys):
    """Optional; what is left out is inferred where that is safe, and said."""

    compensation: Compensation = ""
    """what D registers hold: the radius of the tool, or the wear beside a programmed path of its centre"""
    arc_centres: ArcCentres = ""
    """I J K count from the start of the arc, are absolute, or lead from the centre to the start"""
    modal_centres: Yes = False
    """I J K or R that a block leaves out stay as they were"""
    increments: Increments = ""
    """what a length without a decimal point counts: the unit, or least increments (IS-B: 0.001 mm)"""
    w: AlongZ = ""
    """W moves the tool along Z"""
    lathe: Lathe = ""
    """a lathe whose X words are diameters or radii, or a mill, whatever its program looks like"""
    swapped: Yes = False
    """G2 and G3 of that lathe are counted from below"""


class Machine(Keys):
    """Optional; a limit that is not given does not bind."""

    chain: Text | None = None
    """name of a machine, see the page on machines"""
    options: dict[str, float | bool | Triple] | None = None
    """pivots and offsets of that machine, such as { pivot_mm = 250 }; `vmachining machine NAME` names them"""
    file: Text | None = None
    """a machine file instead: its chain, and every key of the [machine] table in it that is not given here"""
    rapid_mm_min: Positive | None = None
    """speed of rapids"""
    max_feed_mm_min: Positive | None = None
    """largest feed along the path"""
    max_acceleration_mm_s2: Positive | None = None
    """of the tool tip, along and across the path"""
    rapid_acceleration_mm_s2: Positive | None = None
    """the same in rapids; default: as at feed"""
    axis_feed_mm_min: tuple[Positive, Positive, Positive] | None = None
    """largest speed of each linear axis while feeding"""
    axis_rapid_mm_min: tuple[Positive, Positive, Positive] | None = None
    """largest speed of each linear axis in rapids"""
    axis_acceleration_mm_s2: tuple[Positive, Positive, Positive] | None = None
    """of each linear axis"""
    max_jerk_mm_s3: Positive | None = None
    """along the path; adds the time that ramps of speed are rounded by"""
    corner_tolerance_mm: NotNegative = CORNER_TOLERANCE_MM
    """how far the path may miss a corner, where the program does not say (G64 P, G61, CYCLE832); 0: stop there"""
    tool_change_s: NotNegative = 0.0
    """of one tool change"""
    table_change_s: NotNegative = 0.0
    """of one pallet change (M60)"""
    spindle_start_s: NotNegative = 0.0
    """of a start or stop of the spindle (M3, M4, M5), beside what follows from its speed"""
    spindle_s_per_1000_rev_min: NotNegative = 0.0
    """what a start or stop of the spindle lasts longer per 1000 rev/min"""
    program_stop_s: NotNegative = 0.0
    """of a stop by the program (M0, M1) beside what a person takes"""
    block_s: NotNegative = 0.0
    """what every block lasts at least: the control's own time"""
    min_feed_mm_min: Positive | None = None
    """smallest feed along the path; `nc check --machine` says what lies below"""
    spindle_rev_min: Range | None = None
    """slowest and fastest speed of the spindle, for `nc check`"""
    travel_mm: tuple[Range, Range, Range] | None = None
    """travel of x, y and z in machine coordinates, for `nc check`; a machine file says it with its axes"""
    feed_override_percent: Positive = 100.0
    """of the programmed feed"""
    rapid_override_percent: Positive = 100.0
    """of the rapid speed"""


class Box(Keys):
    """An axis-aligned block, opposite corners."""

    min: Annotated[Triple, Field(examples=["[0, 0, -20]"])]
    """corner with the smallest coordinates"""
    max: Annotated[Triple, Field(examples=["[100, 60, 0]"])]
    """corner with the largest coordinates"""

    @model_validator(mode="after")
    def _ordered(self) -> Box:
        if any(lo >= hi for lo, hi in zip(self.min, self.max, strict=True)):
            raise ValueError(f"box min {list(self.min)} must lie below max {list(self.max)} in x, y and z")
        return self


class Cylinder(Keys):
    """A round bar standing along z: centre (x, y), radius, lowest and highest z."""

    center: Annotated[Pair, Field(examples=["[0, 0]"])]
    """axis of the bar, x and y"""
    radius: Positive
    """of the bar"""
    z: Annotated[Pair, Field(examples=["[-20, 0]"])]
    """lowest and highest z"""

    @model_validator(mode="after")
    def _ordered(self) -> Cylinder:
        if self.z[0] >= self.z[1]:
            raise ValueError(f"cylinder z {list(self.z)}: the first value must lie below the second")
        return self


class Stock(Keys):
    """The raw workpiece: exactly one of four ways to say it."""

    box: Box | None = None
    cylinder: Cylinder | None = None
    step: Text | None = None
    """a STEP file with one solid, in its own unit"""
    stl: Text | None = None
    """a closed STL"""

    @model_validator(mode="after")
    def _one(self) -> Stock:
        _exactly_one(self, "stock", "box", "cylinder", "step", "stl")
        return self


class Design(Keys):
    """Optional; the part as designed, what the vectors engine measures against."""

    step: Text | None = None
    """a STEP file with one solid, in its own unit"""
    stl: Text | None = None
    """a closed STL instead"""
    tolerance_mm: Positive = 0.05
    """larger deviations are listed in deviation.csv"""

    @model_validator(mode="after")
    def _one(self) -> Design:
        _exactly_one(self, "design", "step", "stl")
        return self


class Vectors(Keys):
    """Optional; how dense the vectors of --engine vectors stand."""

    mode: Literal["dvv", "dnv", "hybrid"] = "hybrid"
    """upright vectors, vectors along the normals, or both"""
    pitch_mm: Positive | None = None
    """of the grid of upright vectors"""
    spacing_mm: Positive | None = None
    """of vectors on walls, overhangs and sharp edges"""
    error_mm: Positive | None = None
    """instead of spacing_mm: error that the spacing may leave, with the ball of the smallest tool"""
    theta_v_deg: Annotated[float, Field(strict=True, gt=0, lt=90)] | None = None
    """slope above which a facet is a wall"""
    theta_sharp_deg: Annotated[float, Field(strict=True, gt=0, lt=90)] = 30.0
    """angle between facets above which their edge is sharp"""
    allowance_mm: Positive | None = None
    """longest normal vector before the first cut, what roughing leaves"""
    depth_mm: Positive = 10.0
    """deepest overcut that normal vectors measure"""
    casting_mm: Positive | None = None
    """the raw part is the design and this allowance, whatever [stock] says"""

    @model_validator(mode="after")
    def _spacing(self) -> Vectors:
        if self.spacing_mm is not None and self.error_mm is not None:
            raise ValueError("spacing_mm and error_mm exclude each other: one follows from the other")
        return self


class Accuracy(Keys):
    """How finely is computed."""

    chord_mm: Positive = CHORD_MM
    """mesh engine: distance between facets inside and around the true sweep"""
    width: Annotated[Positive, Field(le=1)] = WIDTH
    """columns engine: width of a block's bracket relative to its volume"""
    width_mm3: NotNegative = WIDTH_MM3
    """columns engine: mm³; a block is finished when its bracket is narrower than this, or than `width`"""
    spacing_mm: Positive | None = None
    """dexel engine: distance of rays; half a million rays in all if not given"""
    directions: Literal[1, 3] = 3
    """dexel engine: rays along z, or along x, y and z"""


class Feed(Keys):
    """Optional; plans feeds, writes `scheduled.nc` and simulates it."""

    strategy: Literal["volume", "chip_area", "force"] = "volume"
    """what is kept at or below the reference"""
    reference: Literal["auto", "max", "mean"] | Positive = "auto"
    """largest allowed load: a number in mm³/min, mm², or the unit of the component; or that of the program as it is"""
    references: tuple[Positive, ...] = ()
    """more references to compare with: planned, not written; references.csv and `figure --kind references` show them"""
    component: Literal["resultant", "xy", "tangential", "torque", "power", "deflection"] = "resultant"
    """strategy force: peak force (N), its part across the axis (N), tangential force (N), torque (N mm); mean power (W);
    peak deflection of the tool (mm)"""
    min_mm_min: Positive = 60.0
    """smallest feed that is written"""
    max_mm_min: Positive = 3000.0
    """largest feed that is written"""
    plunge_max_mm_min: Positive | None = None
    """largest feed of moves within 45° of straight down; without it a plunge is never faster than programmed"""
    insert_blocks: Yes = False
    """divide blocks where the load changes inside them"""
    tau: NotNegative = 0.25
    """insert_blocks: divide where wanted feeds differ by more than this share"""
    min_length_mm: Positive = 0.5
    """insert_blocks: shortest inserted block"""
    rule: Literal["safe", "mean"] = "safe"
    """insert_blocks: smallest wanted feed of a part, or the one of its mean load"""
    every_blocks: Annotated[int, Field(strict=True, ge=1)] | None = None
    """one feed for so many blocks in a row: the smallest that one of them asks for"""
    every_mm: Positive | None = None
    """the same for blocks that begin within so much path"""

    @property
    def division(self) -> dict[str, Any]:
        """How a schedule divides blocks or lets them share a feed: options of `vmachining.feed.plan_feeds`."""
        return {
            "insert": self.insert_blocks, "tau": self.tau, "min_length_mm": self.min_length_mm,
            "every_blocks": self.every_blocks, "every_mm": self.every_mm,
        }  # fmt: skip

    @model_validator(mode="after")
    def _ordered(self) -> Feed:
        if sum((self.insert_blocks, self.every_blocks is not None, self.every_mm is not None)) > 1:
            raise ValueError("insert_blocks, every_blocks and every_mm exclude each other")
        if self.min_mm_min > self.max_mm_min:
            raise ValueError(f"min_mm_min {self.min_mm_min:g} is above max_mm_min {self.max_mm_min:g}")
        if self.strategy != "volume" and "mean" in (self.reference, self.rule):
            raise ValueError(f"strategy {self.strategy!r} limits a peak: reference and rule cannot be 'mean'")
        return self


class Force(Keys):
    """Optional; forces, power, and strategy = "force"."""

    coefficients: Text
    """a coefficient file, relative to the job file, or the name of a shipped set"""
    spindle_rev_min: Positive | None = None
    """where the program gives none"""
    extrapolate: Yes = False
    """take the coefficients beyond the heights they were calibrated for"""
    stick_out_mm: Positive | None = None
    """length of the tool as a cantilever; for its deflection"""
    modulus_n_mm2: Positive = 600_000.0
    """Young's modulus of the tool; that of cemented carbide if not given"""
    shank_mm: Positive | None = None
    """diameter of the tool as a cantilever; that of the cutter if not given"""


class JobFile(Keys):
    """The whole file."""

    name: Text = "job"
    """in reports, and of the default result directory"""
    units: Literal["mm", "inch"] = "mm"
    """of lengths whose key names no unit"""
    program: ProgramKeys
    machine: Machine = Machine()
    tools: Annotated[list[dict[str, Any]], Field(min_length=1)]
    stock: Stock
    design: Design | None = None
    vectors: Vectors | None = None
    accuracy: Accuracy = Accuracy()
    feed: Feed | None = None
    force: Force | None = None

    @model_validator(mode="after")
    def _coefficients(self) -> JobFile:
        if self.feed is not None and self.feed.strategy == "force":
            if self.force is None:
                raise ValueError('[feed] strategy = "force" needs a [force] table with coefficients')
            if self.feed.component == "deflection" and self.force.stick_out_mm is None:
                raise ValueError('component = "deflection" needs stick_out_mm under [force]')
        return self
