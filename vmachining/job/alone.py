"""Single blocks of a job: what each removes, to any width, in any order, without a run."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from vmachining.engines.alone import Alone
from vmachining.engines.protocol import Options
from vmachining.errors import InputError
from vmachining.interval import Interval
from vmachining.job.contact import ToolParts
from vmachining.job.jobfile import Job
from vmachining.job.reading import read_job_program, refuse_unknown_tools
from vmachining.job.stock import raw_stock
from vmachining.job.summary import slack_of
from vmachining.job.toolpath import Block, Toolpath

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
    asked = Options(chord=keys.chord_mm, width=keys.width, width_mm3=keys.width_mm3)
    if width is not None:
        asked = Options(chord=keys.chord_mm, width=width, width_mm3=min(keys.width_mm3, FLOOR_MM3))
    tools = {number: ToolParts.of(tool) for number, tool in job.tools.items()}
    toolpath = Toolpath.of(read_job_program(job), job.machine)
    refuse_unknown_tools(toolpath.program, tools, ", ".join(map(str, sorted(tools))))
    last = len(toolpath.blocks) - 1
    for number in numbers:
        if not 0 <= number <= last:
            raise InputError(
                f"there is no block {number}", remedy=f"blocks are 0 to {last}, as in the table of a run"
            )
        block = toolpath.blocks[number]
        if not any(True for _ in toolpath.cuts(block)):
            kind = "a rapid" if block.motion == "rapid" else "no feed motion"
            raise InputError(
                f"block {number} is {kind}, which cuts nothing", file=toolpath.program.name, line=block.line,
                remedy="choose one that moves at feed",
            )  # fmt: skip
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
