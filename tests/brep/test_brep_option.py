"""`--brep`: words of the option, columns, summary, exit codes, and a polite end."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import polars as pl
import pytest
from tinyjob import PROGRAM, SLOT_MM3, write_job

import vmachining as vm
from vmachining.cli.main import run as command
from vmachining.errors import InputError
from vmachining.job.brep import chosen, parse_brep

MODELS = Path(__file__).parents[2] / "models"


def test_words_of_the_option() -> None:
    assert parse_brep("All") == "all"
    assert parse_brep("3,7-9") == (range(3, 4), range(7, 10))
    for wrong in ("some", "7-3", "1--2", "-1", "", "²", "0-99999999999"):
        with pytest.raises(InputError, match="--brep"):
            parse_brep(wrong)
    rows = pl.DataFrame(
        {"block": range(100), "motion": ["rapid"] + 99 * ["linear"], "removed_hi_mm3": 100 * [1.0]}
    )
    assert chosen("none", rows) == [] and chosen("all", rows) == list(range(1, 100))
    sample = chosen("sample", rows)
    assert len(sample) == 20 == len(set(sample)) and sample[-1] == 99 and sample == chosen("sample", rows)
    assert chosen((range(0, 3),), rows) == [1, 2]
    with pytest.raises(InputError, match="no block 100"):
        chosen((range(90, 101),), rows)


@pytest.mark.slow  # 4 s
def test_run_fills_the_columns_and_the_summary(tmp_path: Path) -> None:
    file = write_job(tmp_path)
    assert command(["run", str(file), "--out", str(tmp_path / "out"), "--brep", "all", "--quiet"]) == 0
    rows = pl.read_csv(tmp_path / "out" / "blocks.csv")
    counts = json.loads((tmp_path / "out" / "summary.json").read_text())["brep"]
    checked = rows.filter(pl.col("brep_status") != "skipped")
    assert set(checked["brep_status"]) <= {"agreed", "retried"}
    assert counts["asked"] == len(checked) == counts["agreed"] + counts["retried"] and counts["refused"] == 0
    assert rows.filter(pl.col("motion") == "rapid")["brep_status"].to_list() == ["skipped"] * 5
    slot = rows.filter(pl.col("line") == 7)
    assert slot["removed_brep_mm3"].item() == pytest.approx(SLOT_MM3, rel=1e-9)
    for row in checked.iter_rows(named=True):
        slack = 1e-5
        assert row["removed_lo_mm3"] - slack <= row["removed_brep_mm3"] <= row["removed_hi_mm3"] + slack


@pytest.mark.slow  # 6 s: all of models/slot is cut
def test_columns_are_asked_for_a_tenth_of_a_percent_where_the_run_knows_less() -> None:
    """A descent in the middle of models/slot, known to 0.3 %, and the last two blocks at the face where it comes out: a chip
    of 1.6 mm3, which closed integrals know, and nothing. An error is that of a boolean itself and what the judges leave.
    """
    job = vm.Job.load(MODELS / "slot" / "job.toml").with_width("0.3%")
    found = vm.run(job, engine="columns", brep="22,107,108", workers=1)
    descent, chip, nothing = found.blocks.filter(pl.col("block").is_in([22, 107, 108])).iter_rows(named=True)
    truth = 3.0 * (
        2 * 5 * 2 - 2 * math.sqrt(21) - 25 * math.asin(2 / 5)
    )  # `ahead` of its README, from X2 to X0, 3 mm deep
    for row in (descent, chip):
        assert (row["brep_status"], row["engine"]) == ("agreed", "columns")
        assert row["removed_lo_mm3"] <= row["removed_brep_mm3"] <= row["removed_hi_mm3"]
    width = descent["removed_hi_mm3"] - descent["removed_lo_mm3"]
    assert width > 2e-3 * descent["removed_mm3"]
    assert descent["removed_brep_error_mm3"] <= 1.02e-3 * descent["removed_mm3"] < 0.5 * width
    assert chip["removed_brep_mm3"] == pytest.approx(truth, rel=1e-6)
    known = chip["removed_hi_mm3"] - chip["removed_lo_mm3"]
    assert (
        abs(chip["removed_brep_mm3"] - truth)
        <= chip["removed_brep_error_mm3"]
        <= 1e-6 + 1.01e-5 * truth + known
    )
    assert chip["removed_brep_error_mm3"] < 0.5 * (
        chip["removed_dexel_hi_mm3"] - chip["removed_dexel_lo_mm3"]
    )
    assert (nothing["brep_status"], nothing["removed_brep_mm3"]) == ("agreed", 0.0)
    assert nothing["removed_brep_error_mm3"] <= 1e-6


@pytest.mark.slow  # 20 s
def test_a_refusal_is_told_and_ends_with_code_1(tmp_path: Path) -> None:
    half, upright = "N100 G2 X7 Y12 I2 J0", "N100 G18 G2 X3.7794 Z-0.05 I0 K0.9"
    assert half in PROGRAM
    stepped = 'type = "profile"\nprofile = [[0, 0], [1, 0.2], [1, 1], [2, 2], [2, 20]]'
    swap = {'type = "flat"\ndiameter_mm = 4': stepped}
    file = write_job(tmp_path, program=PROGRAM.replace(half, upright), swap=swap)
    assert command(["run", str(file), "--out", str(tmp_path / "out"), "--brep", "all", "--quiet"]) == 1
    rows = pl.read_csv(tmp_path / "out" / "blocks.csv").filter(pl.col("brep_status") == "refused")
    assert (
        rows["removed_brep_mm3"].null_count() == len(rows) == 2
    )  # the arc, and what needs it as a neighbour
    assert all(text.partition("B-rep refused: ")[2] for text in rows["warning"])


@pytest.mark.parametrize(
    "group",
    [pytest.param(False, marks=pytest.mark.long, id="the command"), pytest.param(True, id="its whole group")],
)
@pytest.mark.slow  # 5 s
def test_a_polite_end_is_an_interruption(group: bool, tmp_path: Path) -> None:
    """SIGTERM while OCCT is at work: 130, what is complete is told, and --resume continues."""
    file, out = write_job(tmp_path), tmp_path / "out"
    words = [
        sys.executable,
        "-m",
        "vmachining",
        "run",
        str(file),
        "--out",
        str(out),
        "--brep",
        "all",
        "--workers",
        "1",
    ]
    job = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, start_new_session=True)
    until = time.monotonic() + 240.0
    while not (out / "brep.partial.csv").exists() and job.poll() is None and time.monotonic() < until:
        time.sleep(0.02)
    (os.killpg if group else os.kill)(job.pid, signal.SIGTERM)
    said = job.communicate(timeout=120.0)[1]
    assert job.returncode == 130, said
    assert "--resume" in said and "bug" not in said


@pytest.mark.slow  # 6 s
def test_triangles_of_a_round_stock_blur_only_what_is_near_them(tmp_path: Path) -> None:
    """A bar as STEP: a plunge in the middle of its end face is known to rays and bracket alone, 4 pi mm3; at its wall they
    are widened."""
    import cadquery as cq

    bar = cq.Solid.makeCylinder(9, 4, cq.Vector(5, 9, -4), cq.Vector(0, 0, 1))
    cq.exporters.export(cq.Workplane(obj=bar), str(tmp_path / "bar.step"))
    swap = {"box = { min = [0, 0, -4], max = [10, 18, 0] }": 'step = "bar.step"'}
    cuts = "%\nG21 G17 G90 G94\nT1 M6\nS8000 M3\nG0 X5 Y9 Z5\nG1 Z-1 F300\nG0 Z5\nG0 X-5 Y9 Z5\nG0 Z-1\nG1 X-2\nM30\n%\n"
    file = write_job(tmp_path, swap=swap, program=cuts)
    assert command(["run", str(file), "--out", str(tmp_path / "out"), "--brep", "all", "--quiet"]) == 0
    rows = pl.read_parquet(tmp_path / "out" / "blocks.parquet").filter(pl.col("removed_brep_mm3") > 0)
    plunge, wall = rows.iter_rows(named=True)
    assert (
        abs(plunge["removed_brep_mm3"] - 4 * math.pi) <= plunge["removed_brep_error_mm3"] < 0.01 * 4 * math.pi
    )
    assert plunge["removed_brep_error_mm3"] < 0.1 * wall["removed_brep_error_mm3"]
