"""block."""

from __future__ import annotations

from vmachining.cli.judge_commands import Block
from vmachining.cli.main import Code
from vmachining.cli.screen import emit
from vmachining.job import Job, blocks_alone
from vmachining.job.brep import parse_blocks


def block(o: Block) -> int:
    """`vmachining block`. Exit code 1: a block is wider than was requested."""
    numbers = [k for text in o.blocks for part in parse_blocks(text, "BLOCKS") for k in part]
    job, share = Job.load(o.job), None
    if o.width is not None:
        share = job.with_width(o.width).keys.accuracy.width
    code = Code.DONE
    for found in blocks_alone(job, numbers, width=share):
        lo, estimate, hi = found.bracket
        if found.is_wider:
            code = Code.FINDINGS
        if o.as_json:
            emit(found.to_dict())
            continue
        relative = f"{100.0 * (hi - lo) / estimate:.3g} %" if estimate > 0.0 else "exact" if hi == lo else "-"
        print(
            f"block {found.block} (line {found.line}): {estimate:.9g} mm3   [{lo:.9g}, {hi:.9g}]   {relative}   "
            f"{found.engine}, {found.earlier} earlier sweeps, {found.seconds:.3g} s"
        )
        if found.warning is not None:
            print(f"  {found.warning}")
    return code
