"""A log beside the table of a run: what was removed, feeds as programmed, reachable and logged, the load; bad logs."""

from __future__ import annotations

import json
import re
import time

import numpy as np
import polars as pl
import pytest
from tinyjob import write_job

import vmachining as vm
from vmachining.cli.main import run
from vmachining.errors import InputError
from vmachining.job.times import compare, lay, of_result, read_log
from vmachining.job.timing import assumed, machine_limits
from vmachining.machine import MachineLimits
from vmachining.nc import parse_program
from vmachining.report.figures import mean_feeds
from vmachining.report.paper.kinds import draw
from vmachining.report.paper.source import Results

POWER_LOAD = 3.0
"""% of load per W that the log of our own making has."""


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """A run of the tiny job on a machine with accelerations, and a log of it by another, slower machine with a spindle load."""
    folder = tmp_path_factory.mktemp("joined")
    path = write_job(
        folder, swap={"max_feed_mm_min = 4000\n": "max_feed_mm_min = 4000\nmax_acceleration_mm_s2 = 500\n"}
    )
    out = folder / "out"
    vm.run(vm.Job.load(path)).write(out)
    job, driven, blocks = of_result(out)
    seconds = driven.times(machine_limits(job)).seconds * 1.25
    rate = {r["line"]: r["mrr_mm3_min"] or 0.0 for r in blocks.iter_rows(named=True)}
    rows, t = ["time,line,feed_override,spindle_load"], 0.0
    for move, s in zip(driven.toolpath.moves, seconds, strict=True):
        rows.append(f"{t:.6f},{move.line},100,{rate.get(move.line, 0.0) / 50.0:.6f}")
        t += s
    rows.append(f"{t:.6f},{driven.toolpath.moves[-1].line + 1},100,0")
    (folder / "run.csv").write_text("\n".join(rows) + "\n")
    return folder, out, job, driven, blocks


def test_nothing_removed_is_lost_and_rates_follow(result, capsys):
    folder, out, _, _, blocks = result
    assert run(["times", "join", str(folder / "run.csv"), "--results", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["removed_mm3"] == pytest.approx(blocks["removed_mm3"].sum(), rel=1e-12)
    assert told["load_rank_correlation_mrr_mm3_min"] == pytest.approx(1.0, abs=1e-9)
    rows = pl.read_parquet(out / "logged.parquet")
    slot = rows.filter(pl.col("line") == 7).row(0, named=True)
    # 4 x 1 x 10 mm in the time that the log says
    assert slot["mrr_mm3_min"] == pytest.approx(60.0 * 40.0 / slot["logged_s"], rel=2e-3)
    assert slot["programmed_mm_min"] == pytest.approx(600.0)
    # 18 mm at 10 mm/s and 500 mm/s2 between two corners of 90 degrees that may be missed by 0.01 mm; and 1.25 times that
    c = np.sqrt(0.5)
    whole = 18.0 / 10.0 + (10.0 - np.sqrt(500.0 * 0.01 * c / (1.0 - c))) ** 2 / (500.0 * 10.0)
    assert slot["reachable_mm_min"] == pytest.approx(60.0 * 18.0 / whole, rel=1e-3)
    assert slot["logged_mm_min"] == pytest.approx(60.0 * 18.0 / whole / 1.25, rel=1e-3)
    assert (out / "logged.csv").read_text().startswith("line,until,tool,logged_s")


def logged(folder, program):
    """A run of a program, and a log of it that shows every motion exactly as long as it lasts."""
    path = write_job(folder, program=program)
    vm.run(vm.Job.load(path)).write(folder / "out")
    job, driven, _ = of_result(folder / "out")
    rows, t = ["time,line,feed_override,spindle_load"], 0.0
    for move, s in zip(driven.toolpath.moves, driven.times(machine_limits(job)).seconds, strict=True):
        rows.append(f"{t:.6f},{move.line},100,1")
        t += s
    rows.append(f"{t:.6f},{driven.toolpath.moves[-1].line + 1},100,0")
    (folder / "run.csv").write_text("\n".join(rows) + "\n")
    return job, driven


SQUARE = "G1 Z-1 F600\nG1 X5\nG1 Y5\nG1 X-5\nG1 Y-5\n"
LEVELS = "G21 G17 G90 G94\nT1 M6\nS8000 M3\nG0 X2 Y4 Z0\n{calls}G90 G0 Z5\nG0 X0 Y0\nG1 X3 F500\nG1 X5\nM30\n"


def test_lines_that_run_more_than_once_are_left_out_and_said(tmp_path, capsys):
    """Three levels by one subprogram: which of them an entry shows is not known; every level would count as three."""
    text = "O1\n" + LEVELS.format(calls="M98 P2 L3\n") + f"O2\nG91\n{SQUARE}M99\n"
    job, driven = logged(tmp_path, text)
    found = compare(lay(read_log(tmp_path / "run.csv"), driven), machine_limits(job))
    assert found.left_out["lines that run more than once"] > 1.0
    assert found.error == pytest.approx(0.0, abs=1e-3)  # the lines after it are compared
    args = ["times", "join", str(tmp_path / "run.csv"), "--results", str(tmp_path / "out"), "--json"]
    assert run(args) == 0
    out = capsys.readouterr()
    assert "lines that run more than once" in out.err
    assert json.loads(out.out)["left_out_s"]["lines that run more than once"] > 1.0
    rows = pl.read_parquet(tmp_path / "out" / "logged.parquet")
    assert rows.filter(pl.col("line") > driven.toolpath.moves[-1].line)["compared"].sum() == 0


def test_the_same_levels_written_out_are_compared(tmp_path):
    job, driven = logged(tmp_path, LEVELS.format(calls="G91\n" + 3 * SQUARE))
    found = compare(lay(read_log(tmp_path / "run.csv"), driven), machine_limits(job))
    assert not found.left_out and found.error == pytest.approx(0.0, abs=1e-3)


def test_figures_of_it(result, capsys, tmp_path):
    folder, out, _, _, _ = result
    assert run(["times", "join", str(folder / "run.csv"), "--results", str(out), "--json"]) == 0
    assert run(["figure", str(out), "--kind", "logged", "--format", "svg", "--out", str(tmp_path)]) == 0
    page = tmp_path / "t.html"
    args = [
        "times",
        "compare",
        str(folder / "run.csv"),
        "--program",
        str(folder / "tiny.nc"),
        "--figure",
        str(page),
    ]
    assert run(args) == 0
    text = page.read_text()
    assert text.count("<svg") == 2 and all(
        w in text for w in ("programmed", "reachable", "logged", "Load of the spindle")
    )
    assert any(path.suffix == ".svg" for path in tmp_path.iterdir())
    capsys.readouterr()
    (tmp_path / "empty").mkdir()
    assert run(["times", "join", str(folder / "run.csv"), "--results", str(tmp_path / "empty")]) == 2
    assert "no finished result" in capsys.readouterr().err


def test_a_figure_of_several_logs_names_the_one_that_it_shows(result, tmp_path):
    folder, out = result[:2]
    (tmp_path / "later.csv").write_bytes((folder / "run.csv").read_bytes())
    logs = [str(folder / "run.csv"), str(tmp_path / "later.csv")]
    assert run(["times", "join", *logs, "--results", str(out)]) == 0
    assert draw(Results.load(out), "logged").axes[0].get_title() == "run.csv, the first of 2 logs"
    assert run(["times", "join", logs[0], "--results", str(out)]) == 0
    assert draw(Results.load(out), "logged").axes[0].get_title() == ""


def test_a_program_that_changed_since_the_run_is_refused(result, capsys):
    folder, out, _, _, _ = result
    path = folder / "tiny.nc"
    old = path.read_text()
    path.write_text(old.replace("X14", "X15"))
    try:
        assert run(["times", "join", str(folder / "run.csv"), "--results", str(out)]) == 2
        assert "has changed since the run" in capsys.readouterr().err
    finally:
        path.write_text(old)


def test_tools_of_several_logs_are_summed(result, capsys):
    folder, _, _, _, _ = result
    log = str(folder / "run.csv")
    args = ["times", "compare", log, log, "--program", str(folder / "tiny.nc"), "--json"]
    assert run(args) == 0
    both = json.loads(capsys.readouterr().out)
    assert run([*args[:2], log, *args[4:]]) == 0
    one = json.loads(capsys.readouterr().out)
    assert [t["tool"] for t in both["tools"]] == [t["tool"] for t in one["tools"]]
    for a, b in zip(both["tools"], one["tools"], strict=True):
        assert a["logged_s"] == pytest.approx(2 * b["logged_s"]) and a["error"] == pytest.approx(b["error"])
    assert len(both["logs"]) == 2 and both["error"] == pytest.approx(one["error"])


def rewritten(folder, tmp_path, change):
    """The log with every row (t, line, override, load) changed; None drops it."""
    head, *rows = (folder / "run.csv").read_text().splitlines()
    new = [change(k, *map(float, row.split(","))) for k, row in enumerate(rows)]
    text = "\n".join([head, *(",".join(f"{v:.9g}" for v in row) for row in new if row is not None)])
    (tmp_path / "bad.csv").write_text(text + "\n")
    return read_log(tmp_path / "bad.csv")


def test_overrides_at_0_all_along_are_refused(result, tmp_path):
    """Feeds alone: rapids are still compared. Both: nothing is."""
    folder, _, job, driven, _ = result
    log = rewritten(folder, tmp_path, lambda k, t, n, o, load: (t, n, 0.0, load))
    found = compare(lay(log, driven), machine_limits(job))
    assert found.left_out["overrides at 0"] > 2.0 and found.blocks["programmed_mm_min"].is_nan().all()
    text = (folder / "run.csv").read_text().replace("spindle_load", "rapid_override").replace(",100,", ",0,")
    (tmp_path / "held.csv").write_text(
        "\n".join(re.sub(r"[^,]+$", "0", line) if k else line for k, line in enumerate(text.splitlines()))
    )
    with pytest.raises(InputError, match=r"nothing of this log can be compared: .* overrides at 0"):
        compare(lay(read_log(tmp_path / "held.csv"), driven), machine_limits(job))


@pytest.mark.parametrize(("factor", "words"), [(1000.0, "milliseconds"), (1 / 60.0, "minutes"), (1.0, None)])
def test_a_clock_in_another_unit_is_said(factor, words, result, tmp_path):
    folder, _, _, driven, _ = result
    told = lay(rewritten(folder, tmp_path, lambda k, t, n, o, load: (t * factor, n, o, load)), driven).clock()
    assert told is None if words is None else words in told


def test_a_clock_that_jumps_back_and_a_gap_are_left_out(result, tmp_path):
    folder, _, job, driven, _ = result
    plain = compare(lay(read_log(folder / "run.csv"), driven), machine_limits(job))
    for shift in (-5000.0, 5000.0):
        log = rewritten(folder, tmp_path, lambda k, t, n, o, load, by=shift: (t + by * (k >= 3), n, o, load))
        found = compare(lay(log, driven), machine_limits(job))
        assert set(found.left_out) - set(plain.left_out) == {"gaps and jumps of the clock"}
        assert found.error == pytest.approx(plain.error, abs=0.05) and found.logged_s < plain.logged_s


def test_entries_that_are_missing_join_their_blocks(result, tmp_path):
    """Without every second entry intervals hold two blocks; sums stay."""
    folder, _, job, driven, _ = result
    plain = compare(lay(read_log(folder / "run.csv"), driven), machine_limits(job))
    log = rewritten(
        folder, tmp_path, lambda k, t, n, o, load: (t, n, o, load) if k % 2 == 0 or n > 12 else None
    )
    found = compare(lay(log, driven), machine_limits(job))
    assert found.logged_s == pytest.approx(plain.logged_s, rel=0.1) and len(found.blocks) < len(plain.blocks)


def test_what_is_no_number_is_counted_and_left_out(result, tmp_path):
    folder, _, job, driven, _ = result
    text = (folder / "run.csv").read_text().replace(",100,", ",nan,", 2).replace("time,line", "Time,Line")
    (tmp_path / "bad.csv").write_text(text + "inf,3,100,1\n")
    log = read_log(tmp_path / "bad.csv")
    assert log.skipped == 3
    assert np.isfinite(compare(lay(log, driven), machine_limits(job)).predicted_s)


def test_a_tolerance_below_the_resolution_and_missing_limits_are_said(result, tmp_path, capsys):
    folder = result[0]
    (tmp_path / "mill.toml").write_text(
        "[machine]\nmax_acceleration_mm_s2 = 500\ncorner_tolerance_mm = 0.0007\n"
    )
    program = tmp_path / "p.nc"
    program.write_text((folder / "tiny.nc").read_text().replace("X14", "X14.00"))
    args = ["times", "compare", str(folder / "run.csv"), "--program", str(program), "--machine"]
    assert run([*args, str(tmp_path / "mill.toml")]) == 0
    err = capsys.readouterr().err
    assert "0.0007 mm is below the resolution of the program (0.01 mm)" in err
    assert (
        "no rapid speed is given: rapids take no time" in err and "no time of a tool change is given" in err
    )
    program.write_text(program.read_text().replace("G94", "G94 G64 P0.001"))
    (tmp_path / "mill.toml").write_text("[machine]\nmax_acceleration_mm_s2 = 500\n")
    assert run([*args, str(tmp_path / "mill.toml")]) == 0
    assert "0.001 mm is below the resolution" in capsys.readouterr().err
    program.write_text(program.read_text().replace("P0.001", "P0.02"))
    assert run([*args, str(tmp_path / "mill.toml")]) == 0
    assert "below the resolution" not in capsys.readouterr().err
    inch = "G20 G90\nS100 M3\nG1 X0.0001 Y1.0000 F10\nM30\n"
    tolerance = assumed(
        MachineLimits(max_acceleration_mm_s2=1.0, corner_tolerance_mm=0.002),
        None,
        parse_program(inch.encode(), "p"),
    )
    assert any("0.002 mm is below the resolution of the program (0.00254 mm)" in words for words in tolerance)


def test_slides_of_a_machine_file_count(result, tmp_path, capsys):
    """Slides of 300 mm/min take twice as long as the programmed 600: the slot of 18 mm lasts 3.6 s, not 1.8."""
    folder, out = result[:2]
    axis = '[[axes]]\nname = "{n}"\nkind = "linear"\ncarries = "tool"\ndirection = "{d}"\nmax_speed_mm_min = 300\n'
    (tmp_path / "mill.toml").write_text(
        'name = "slow"\n' + "".join(axis.format(n=d.upper(), d=d) for d in "xyz")
    )
    log, machine, table = str(folder / "run.csv"), str(tmp_path / "mill.toml"), tmp_path / "t.csv"
    args = ["times", "compare", log, "--program", str(folder / "tiny.nc"), "--machine", machine]
    assert run([*args, "--table", str(table)]) == 0
    slot = pl.read_csv(table).filter(pl.col("line") == 7).row(0, named=True)
    assert slot["predicted_s"] == pytest.approx(3.6, rel=1e-6)
    capsys.readouterr()
    turned = tmp_path / "turned.nc"  # a program that no job runs is timed, and that is said
    turned.write_text("O1\nG21 G99 G97 S1000 M3\nT0101\nG0 X40. Z2.\nG1 Z-9. F.2\nX44.\nZ-18.\nX50.\nM30\n")
    assert run(["times", "compare", log, "--program", str(turned), "--machine", machine]) == 0
    assert "a program for turning" in capsys.readouterr().err
    assert run(["times", "join", log, "--results", str(out), "--machine", machine]) == 0
    assert "axes are those of the job" in capsys.readouterr().err


def test_a_drawn_mean_feed_is_length_over_time():
    """0.25 s each at 2400, 1200, 1200 and 2400 mm/min are 30 mm in a second; a rapid between ends a window."""
    rows = pl.DataFrame(
        {
            "logged_s": [0.25, 0.25, 0.25, 0.25, 3.0, 2.0],
            "logged_mm_min": [2400.0, 1200.0, 1200.0, 2400.0, np.nan, 900.0],
            "programmed_mm_min": [1200.0, 2400.0, 2400.0, 1200.0, np.nan, 1000.0],
            "reachable_mm_min": [1800.0] * 4 + [np.nan, 950.0],
        }
    )
    got = mean_feeds(rows)
    assert got["at_s"].to_list() == [0.0, 1.0, 4.0]
    # 10 mm at 1200 and 5 mm at 2400 mm/min, twice: 30 mm in 0.5 + 0.125 + 0.125 + 0.5 s
    np.testing.assert_allclose(got["programmed_mm_min"], [30.0 / 1.25 * 60.0, np.nan, 1000.0], rtol=1e-12)
    np.testing.assert_allclose(got["reachable_mm_min"], [1800.0, np.nan, 950.0], rtol=1e-12)
    np.testing.assert_allclose(got["logged_mm_min"], [1800.0, np.nan, 900.0], rtol=1e-12)


def test_a_word_for_inches_is_looked_for_line_by_line():
    """Also in long programs: a search across lines took 20 s for these 8,000, four times as long for twice as many."""
    lines = "".join(f"G1 X{k % 97}.5 Y{k % 89}.25\n" for k in range(8_000))
    limits = MachineLimits(max_acceleration_mm_s2=1.0, corner_tolerance_mm=0.002)
    program = parse_program(f"S100 M3\n{lines}M30\n".encode(), "p")
    begin = time.process_time()
    known = assumed(limits, None, program)
    assert time.process_time() - begin < 4.0
    assert any("0.002 mm is below the resolution of the program (0.01 mm)" in words for words in known)
    for comment in ("(G21)\nG20 G90 X0.5", "(a)\nN10 G20\nX0.5"):
        program = parse_program(f"S100 M3\n{comment}\nM30\n".encode(), "p")
        assert any("(2.54 mm)" in words for words in assumed(limits, None, program))
    program = parse_program(b"S100 M3\n(G20 later) G1 X0.5\nM30\n", "p")
    assert any("(0.1 mm)" in words for words in assumed(limits, None, program))
