"""Random programs of every family and cutter against counts that share no code with any engine.

`vmachining bench columns-counts` continues; what it found: docs/measured/columns.md.
"""

from __future__ import annotations

import numpy as np
import pytest

import vmachining as vm
from benchmarks.columns_counts import BAR, counted, program_row
from benchmarks.columns_counts.programs import CUTTERS, FAMILIES, drawn
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.geometry import Line
from vmachining.sweep import Sweep

TAKEN = {"cone": FAMILIES, "drill": ("anywhere", "finishing")}
"""Cutters with edges: the rule of second derivatives passed over the edge of the one and over the tip of the other."""


@pytest.mark.parametrize(
    ("cutter", "family"), [(cutter, family) for cutter in TAKEN for family in TAKEN[cutter]]
)
def test_a_program_of_each_family(cutter, family):
    row = program_row(len(FAMILIES) * CUTTERS.index(cutter) + FAMILIES.index(family))
    assert row["outside"] == 0, row


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_the_tip_of_a_drill_leaves_a_crease(angle):
    """A cone of slope 0.8, 4 mm deep, moved level by 10 mm: a triangle times the way, and a cone."""
    tool = vm.AptTool(
        d=20, r=0, e=0, f=0, alpha_deg=float(np.degrees(np.arctan(0.8))), beta_deg=0, h=9, length=60
    )
    engine = ColumnsEngine(FlatStock((-8.03, -8.01, -20.0), (18.0, 18.0, 0.0)), 1e-4, 0.0)
    there = (10.0 * np.cos(angle), 10.0 * np.sin(angle), -4.0)
    found = engine.cut(Sweep.along(tool, Line((0, 0, -4), there)))
    exact = 10.0 * 4.0 * 5.0 + np.pi * 5.0**2 * 4.0 / 3.0
    assert found.lo <= exact <= found.hi
    assert found.width <= 1.01e-4 * exact


@pytest.mark.parametrize("part", [0, *(pytest.param(k, marks=pytest.mark.long) for k in (1, 2, 3))])
@pytest.mark.parametrize("cutter", CUTTERS)
@pytest.mark.slow  # 5 s each; every cutter begins with another family
def test_programs_of_every_cutter(cutter, part):
    number = CUTTERS.index(cutter)
    for family in range((number + part) % 4, len(FAMILIES), 4):
        row = program_row(len(FAMILIES) * number + family)
        assert row["outside"] == 0, row


def test_the_count_tells_a_bracket_that_is_wrong():
    """A referee that never objects is none: brackets moved by a twentieth lie outside."""
    program = drawn(0)
    engine = ColumnsEngine(program.stock, 0.003)
    removed = engine.cut(program.sweeps[0])
    volume, error = counted(program, 0, removed.hi, 24, np.random.default_rng(0))
    assert abs(volume - removed.estimate) < BAR * error + 0.5 * removed.width
    assert 0.05 * volume > BAR * error
