"""Random programs of every family and cutter against counts that share no code with any engine.

`vmachining bench columns-counts` goes on; what it found: docs/measured/columns.md.
"""

from __future__ import annotations

import numpy as np
import pytest

from vmachining.bench.columns_counts import BAR, columns_counts, counted, program_row
from vmachining.bench.columns_counts.programs import CUTTERS, FAMILIES, drawn
from vmachining.engines.columns import ColumnsEngine

FIRST = len(FAMILIES) * CUTTERS.index("cone")


@pytest.mark.parametrize("seed", range(FIRST, FIRST + len(FAMILIES)), ids=FAMILIES)
def test_a_program_of_each_family(seed):
    """A cone: its edge was passed over by the rule of second derivatives, and the family `far` found it."""
    row = program_row(seed)
    assert row["outside"] == 0, row


@pytest.mark.parametrize("first", range(0, len(FAMILIES) * len(CUTTERS), len(FAMILIES)), ids=CUTTERS)
@pytest.mark.slow  # 5 s a cutter
def test_programs_of_every_cutter(first):
    *_, every = columns_counts(len(FAMILIES), first)
    assert every["outside"] == 0, every["seeds_outside"]


def test_the_count_tells_a_bracket_that_is_wrong():
    """A referee that never objects is none: brackets moved by a twentieth lie outside."""
    program = drawn(0)
    engine = ColumnsEngine(program.stock, 0.003)
    removed = engine.cut(program.sweeps[0])
    volume, error = counted(program, 0, removed.hi, 24, np.random.default_rng(0))
    assert abs(volume - removed.estimate) < BAR * error + 0.5 * removed.width
    assert 0.05 * volume > BAR * error
