"""Blocks asked by themselves: the brackets of a run, without the run."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from tinyjob import SLOT_MM3, write_job

import vmachining as vm
from benchmarks.columns_counts import BAR, counted
from benchmarks.columns_counts.programs import FAMILIES, drawn
from vmachining.cli.main import run
from vmachining.engines.alone import Alone
from vmachining.engines.columns import ColumnsEngine
from vmachining.engines.protocol import Options
from vmachining.errors import InputError
from vmachining.geometry import Line
from vmachining.job import Job, blocks_alone
from vmachining.stock import BoxStock
from vmachining.sweep import Sweep


def test_a_block_alone_is_that_of_the_run(tmp_path):
    """In any order, and to a hundredth of the width; the slot has a closed form."""
    job = Job.load(write_job(tmp_path))
    rows = vm.run(job, workers=1).blocks
    cutting = rows.filter(rows["motion"] != "rapid")
    numbers = cutting["block"].to_list()[::-1]
    found = {one.block: one for one in blocks_alone(job, numbers)}
    narrow = {one.block: one for one in blocks_alone(job, numbers, width=1e-4)}
    for row in cutting.iter_rows(named=True):
        one, other = found[row["block"]], narrow[row["block"]]
        assert one.line == row["line"] and one.engine == "columns" and one.warning is None
        assert max(one.removed_lo_mm3, row["removed_lo_mm3"]) <= min(
            one.removed_hi_mm3, row["removed_hi_mm3"]
        )
        assert max(one.removed_lo_mm3, other.removed_lo_mm3) <= min(one.removed_hi_mm3, other.removed_hi_mm3)
        assert not other.is_wider and other.bracket.hi - other.bracket.lo <= max(
            1e-4 * other.removed_mm3, 1e-6
        )
        if row["line"] == 7:
            assert other.removed_lo_mm3 <= SLOT_MM3 <= other.removed_hi_mm3


@pytest.mark.parametrize("family", range(0, len(FAMILIES), 3))
def test_blocks_of_random_programs_alone_and_in_a_run(family):
    """Asked from the last to the first: each meets the bracket of the run, and independent counts."""
    program = drawn(len(FAMILIES) * (family % 5) + family)
    engine = ColumnsEngine(program.stock, 0.02, 1e-3)
    alone = Alone(program.stock.shape, [[sweep] for sweep in program.sweeps], Options(width=0.02))
    together = [engine.cut(sweep, k) for k, sweep in enumerate(program.sweeps)]
    rng = np.random.default_rng(family)
    for k in reversed(range(len(together))):
        found = alone.removed(k)
        assert max(found.lo, together[k].lo) <= min(found.hi, together[k].hi)
        volume, error = counted(program, k, found.hi, 24, rng)
        assert found.lo - BAR * error <= volume <= found.hi + BAR * error


def test_what_columns_do_not_take_is_asked_of_mesh_and_named():
    """A dovetail (closed form: its section times 30 mm, less the slot before it), and a slot that crosses it."""
    flat, dovetail = vm.FlatEnd(diameter=6, length=40), vm.Taper(diameter=10, taper_deg=-20, length=9)
    ways = [
        (flat, (10, -5, -4), (10, 35, -4)), (dovetail, (10, -8, -8), (10, 38, -8)),
        (flat, (0, 15, -9), (20, 15, -9)), (flat, (40, -5, -4), (40, 35, -4)),
    ]  # fmt: skip
    blocks = [[Sweep.along(tool, Line(a, b))] for tool, a, b in ways]
    program = Alone(BoxStock((0, 0, -10), (60, 30, 0)), blocks, Options(chord=0.05))
    apart, across, under, first = (program.removed(k) for k in (3, 2, 1, 0))
    assert [r.engine for r in (first, under, across, apart)] == ["columns", "mesh", "mesh", "columns"]
    assert under.note == "by the mesh engine: columns cannot compute this block"
    assert across.note == "by the mesh engine: columns cannot compute block 1, which it meets"
    tan = math.tan(math.radians(20.0))
    section = 2 * (5 * 4 - tan * 8) + 2 * (2 - 4 * tan) ** 2 / (2 * tan)
    assert under.lo <= 30 * section <= under.hi
    assert first.lo <= 6 * 4 * 30 <= first.hi and apart.lo <= 6 * 4 * 30 <= apart.hi
    assert [program.meeting(k) for k in range(4)] == [[], [0], [0, 1], []]


def test_blocks_that_cut_nothing_are_refused(tmp_path):
    job = Job.load(write_job(tmp_path))
    with pytest.raises(InputError, match=r"no block 99.*blocks are 0 to"):
        list(blocks_alone(job, [99]))
    with pytest.raises(InputError, match="block 0 is a rapid, which cuts nothing"):
        list(blocks_alone(job, [0]))
    with pytest.raises(InputError, match="width 0"):
        list(blocks_alone(job, [1], width=0.0))


def test_the_command_prints_a_bracket(tmp_path, capsys):
    path = write_job(tmp_path)
    assert run(["block", str(path), "2", "--width", "0.1%", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["removed_lo_mm3"] <= SLOT_MM3 <= said["removed_hi_mm3"]
    assert said["removed_hi_mm3"] - said["removed_lo_mm3"] <= 1e-3 * SLOT_MM3
