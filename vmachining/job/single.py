"""The volume of one sweep, without any stock; a sweep as JSON: tool, start, end, and how the tool axis turns between them; and
single blocks of a job: what each removes, to any width, in any order, without a run."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.alone import Alone
from vmachining.engines.brep.occt.tolerances import MISS_MM
from vmachining.engines.mesh import solid
from vmachining.engines.protocol import Options
from vmachining.errors import EngineError, InputError, SweepError, ToolError
from vmachining.interval import Interval
from vmachining.job.brep import note_of
from vmachining.job.contact import ToolParts
from vmachining.job.files import atomic_path
from vmachining.job.jobfile import Job
from vmachining.job.stock import raw_stock
from vmachining.job.summary import slack_of
from vmachining.job.toolpath import Block, Toolpath
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.sweep.flux import FluxVolume
from vmachining.sweep.motion import GOOD
from vmachining.textfile import parse_json, read_text
from vmachining.tolerance import CHORD_MM
from vmachining.tomlplaces import nearest
from vmachining.tool import tool_from_mapping

ROUNDING = 1e-9
"""Relative rounding of a mesh volume."""

SWEEP_SECONDS = 120.0
"""Processor time of OCCT for the solid of one sweep; most take below ten."""

WIDE_RAD, WIDE_MISS_MM = 0.17, 1e-3
"""Axes that turn by more than ten degrees: solids of parts whose envelope folds may miss as much; what they miss is measured."""

LOOK = 0.02
"""Chord of the first look at a tool that turns, as a share of its radius."""

BREP_REL = 1e-7
"""What spline faces within 1e-6 mm of the truth, and the integral over them, can change of a volume."""


Report = Callable[[str], None]
"""Told what is done now, for who waits."""


def swept_volume(sweep: Sweep, chord: float = CHORD_MM, report: Report = lambda _: None) -> Interval:
    """Volume of a sweep, mm^3.

    Parameters
    ----------
    sweep : Sweep
    chord : float
        mm, about the distance between the inner and the outer solid.
    report : called before each of the long steps.

    Returns
    -------
    Interval
        lo and hi are the volumes of the inner and the outer solid of the mesh engine; where the axis turns, hi is not above
        what the moving surface enters. estimate is the closed form or flux integral where the sweep has one (`sweep.volume`),
        otherwise the volume of the fair solid, or the end of the bracket it lies beyond. Not proven where the axis turns: outer
        meshes of whole sweeps are not.

    Raises
    ------
    EngineError
        The kernel failed, its inner solid is larger than its outer one or than what is entered, or the formula contradicts them.
    """
    standing = sweep.upright()
    if standing is not None:  # a leaning tool that does not turn: as if it stood, where walls are exact
        sweep = standing[0]
    lo, hi = (_volume(sweep, chord, side, report) for side in ("inner", "outer"))
    exact = sweep.volume
    noise = ROUNDING * hi
    if lo > hi + noise:
        raise EngineError(f"the inner solid has {lo:.9g} mm3, the outer one {hi:.9g}", engine="mesh")
    if exact is not None and not lo - noise <= exact <= hi + noise:
        raise EngineError(
            f"the formula gives {exact:.9g} mm3, outside of [{lo:.9g}, {hi:.9g}]", engine="mesh"
        )
    if standing is None:
        hi = min(hi, _entered(sweep.flux(), lo))
    if exact is None:  # the fair solid is a guess: it moves neither bound
        exact = min(max(_volume(sweep, chord, "fair", report), min(lo, hi)), hi)
    found = Interval(min(lo, exact), exact, max(hi, exact))
    return found if standing is not None else found.stated()


def _entered(flux: FluxVolume, lo: float) -> float:
    """What is entered: no volume is more. Raises EngineError: The inner solid has more."""
    if lo > flux.entered * (1.0 + ROUNDING):
        raise EngineError(
            f"the inner solid has {lo:.9g} mm3, all that is entered {flux.entered:.9g}", engine="mesh"
        )
    return max(flux.entered, lo)


def _volume(sweep: Sweep, chord: float, side: Literal["inner", "fair", "outer"], report: Report) -> float:
    report(f"mesh of the {side} solid")
    return float(solid(sweep, chord=chord, side=side).volume())


def sweep_record(
    sweep: Sweep,
    chord: float = CHORD_MM,
    step: Path | None = None,
    report: Report = lambda _: None,
    *,
    brep: bool = True,
    seconds: float = SWEEP_SECONDS,
    known: Callable[[Interval], None] = lambda _: None,
) -> dict[str, Any]:
    """What `vmachining sweep` prints: bracket, and the B-rep solid where there is one (else null and why).

    OCCT works in a separate process: whatever happens to it is reported in `brep_note`. Where the sweep is a union
    of several solids, `brep_mm3` is what booleans of them find that agrees with the bracket.

    step : file to write the solids to. Where none exist, or the file does not read back the same,
    `step_refused` says why and nothing is written; the other values stand.
    report : called before each of the long steps. brep : False: the bracket only, and no STEP file.
    seconds : of a processor, for each thing that OCCT is asked: the solid, its booleans, the file.
    known : called with the bracket before OCCT begins, which may take much longer; before that with a coarser one where the
        axis turns.

    Raises EngineError: As `swept_volume`.
    """
    begin = time.perf_counter()
    if sweep.upright() is None and chord < LOOK * sweep.profile.max_radius:
        with suppress(EngineError):  # finer facets may do, and say what is wrong if not
            # by what is entered, before the search for what is entered twice
            lo = float(solid(sweep, chord=LOOK * sweep.profile.max_radius, side="inner").volume())
            flux = sweep.flux(GOOD)
            hi = _entered(flux, lo)
            known(Interval(lo, min(max(flux.volume, lo), hi), hi, proven=False))
    bracket = swept_volume(sweep, chord, report)
    known(bracket)
    record: dict[str, Any] = {
        "volume_mm3": bracket.estimate, "lo_mm3": bracket.lo, "hi_mm3": bracket.hi, "proven": bracket.proven,
        "brep_mm3": None, "brep_valid": None, "brep_faces": None, "brep_note": None,
        "brep_solids": 0, "brep_fit_mm": None,
        "seconds": {"mesh": time.perf_counter() - begin},
    }  # fmt: skip
    begin = time.perf_counter()
    if not brep:
        return record | {"brep_note": "not asked"}
    report(f"B-rep solid, by OCCT in a separate process, within {seconds:g} s")

    def solved(file: Path | None) -> None:
        """All that OCCT is asked; the file last. Raises SweepError, EngineError: It is not written."""
        from vmachining.engines import brep

        miss = MISS_MM
        if isinstance(sweep.path, Turn) and sweep.upright() is None:
            turn = np.arccos(np.clip(sweep.path.axis(0.0) @ sweep.path.axis(1.0), -1.0, 1.0))
            miss = WIDE_MISS_MM if turn > WIDE_RAD else MISS_MM
        with closing(brep.isolated_steps(brep.built_sweep, sweep, miss, file, seconds=seconds)) as steps:
            record.update(_from_brep(sweep, bracket, steps, seconds))
            record["seconds"]["brep"] = time.perf_counter() - begin
            if step is None:
                return
            # several solids are valid one by one, whatever booleans of them say
            if not record["brep_valid"] or (record["brep_mm3"] is None and record["brep_solids"] < 2):
                raise SweepError(f"no B-rep solid to write: {record['brep_note']}")
            report(f"writing {step.name}")
            next(steps)

    if step is None:
        solved(None)
        return record
    record["step_refused"] = None
    try:
        with atomic_path(step) as temporary:
            solved(temporary)
    except (SweepError, EngineError) as exc:
        record["step_refused"] = str(exc)
    return record


def _from_brep(sweep: Sweep, bracket: Interval, steps: Iterator[Any], seconds: float) -> dict[str, Any]:
    """The columns brep_* of what OCCT built."""
    from vmachining.engines import brep

    try:
        described = next(steps)
    except (SweepError, EngineError) as exc:
        return {"brep_note": str(exc)}
    record = {
        "brep_valid": all(one.valid and one.closed for one in described.solids), "brep_solids": len(described.solids),
        "brep_faces": sum(one.faces for one in described.solids), "brep_fit_mm": described.fit_mm,
    }  # fmt: skip
    if len(described.solids) == 1:
        found = described.solids[0].volume
        if not bracket.holds(found, slack=ROUNDING * bracket.hi + BREP_REL * found):
            return record | {"brep_note": f"{found:.9g} mm3 lies outside of the bracket"}
        return record | {"brep_mm3": found}
    note = f"the sweep is a union of {len(described.solids)} solids"
    if described.points:  # booleans of parts that almost coincide do not end
        right = f"right at all of {described.points} points by exact distances"
        return record | {"brep_note": f"{note} within {described.fit_mm:.1g} mm, {right}"}
    (x, y, z), (a, b, c) = (sweep.bounds + [[-1.0], [1.0]]).tolist()
    around = brep.Blank("box", (x, y, z), (a, b, c))
    ((_, verdict),) = brep.check_blocks(around, [[sweep]], {0: bracket}, seconds=seconds)
    said = ": ".join(filter(None, (note, note_of(verdict))))
    return record | {"brep_mm3": verdict.removed_mm3, "brep_note": said}


KEYS = ("tool", "start", "end", "interpolation", "chain", "control_height_mm")
POSE_KEYS = {"axis": ("cl_mm", "axis"), "rotary": ("cl_mm", "rotary_deg")}
LETTERS = {"ac": "ac", "bc": "bc", "ab": "ab", "hexa": "ac"}


def read_sweep(name: str) -> Sweep:
    """The sweep in a JSON file, or on standard input if `name` is "-".

    `interpolation` is "axis" (great circle between two axes, the default) or "rotary" (linear angles of `chain`,
    one of ac, bc, ab, hexa). Two equal axes make a motion without turning. `control_height_mm`: the point that moves
    linearly lies so far above the tip on the axis, and `cl_mm` says where it is.

    Raises InputError: Whatever cannot be read or swept; names the file and the key.
    """
    data = _read(name)
    mode = data.get("interpolation", "axis")
    if mode not in POSE_KEYS:
        raise InputError(f"interpolation {mode!r}: axis or rotary is expected", file=name)
    for where in ("start", "end"):
        _known(data[where], POSE_KEYS[mode], f"{where}.", name)
    try:
        tool = tool_from_mapping(data["tool"])
    except ToolError as exc:
        raise InputError(exc.message, file=name, word=exc.word, remedy=exc.remedy) from exc
    first, last = (_vector(data[where], "cl_mm", where, name) for where in ("start", "end"))
    height = data.get("control_height_mm", 0.0)
    if not _finite(height):
        raise InputError(f"control_height_mm = {height!r}: expected a finite number", file=name)
    try:
        if mode == "axis":
            upright = {"axis": [0.0, 0.0, 1.0]}
            begin, finish = (
                _vector(upright | data[where], "axis", where, name) for where in ("start", "end")
            )
            if height == 0.0:
                return Sweep(tool, Pose(first, begin), Pose(last, finish))
            return Sweep.along(tool, Turn.through(first, last, "axis", begin, finish, control_height=height))
        chain = data.get("chain", "ac")
        if chain not in LETTERS:
            raise InputError(f"chain {chain!r}: one of {', '.join(LETTERS)} is expected", file=name)
        angles = [_angles(data[where], LETTERS[chain], where, name) for where in ("start", "end")]
        return Sweep.along(tool, Turn.through(first, last, chain, *angles, control_height=float(height)))
    except SweepError as exc:
        raise InputError(exc.message, file=name, remedy=exc.remedy) from exc


def _read(name: str) -> dict[str, Any]:
    try:
        text = sys.stdin.read() if name == "-" else read_text(Path(name), "sweep", InputError)
        data = parse_json(text)
    except OSError as exc:
        raise InputError(f"cannot read: {exc.strerror or exc}", file=name) from exc
    except UnicodeDecodeError as exc:
        raise InputError("not a UTF-8 text", file=name) from exc
    except json.JSONDecodeError as exc:
        raise InputError(f"not valid JSON: {exc.msg}", file=name, line=exc.lineno, col=exc.colno) from exc
    if not isinstance(data, dict):
        raise InputError("give one JSON object with tool, start and end", file=name)
    _known(data, KEYS, "", name)
    for key in ("tool", "start", "end"):
        if not isinstance(data.get(key), dict):
            raise InputError(f"{key} is missing or not an object", file=name)
    return data


def _known(data: Mapping[str, Any], keys: tuple[str, ...], where: str, name: str) -> None:
    for key in data:
        if key not in keys:
            close = nearest(key, keys)
            remedy = f"did you mean {close!r}?" if close else f"known: {', '.join(keys)}"
            raise InputError(f"unknown key {where + key!r}", file=name, remedy=remedy)


def _vector(pose: Mapping[str, Any], key: str, where: str, name: str) -> Floats:
    value = pose.get(key)
    if not (isinstance(value, list) and len(value) == 3 and all(map(_finite, value))):
        raise InputError(f"{where}.{key} = {value!r}: expected three finite numbers", file=name)
    return np.array(value, dtype=np.float64)


def _angles(pose: Mapping[str, Any], letters: str, where: str, name: str) -> dict[str, float]:
    """rad by letter; a letter that is not given is 0."""
    given = pose.get("rotary_deg")
    if not isinstance(given, dict) or not set(given) <= set(letters) or not all(map(_finite, given.values())):
        what = f"{where}.rotary_deg = {given!r}: expected degrees of {' and '.join(letters)}"
        raise InputError(what, file=name)
    return {letter: math.radians(given.get(letter, 0.0)) for letter in letters}


def _finite(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


FLOOR_MM3 = 1e-6
"""mm^3 of width at which a block is done where a width is requested: narrower ones are those of rounding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SingleBlock:
    """What one block removes.

    block, line, text : as in the table of a run. removed_mm3, removed_lo_mm3, removed_hi_mm3 : with its proven bracket.
    width_asked, width_mm3 : relative to the volume, or in mm^3, whichever is reached first.
    earlier : sweeps before it that had to be known. engine : who answered.
    warning : why it is wider than was requested, or not by columns. seconds : that it took.
    """

    block: int
    line: int
    text: str
    engine: str
    removed_mm3: float
    removed_lo_mm3: float
    removed_hi_mm3: float
    width_asked: float
    width_mm3: float
    earlier: int
    warning: str | None
    seconds: float

    @property
    def bracket(self) -> Interval:
        """(lo, estimate, hi) mm^3."""
        return Interval(self.removed_lo_mm3, self.removed_mm3, self.removed_hi_mm3)

    @property
    def is_wider(self) -> bool:
        asked = max(self.width_mm3, self.width_asked * self.removed_mm3)
        return self.removed_hi_mm3 - self.removed_lo_mm3 > asked

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def blocks_alone(job: Job, numbers: Sequence[int], *, width: float | None = None) -> Iterator[SingleBlock]:
    """Brackets of single blocks, as the table of a run has them, without cutting the blocks before.

    numbers : of the blocks, in any order.
    width : of a bracket relative to the volume; None: as the job has it, with its floor `width_mm3`.
    Raises InputError: Program, tools or stock cannot be used; no such block; one that cuts nothing, such as a rapid.
    Raises EngineError: A kernel failed; names the block.
    """
    if width is not None and not 0.0 < width <= 1.0:
        raise InputError(f"width {width:g}: a share above 0 and up to 1 is expected")
    keys = job.keys.accuracy
    floor = keys.width_mm3 if width is None else min(keys.width_mm3, FLOOR_MM3)
    asked = Options(chord=keys.chord_mm, width=keys.width if width is None else width, width_mm3=floor)
    tools = {number: ToolParts.of(tool) for number, tool in job.tools.items()}
    toolpath = Toolpath.of_job(job)
    last = len(toolpath.blocks) - 1
    for number in numbers:
        if not 0 <= number <= last:
            remedy = f"blocks are 0 to {last}, as in the table of a run"
            raise InputError(f"there is no block {number}", remedy=remedy)
        block = toolpath.blocks[number]
        if next(toolpath.cuts(block), None) is None:
            kind = "a rapid" if block.motion == "rapid" else "no feed motion"
            what, file = f"block {number} is {kind}, which cuts nothing", toolpath.program.name
            raise InputError(what, file=file, line=block.line, remedy="choose one that moves at feed")
    stock = raw_stock(job)
    slack = slack_of(stock)
    program = Alone(stock, toolpath.sweeps_until(max(numbers, default=-1), tools), asked)
    return (_answered(program, toolpath.blocks[number], asked, slack) for number in numbers)


def _answered(program: Alone, block: Block, asked: Options, slack: float) -> SingleBlock:
    begin = time.perf_counter()
    lo, estimate, hi, _, engine, note = program.removed(block.number)
    if slack > 0.0:
        aside = f"triangles of the curved stock can change it by up to {slack:.3g} mm3"
        note = f"{note}; {aside}" if note else aside
    return SingleBlock(
        block=block.number, line=block.line, text=block.text, engine=engine or "columns",
        removed_mm3=estimate, removed_lo_mm3=lo, removed_hi_mm3=hi,
        width_asked=asked.width, width_mm3=asked.width_mm3,
        earlier=len(program.meeting(block.number)), warning=note, seconds=time.perf_counter() - begin,
    )  # fmt: skip
