"""The gauntlet: its referee against a closed form, its record after a cut, its table."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from vmachining import BallNose, FlatEnd, Sweep
from vmachining.bench.brep_chains import recorded, table
from vmachining.bench.referee import referee
from vmachining.geometry import Line

BAR = (np.array([0.0, -20.0, -20.0]), np.array([30.0, 20.0, 0.0]))


def test_the_referee_knows_slots_with_a_closed_form() -> None:
    across = Line((-10, 0, -1), (40, 0, -1))
    segment = 25 * np.arccos(4 / 5) - 4 * 3
    for tool, truth in (
        (FlatEnd(diameter=10, length=40), 300.0),
        (BallNose(diameter=10, length=40), 30 * segment),
    ):
        sweeps = [Sweep.along(tool, across)] * 2
        value, bar = referee(sweeps, 0, BAR, 24)
        assert abs(value - truth) <= bar < 0.02 * truth
        assert referee(sweeps, 1, BAR, 24)[0] == pytest.approx(0.0, abs=1e-9)


def test_a_cut_record_loses_the_chain_under_way_and_the_last_line_of_a_chain_counts(tmp_path: Path) -> None:
    def line(chain: int, status: str, plain: str) -> str:
        block = {"status": status, "rung": "", "value": None, "wrong": False, "seconds": 2.0}
        return json.dumps({"chain": chain, "family": "bore", "blocks": [block], "baseline": [plain]})

    file = tmp_path / "record"
    file.write_text("\n".join([line(4, "refused", "failed"), line(11, "agreed", "right"), line(4, "agreed", "right")])
                    + "\n" + line(18, "agreed", "right")[:-30])  # fmt: skip
    known = recorded(file)
    assert list(known) == [4, 11]
    *_, total = table(known.values())
    assert total["asked"] == total["agreed"] == 2 and total["refused"] == 0
    assert total["baseline"] == {"right": 2} and total["median_s"] == 2.0
