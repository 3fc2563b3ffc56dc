"""The command line from outside: exit codes, one message, pure JSON, interruption."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import shlex
import signal
import subprocess
import sys
import time

import pytest
from tinyjob import FEED, JOB, PROGRAM, write_job

from vmachining.cli.main import run

COMMANDS = ([], ["run"], ["batch"], ["demo"], ["sweep"], ["bench"], ["nc"], ["nc", "check"], ["nc", "moves"])


def shell(*argv, **options):
    """`python -m vmachining ...` in a separate process."""
    return subprocess.run(
        [sys.executable, "-m", "vmachining", *map(str, argv)],
        capture_output=True,
        text=True,
        timeout=60,
        **options,
    )


@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: " ".join(c) or "root")
def test_help_has_an_example(command, capsys):
    assert run([*command, "--help"]) == 0
    assert "\n    vmachining " + " ".join(command) in capsys.readouterr().out


def test_help_is_quick_and_loads_no_kernel():
    code = (
        "import sys, time; t = time.perf_counter(); from vmachining.cli.main import run; run(['--help']);"
        "heavy = {'numpy', 'numba', 'manifold3d', 'polars', 'matplotlib', 'OCP', 'pydantic'} & set(sys.modules);"
        "print(heavy, file=sys.stderr); sys.exit(bool(heavy))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=20)
    assert done.returncode == 0, done.stderr


def test_a_check_loads_neither_arrays_nor_kernels(tmp_path):
    program = tmp_path / "part.nc"
    program.write_text("G21 G90\nT1 M6\nS1000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F100\nG2 X10 I5 J0\nM30\n")
    code = (
        "import sys; from vmachining.cli.main import run; code = run(['nc', 'check', sys.argv[1]]);"
        "heavy = {'numpy', 'numba', 'polars', 'OCP', 'vmachining.job'} & set(sys.modules);"
        "print(code, heavy); sys.exit(code or bool(heavy))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(program)], capture_output=True, text=True, timeout=20
    )
    assert done.returncode == 0, done.stdout


def test_run_writes_everything_and_json_is_pure(tmp_path):
    job = write_job(tmp_path)
    done = shell("run", job, "--out", tmp_path / "out", "--json", "--stock", "stl,3mf")
    assert done.returncode == 0 and done.stderr == ""
    summary = json.loads(done.stdout)
    assert summary == json.loads((tmp_path / "out" / "summary.json").read_text())
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"blocks.csv", "blocks.parquet", "report.html", "manifest.json", "stock.stl", "stock.3mf"} <= names


def test_run_tells_people_on_stderr_and_quiet_is_quiet(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_job(tmp_path)
    assert run(["run", "job.toml", "--stock", ""]) == 0
    out, err = capsys.readouterr()
    assert out == "" and "tiny: 9 blocks" in err and (tmp_path / "out" / "tiny" / "blocks.csv").is_file()
    assert run(["run", "job.toml", "--quiet", "--stock", ""]) == 0
    assert capsys.readouterr() == ("", "")
    assert run(["run", "job.toml", "--resume"]) == 0
    assert "already complete" in capsys.readouterr().err


def test_the_first_warnings_are_shown_with_their_lines(tmp_path, capsys):
    lines = "".join(f"N{60 + k} M5\nN{61 + k} G1 X{k / 8} F600\n" for k in range(0, 14, 2))
    program = PROGRAM.replace("N30 S8000 M3\n", "").replace("N60 G1 X14 F600\n", lines)
    job = write_job(tmp_path, program=program)
    assert run(["run", str(job), "--out", str(tmp_path / "o"), "--stock", ""]) == 0
    err = capsys.readouterr().err
    count = int(re.search(r"warnings  (\d+)", err)[1])
    shown = re.findall(r"^ {12}line (\d+): W501", err, re.M)
    assert count > 5 == len(shown) and shown == sorted(shown, key=int)
    assert f"and {count - 5} more in blocks.parquet and report.html" in err


BAD = {
    "no file": (["run", "none.toml"], ["none.toml", "No such file"]),
    "later engine": (["run", "job.toml", "--engine", "brep"], ["brep", "not supported yet"]),
    "brep": (["run", "job.toml", "--brep", "7-3"], ["--brep", "block 3 comes before block 7"]),
    "nobody there": (
        ["batch", "job.toml", "--scheduler", "tcp://127.0.0.1:9"],
        ["no Dask scheduler answers at tcp://127.0.0.1:9", "dask scheduler"],
    ),
    "no address": (
        ["batch", "job.toml", "--scheduler", "tcp://x"],
        ["tcp://x is not an address", "127.0.0.1:8786"],
    ),
    "two pools": (
        ["batch", "job.toml", "--scheduler", "tcp://x:1", "--workers", "2"],
        ["--workers", "--scheduler", "give one of them"],
    ),
    "no machine": (
        ["nc", "moves", "tiny.nc", "--machine", "m.toml"],
        ["cannot read the machine file", "m.toml"],
    ),
    "dialect": (
        ["nc", "check", "tiny.nc", "--dialect", "klingon"],
        ["klingon", "is not supported", "iso, haas"],
    ),
    "home": (["nc", "check", "tiny.nc", "--home", "1,2"], ["--home 1,2", "three numbers"]),
    "no such code": (["nc", "check", "--explain", "E999"], ["E999", "--explain all"]),
    "no command": (["frobnicate"], ["frobnicate", "--help"]),
    "no option": (["run", "job.toml", "--fast"], ["--fast", "vmachining run --help"]),
    "no argument": (["run"], ["JOB.toml"]),
    "stock format": (["run", "job.toml", "--stock", "obj"], ["obj", "take stl, 3mf, glb, step"]),
    "no program": (["nc", "check", "none.nc"], ["none.nc"]),
    "directory": (["nc", "check", "."], ["directory"]),
    "coordinates": (["nc", "moves", "tiny.nc", "--coordinates", "polar"], ["polar"]),
    "tools": (["nc", "check", "tiny.nc", "--tools", "none.tbl"], ["none.tbl"]),
    "sweep file": (["sweep", "none.json"], ["none.json"]),
    "sweep no json": (["sweep", "tiny.nc"], ["tiny.nc:1:1", "not valid JSON"]),
    "case": (["bench", "no-such-case"], ["no-such-case"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_usage_is_one_message_and_exit_2(case, tmp_path, capsys, monkeypatch):
    if case == "case":
        pytest.importorskip("benchmarks")
    monkeypatch.chdir(tmp_path)
    write_job(tmp_path)
    argv, words = BAD[case]
    assert run(argv) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and err.startswith("vmachining: ")
    for word in words:
        assert word in err


BAD_JOBS = {
    "arc": (None, "T1 M6\nS1 M3\nG0 X0 Y0 Z-1\nG2 X10 Y0 I4 J0 F100\nM30\n", ["tiny.nc:4:", "radius"]),
    "empty": (None, "", ["tiny.nc", "empty"]),
    "tool": (None, "T7 M6\nS1 M3\nG1 X5 Y5 Z-1 F100\nM30\n", ["tiny.nc:1", "T7"]),
    "never": (None, "T1 M6\nS1 M3\nG1 X500 Y0 Z20 F100\nM30\n", ["reaches the stock"]),
    "binary": (None, "\0\1", ["tiny.nc:1", "plain ASCII"]),
    "typo": ({"chord_mm": "chrod_mm"}, PROGRAM, ["job.toml:22:1", "did you mean 'chord_mm'"]),
    "nan": ({"chord_mm = 0.05": "chord_mm = nan"}, PROGRAM, ["job.toml:22:1", "finite"]),
    "two stocks": ({"[stock]": '[stock]\nstep = "a.step"'}, PROGRAM, ["exactly one"]),
    "broken stl": (
        {"box = { min = [0, 0, -4], max = [10, 18, 0] }": 'stl = "tiny.nc"'},
        PROGRAM,
        ["tiny.nc"],
    ),
    "broken step": (
        {"box = { min = [0, 0, -4], max = [10, 18, 0] }": 'step = "tiny.nc"'},
        PROGRAM,
        ["not a STEP"],
    ),
}


@pytest.mark.parametrize("case", BAD_JOBS)
def test_bad_jobs_end_in_one_message(case, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    swap, program, words = BAD_JOBS[case]
    write_job(tmp_path, swap=swap, program=program)
    assert run(["run", "job.toml", "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    for word in words:
        assert word in err


def test_an_internal_failure_says_where_to_report(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setattr("vmachining.cli.jobs.run", lambda *_, **__: 1 / 0)
    assert run(["run", str(write_job(tmp_path)), "--out", str(tmp_path / "o")]) == 3
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "ZeroDivisionError" in err and "report" in err
    crash = next(tmp_path.glob("vmachining-crash-*.txt"))
    assert str(crash) in err and "Traceback" in crash.read_text()


def test_nc_check_and_moves(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_job(tmp_path)
    assert run(["nc", "check", "tiny.nc", "--tools", "job.toml", "--json"]) == 0
    assert capsys.readouterr() == ("", "")
    (tmp_path / "bad.nc").write_text("G1 X1 F100\nQ\n")
    assert run(["nc", "check", "bad.nc", "--json"]) == 1
    records = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert all(
        set(r) == {"line", "col", "len", "n", "word", "code", "severity", "message", "hint"} for r in records
    )
    assert run(["nc", "check", "bad.nc"]) == 1
    assert "bad.nc:2:" in capsys.readouterr().out
    assert run(["nc", "moves", "tiny.nc", "--json", "--coordinates", "program"]) == 0
    moves = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(moves) == 9 and moves[2]["end_mm"] == [14, 4, -1] and moves[6]["motion"] == "arc_cw"
    assert run(["nc", "moves", "bad.nc"]) == 1
    assert "bad.nc:2:" in capsys.readouterr().err


def test_programs_from_standard_input():
    done = shell("nc", "moves", "-", "--json", input="G0 X1\nM30\n")
    assert done.returncode == 0 and json.loads(done.stdout)["end_mm"][0] == 1


@pytest.mark.slow  # 5 s: OCCT loads in a separate process
def test_the_bracket_of_a_sweep_is_printed_before_occt_is_late(tmp_path, capsys):
    tool = {"type": "ball", "diameter_mm": 10, "length_mm": 40}
    file = tmp_path / "s.json"
    ends = {"start": {"cl_mm": [0, 0, 0]}, "end": {"cl_mm": [30, 0, 0]}}
    for end in ends.values():
        end["axis"] = [0, 0, 1]
    file.write_text(json.dumps({"tool": tool, **ends}))
    assert run(["sweep", str(file), "--seconds", "1e-9", "--chord", "0.1"]) == 0
    first, second = capsys.readouterr().out.splitlines()
    # a ball end of radius 5 and length 40 moved by 30: its volume, and 30 times its meridian
    exact = math.pi * (2 / 3 * 125 + 25 * 35) + 30 * (math.pi * 25 / 2 + 10 * 35)
    assert float(first.split()[0]) == pytest.approx(exact, rel=1e-8)
    assert "no answer within 1e-09 s" in second and "--seconds" in second
    assert run(["sweep", str(file), "--seconds", "nan"]) == 2


@pytest.mark.slow  # 4 s
def test_sweep(tmp_path, capsys):
    tool = {"type": "ball", "diameter_mm": 10, "length_mm": 40}
    pose = {"start": {"cl_mm": [0, 0, 0]}, "end": {"cl_mm": [30, 0, 0], "axis": [0, 0, 2]}}
    file = tmp_path / "s.json"
    file.write_text(json.dumps({"tool": tool, **pose}))
    assert run(["sweep", str(file), "--json", "--chord", "0.1"]) == 0
    straight = json.loads(capsys.readouterr().out)
    assert straight["lo_mm3"] <= straight["volume_mm3"] <= straight["hi_mm3"]
    assert straight["brep_valid"] and straight["brep_mm3"] == pytest.approx(straight["volume_mm3"], rel=1e-6)
    leaning = {
        "start": {"cl_mm": [0, 0, 0], "axis": [0, 1, 0]},
        "end": {"cl_mm": [0, 0, 30], "axis": [0, 1, 0]},
    }
    file.write_text(json.dumps({"tool": tool, **leaning}))
    assert run(["sweep", str(file), "--json", "--chord", "0.1"]) == 0
    assert json.loads(capsys.readouterr().out)["volume_mm3"] == pytest.approx(
        straight["volume_mm3"], rel=1e-9
    )
    turning = {"start": {"cl_mm": [0, 0, 0]}, "end": {"cl_mm": [30, 0, 0], "axis": [0.1, 0, 1]}}
    file.write_text(json.dumps({"tool": tool, **turning}))
    assert run(["sweep", str(file), "--json", "--chord", "0.1"]) == 0
    turned = json.loads(capsys.readouterr().out)
    assert straight["proven"] and not turned["proven"]
    assert straight["lo_mm3"] < turned["lo_mm3"] <= turned["volume_mm3"] <= turned["hi_mm3"]
    assert turned["brep_mm3"] is not None or "turns" in turned["brep_note"]
    for broken, words in (
        ({"tool": tool, **pose, "interpolation": "rotary"}, "unknown key 'end.axis'"),
        (
            {"tool": tool, "start": {"cl_mm": [0, 0, 0]}, "end": {"cl_mm": [0, 0, 1], "axis": [0, 0, -1]}},
            "opposite",
        ),
        ({"tool": tool, "start": {"cl_mm": [0, 0]}, "end": {"cl_mm": [0, 0, 1]}}, "start.cl_mm"),
        ({"tool": {**tool, "diameter_mm": 0}, **pose}, "diameter"),
        ({"tool": tool, **pose, "control_height_mm": "5"}, "control_height_mm"),
        ({"tool": tool}, "start"),
        ([], "object"),
    ):
        file.write_text(json.dumps(broken))
        assert run(["sweep", str(file)]) == 2
        err = capsys.readouterr().err
        assert words in err and err.count("\n") == 1


@pytest.mark.slow  # 5 s
def test_batch_goes_on_after_a_failure_and_resumes(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    one = write_job(tmp_path / "a")
    two = write_job(tmp_path / "b", program="")
    argv = ["batch", str(one), str(two), str(one), "--out", "out", "--stock", "", "--workers", "2"]
    assert run(argv) == 2
    assert "empty" in capsys.readouterr().err
    with (tmp_path / "out" / "batch.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["done", "failed", "done"]
    assert [row["exit_code"] for row in rows] == ["0", "2", "0"]
    assert len({row["out"] for row in rows}) == 3 and float(rows[0]["removed_mm3"]) > 40
    write_job(tmp_path / "b")
    assert run([*argv, "--resume", "--json"]) == 0
    again = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [row["status"] for row in again] == ["skipped", "done", "skipped"]
    assert again[0]["removed_mm3"] == again[1]["removed_mm3"]


def test_demos_are_listed_and_named(capsys):
    assert run(["demo", "--list", "--json"]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {"slot", "mould"} <= {row["name"] for row in rows}
    assert all(row["about"] and row["processor_s"] > 0 for row in rows)
    assert run(["demo", "nothing"]) == 2
    assert "slot" in capsys.readouterr().err


def test_demo_runs_the_shipped_model(tmp_path):
    from vmachining.cli.demo import demo_job
    from vmachining.job import Job

    assert Job.load(demo_job()).name


def test_the_line_that_goes_on_names_what_was_asked_for():
    from vmachining.cli.job_commands import RunOptions

    assert RunOptions().words() == []
    asked = RunOptions(chord=0.02, brep="3,7-9", stock_at="4", directions=3, brep_seconds=30.0)
    assert (
        shlex.join(asked.words()) == "--chord 0.02 --directions 3 --brep 3,7-9 --brep-seconds 30 --stock-at 4"
    )


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
@pytest.mark.slow  # 17 s
def test_an_interrupted_run_exits_130_and_goes_on(number, tmp_path):
    steps = "".join(f"G1 X{1 + k % 9} Y{1 + k % 13} Z{-0.01 * k:.2f}\n" for k in range(60))
    program = f"T1 M6\nS1000 M3\nG0 X1 Y1 Z1\nG1 Z0 F500\n{steps}M30\n"
    job = write_job(tmp_path, program=program, job=JOB + FEED)
    argv = [
        sys.executable,
        "-m",
        "vmachining",
        "run",
        str(job),
        "--out",
        str(tmp_path / "out"),
        "--stock",
        "",
    ]
    process = subprocess.Popen(argv, stderr=subprocess.PIPE, text=True)
    partial = tmp_path / "out" / "blocks.partial.csv"
    deadline = time.monotonic() + 240
    while not (partial.exists() and partial.stat().st_size > 2000) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(number)
    err = process.communicate(timeout=240)[1]
    assert process.returncode == 130, err
    assert "stopped after block" in err and "--resume" in err and "Traceback" not in err
    assert json.loads((tmp_path / "out" / "manifest.json").read_text())["complete"] is False
    done = subprocess.run([*argv, "--resume"], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "out" / "manifest.json").read_text())["complete"] is True
