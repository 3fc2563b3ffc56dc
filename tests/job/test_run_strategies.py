"""`run` with chip area and force: columns, written program, comparison; and `force predict`."""

from __future__ import annotations

import numpy as np
import pytest
from tinyjob import FEED, JOB, PROGRAM, write_job

from vmachining.errors import FeedError, InputError, JobError
from vmachining.job import Job, run
from vmachining.job.predict import predict

FORCE = '\n[force]\ncoefficients = "aluminium_like_constant"\n'
CUTTER = JOB.replace("length_mm = 20", "length_mm = 20\nflutes = 2")


def job(folder, text, **more):
    return Job.load(write_job(folder, job=text, **more))


@pytest.fixture(scope="module")
def columns(tmp_path_factory):
    return run(job(tmp_path_factory.mktemp("columns"), CUTTER + FORCE))


def test_columns_of_a_slot_and_a_plunge(columns):
    """Line 7: D4 flat end, slot of 1 mm, two teeth, F600 S8000. Line 9: plunge with F300."""
    rows = {row["line"]: row for row in columns.blocks.iter_rows(named=True)}
    slot = rows[7]
    assert slot["ae_mm"] == pytest.approx(4.0, abs=1e-6) and slot["ap_mm"] == pytest.approx(1.0, abs=1e-6)
    assert slot["engaged_fraction"] == pytest.approx(0.5, abs=1e-6)
    f = 600 / (2 * 8000)
    assert slot["chip_area_mm2"] == pytest.approx(f * 1.0, rel=1e-8)  # a touch of 1e-9 mm
    assert slot["chip_thickness_mm"] == pytest.approx(f, rel=1e-9)
    peak = np.linalg.norm([(k * f + e) * 1.0 for k, e in ((700, 25), (250, 18), (120, 4))])
    assert slot["force_n"] == pytest.approx(peak, rel=1e-6)
    torque = 2 / (2 * np.pi) * 2.0 * (700 * f * 2 + 25 * np.pi)
    assert slot["power_w"] == pytest.approx(2 * np.pi * 8000 / 60 * torque / 1000, rel=1e-4)
    plunge = rows[10] if rows[10]["motion"] == "linear" else rows[9]
    assert plunge["ae_mm"] is None and plunge["ap_mm"] == 0.0 and plunge["engaged_fraction"] == 1.0
    f = plunge["feed_mm_min"] / (2 * 8000)
    assert plunge["chip_thickness_mm"] == pytest.approx(f) and plunge["chip_area_mm2"] == pytest.approx(2 * f)
    # the forces of two teeth across the axis cancel; along it -Fa sin(lam) + Fr cos(lam) at lam = 0 is Fr
    assert plunge["force_n"] == pytest.approx(2 * (250 * f + 18) * 2.0, rel=1e-9)


@pytest.mark.parametrize(("radial", "ae"), [(5e-5, 0.0), (2e-3, 2e-3)])
def test_a_radial_depth_below_a_touch_is_none(radial, ae, tmp_path):
    """D4 along the side y = 0 of the block, 1 mm deep. What it takes is still in the volume."""
    program = f"G21 G90 G17\nT1 M6\nS8000 M3\nG0 X-4 Y{radial - 2.0:.5f} Z-1\nG1 X14 F600\nG0 Z5\nM30\n"
    found = run(job(tmp_path, CUTTER, program=program))
    row = found.blocks.filter(found.blocks["motion"] == "linear").row(0, named=True)
    assert row["ae_mm"] == pytest.approx(ae, rel=1e-3, abs=0.0)
    assert row["removed_lo_mm3"] <= 10.0 * radial <= row["removed_hi_mm3"]


def test_rapids_are_empty(columns):
    rapid = columns.blocks.filter(columns.blocks["motion"] == "rapid")
    assert rapid["ap_mm"].null_count() == rapid["force_n"].null_count() == len(rapid)


def test_without_teeth_chips_are_empty_and_that_is_said(tmp_path):
    found = run(job(tmp_path, JOB))
    assert found.blocks["chip_area_mm2"].null_count() == len(found.blocks)
    assert found.blocks["ap_mm"].max() == pytest.approx(1.0, abs=1e-6)
    assert "write `flutes = N`" in found.summary["contact_notes"][0]


def test_teeth_that_do_not_fit_are_told(tmp_path):
    found = run(job(tmp_path, JOB.replace("length_mm = 20", "length_mm = 20\nflutes = 1000")))
    assert "1000 flutes of tool 1 stand 0.013 mm apart" in found.summary["contact_notes"][0]


@pytest.mark.parametrize("insert", [False, True])
@pytest.mark.parametrize("strategy", ["chip_area", "force"])
def test_the_written_program_keeps_the_load(strategy, insert, tmp_path):
    table = FEED.replace('"volume"', f'"{strategy}"')
    table += "insert_blocks = true\n" if insert else ""
    found = run(job(tmp_path, CUTTER + table + FORCE))
    column = {"chip_area": "chip_area_mm2", "force": "force_n"}[strategy]
    before, after = found.blocks[column].max(), found.scheduled_blocks[column].max()
    assert found.summary["schedule"]["reference"] == pytest.approx(before, rel=1e-6)
    assert after <= before * (1 + 1e-6)  # feeds are rounded down
    assert found.summary["scheduled_time_s"] < found.summary["time_s"]
    assert found.summary["removed_mm3"] == pytest.approx(
        found.schedule.removed_mm3, rel=found.summary["width"] if insert else 1e-9
    )
    names = found.schedule.comparison["strategy"].to_list()
    assert names == ["as programmed", "volume", "chip_area", "force"]
    peaks = found.schedule.comparison[f"{strategy}_peak"].to_list()
    assert peaks[names.index(strategy)] <= peaks[0] * (1 + 1e-9)
    assert (found.scheduled_blocks.height > found.blocks.height) == insert


@pytest.mark.parametrize(("strategy", "reference"), [("chip_area", 0.03), ("force", 80.0)])
def test_its_own_output_stays_byte_for_byte(strategy, reference, tmp_path):
    table = FEED.replace('"volume"', f'"{strategy}"\nreference = {reference}')
    first = run(job(tmp_path / "a", CUTTER + table + FORCE), out=tmp_path / "one")
    written = (first.folder / "scheduled.nc").read_bytes()
    again = job(tmp_path / "b", CUTTER + table + FORCE, program=written.decode())
    assert (run(again, out=tmp_path / "two").folder / "scheduled.nc").read_bytes() == written


@pytest.mark.parametrize(
    ("component", "reference"),
    [("power", 60.0), ("torque", 200.0), ("tangential", 60.0), ("deflection", 0.01), ("xy", 40.0)],
)
def test_a_limit_on_any_component(component, reference, tmp_path):
    table = FEED.replace('"volume"', f'"force"\ncomponent = "{component}"\nreference = {reference}')
    found = run(job(tmp_path, CUTTER + table + FORCE + "stick_out_mm = 20\n"))
    assert found.schedule.unit == {"power": "W", "torque": "N mm", "deflection": "mm"}.get(component, "N")
    if component == "power":
        limited = found.scheduled_blocks.filter(found.scheduled_blocks["feed_mm_min"] > 60)["power_w"]
        assert limited.max() <= reference * (1 + 1e-6)


BAD = {
    "edge forces": ('reference = 5', FORCE, FeedError, ["tiny.nc:", "below what edge forces alone need", "least"]),
    "no teeth": ('reference = 50', FORCE, FeedError, ["no block has a known load", "write `flutes = N`"]),
    "no set": ('reference = 50', FORCE.replace("aluminium", "adamant"), JobError, ["adamant", "neither a file"]),
    "no table": ('reference = 50', "", JobError, ["needs a [force] table"]),
    "mean": ('reference = "mean"', FORCE, JobError, ["limits a peak"]),
    "heights": ('reference = 50', '\n[force]\ncoefficients = "flat.toml"\n', FeedError, ["no block has a known load"]),
    "stick out": ('component = "deflection"', FORCE, JobError, ["stick_out_mm"]),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_scheduled_is_refused(case, tmp_path):
    line, force, error, words = BAD[case]
    (tmp_path / "flat.toml").write_text(
        "height_mm = [2, 3]\n[cutting_n_mm2]\ntangential = 1\nradial = 1\naxial = 1\n"
        "[edge_n_mm]\ntangential = 0\nradial = 0\naxial = 0\n"
    )
    text = JOB if case == "no teeth" else CUTTER
    with pytest.raises(error) as caught:
        run(job(tmp_path, text + FEED.replace('"volume"', f'"force"\n{line}') + force))
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_prediction_is_the_column(columns, tmp_path):
    found = predict(job(tmp_path, CUTTER + FORCE))
    column = columns.blocks.filter(columns.blocks["force_n"].is_not_null())
    for block, force, power in column.select("block", "force_n", "power_w").iter_rows():
        mine = found.stations.filter(found.stations["block"] == block)
        assert mine["peak_n"].max() == pytest.approx(force, rel=1e-12)
        assert mine["power_w"].max() == pytest.approx(power, rel=1e-12)
    assert found.series["resultant_n"].max() <= found.stations["peak_n"].max() * (1 + 1e-12)
    with pytest.raises(InputError, match="block 0 does not cut"):
        predict(job(tmp_path, CUTTER + FORCE), [0])


def test_heights_beyond_the_calibration_are_said(tmp_path):
    (tmp_path / "low.toml").write_text(
        "height_mm = [0, 0.5]\n[cutting_n_mm2]\ntangential = 700\nradial = 250\naxial = 120\n"
        "[edge_n_mm]\ntangential = 25\nradial = 18\naxial = 4\n"
    )
    text = CUTTER + '\n[force]\ncoefficients = "low.toml"\n'
    found = run(job(tmp_path, text, program=PROGRAM))
    row = found.blocks.row(2, named=True)
    assert row["force_n"] is None and "calibrated for heights from 0 to 0.5 mm" in row["warning"]
    again = run(job(tmp_path, text + "extrapolate = true\n", program=PROGRAM)).blocks.row(2, named=True)
    assert again["force_n"] > 0 and "taken anyway" in again["warning"]


def test_tools_without_teeth_are_told_once(tmp_path):
    """It was said once for every tool."""
    second = '[[tools]]\nnumber = 2\ntype = "flat"\ndiameter_mm = 4\nlength_mm = 20\n\n[stock]'
    program = PROGRAM.replace("N80 G0 X3 Y12", "N75 T2 M6\nN80 G0 X3 Y12")
    result = run(Job.load(write_job(tmp_path, program=program, swap={"[stock]": second})))
    told = [text for text in result.summary["contact_notes"] if "columns are empty" in text]
    assert len(told) == 1 and "tools 1, 2 cut" in told[0] and "write `flutes = N`" in told[0]
