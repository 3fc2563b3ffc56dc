"""Job files made from programs: they load, they run, and what nobody told is not invented."""

from __future__ import annotations

import tomllib
from math import acos, pi, radians, sqrt, tan
from pathlib import Path

import pytest

from vmachining.cli.main import run as command
from vmachining.errors import JobError, NCError
from vmachining.job import Job, draft_job, run
from vmachining.job.reading import read_job_program
from vmachining.job.summary import guesses

ROOT = Path(__file__).parents[2]
PART = """\
%
(T1 D=4. CR=0. - ZMIN=-1. - flat end mill)
(T2 D=6. CR=3. - ZMIN=-2. - ball end mill)
(T3 D=3.3 CR=0. TAPER=118deg - ZMIN=-6. - drill)
N10 G21 G17 G90 G94
T1 M6
S8000 M3
G0 X0 Y0 Z5
G1 Z-1 F200
X20 F600
G0 Z5
T2 M6
S8000 M3
G0 X0 Y10
G1 Z-2 F200
X20 F600
G0 Z5
T3 M6
S2000 M3
G98 G81 X10 Y20 Z-6 R2 F100
G80
M30
%
"""


def volume_of_part() -> float:
    """A flat slot, a ball slot and a drilled hole in mm3, by their closed forms."""
    slot = 4 * 20 * 1 + pi * 2**2 * 1
    segment = 3**2 * acos(1 / 3) - 1 * sqrt(3**2 - 1)
    ball = segment * 20 + pi * 2**2 * (3 * 3 - 2) / 3
    tip = 1.65 / tan(radians(59))
    return slot + ball + pi * 1.65**2 * (6 - tip + tip / 3)


def drafted(folder: Path, text: str) -> Job:
    (folder / "part.nc").write_text(text)
    return Job.from_mapping(tomllib.loads(draft_job(folder / "part.nc", folder).text), folder)


def test_the_job_of_a_posted_program_runs_at_once(tmp_path):
    (tmp_path / "part.nc").write_text(PART)
    draft = draft_job(tmp_path / "part.nc", tmp_path)
    assert (draft.tools, draft.dialect, draft.units, draft.open, draft.errors) == (
        (1, 2, 3),
        "iso",
        "mm",
        (),
        (),
    )
    summary = run(Job.from_mapping(tomllib.loads(draft.text), tmp_path)).summary
    assert summary["removed_lo_mm3"] <= volume_of_part() <= summary["removed_hi_mm3"]
    assert all(f"# GUESS: {guess.rsplit(': ', 1)[1]}" in draft.text for guess in draft.guesses)


def test_inch_programs_have_their_stock_in_inches(tmp_path):
    text = "(T1 D=0.25 CR=0. - flat end mill)\nG20 G90 T1 M6 S1 M3\nG0 X0 Y0 Z1\nG1 Z-0.5 F10\nX3\nM2\n"
    job = drafted(tmp_path, text)
    assert job.keys.units == "inch" and job.tools[1].profile.max_radius == pytest.approx(3.175)
    low, high = job.keys.stock.box.min, job.keys.stock.box.max
    assert low == pytest.approx((-0.25, -0.25, -0.6)) and high == pytest.approx((3.25, 0.25, 0.0))


def test_a_diameter_that_nobody_tells_is_asked_for_and_not_invented(tmp_path):
    (tmp_path / "part.nc").write_text("G21 G90 T5 M6 S1 M3\nG0 Z1\nG1 Z-1 F10\nX3\nM2\n")
    draft = draft_job(tmp_path / "part.nc", tmp_path)
    assert draft.open == ("no comment gives the diameter of tool 5 (cuts from line 3)",)
    assert "# diameter_mm =    # MUST BE GIVEN" in draft.text
    with pytest.raises(JobError, match="tool 5: diameter_mm is missing"):
        Job.from_mapping(tomllib.loads(draft.text), tmp_path)
    filled = draft.text.replace("# diameter_mm = ", "diameter_mm = 6 ")
    assert Job.from_mapping(tomllib.loads(filled), tmp_path).tools[5].profile.max_radius == 3.0


def test_long_dwells_are_taken_as_milliseconds_with_a_mark(tmp_path):
    job = drafted(tmp_path, "(T1 D=6 CR=0 - flat end mill)\nG21 T1 M6 S1 M3\nG4 P1000\nG1 Z-1 F10\nM2\n")
    assert job.keys.program.dwell == "ms"


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        (
            "UNITS/MM\nLOADTL/1\nCUTTER/10,0\nSPINDL/1000,CLW\nFEDRAT/100\nGOTO/0,0,5\nGOTO/9,0,-5\nFINI\n",
            "apt",
        ),
        ("x_mm,y_mm,z_mm,feed_mm_min\n0,0,0,100\n9,0,-1,100\n", "poses"),
        ("G21 G90 G94 F100 S100 M3\nG0 X0 Y0 Z0\nG81 Z-15 W0\nG79 X1 Y1\nM2\n", "mts"),
    ],
)
def test_the_dialect_is_found(tmp_path, text, dialect):
    (tmp_path / "part.nc").write_text(text)
    assert draft_job(tmp_path / "part.nc", tmp_path).dialect == dialect


def test_the_cutter_of_a_cutter_location_file_is_known(tmp_path):
    job = drafted(
        tmp_path, "UNITS/INCHES\nLOADTL/2\nCUTTER/.5,.125\nFEDRAT/9\nGOTO/0,0,1\nGOTO/0,0,-1\nFINI\n"
    )
    assert (job.tools[2].diameter, job.tools[2].corner_radius) == pytest.approx((12.7, 3.175))


def test_turning_axes_get_a_machine(tmp_path):
    text = "(T1 D=6 CR=3 - ball end mill)\nG21 G90 T1 M6 S1 M3\nG0 Z20 A0 C0\nG1 Z-1 F10\nG1 X9 A10 C5\nM2\n"
    job = drafted(tmp_path, text)
    assert job.machine is not None and {"A", "C"} <= set(job.machine.names)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("L X+10 FMAX\n", "no BEGIN PGM"),
        ("G0 X1\nM2\n", "nothing is cut"),
        ("G1 X1,5 F9\nM2\n", "decimal comma"),
    ],
)
def test_what_is_no_program_gets_no_job(tmp_path, text, words):
    (tmp_path / "part.nc").write_text(text)
    with pytest.raises(NCError, match=words):
        draft_job(tmp_path / "part.nc", tmp_path)


@pytest.mark.parametrize("name", ["pocket", "slot", "mould", "half_cylinder"])
def test_the_stock_of_shipped_programs_holds_what_their_tools_reach(name):
    program = ROOT / "models" / name / f"{name}.nc"
    draft = draft_job(program, program.parent)
    real = Job.load(program.with_name("job.toml"))
    assert sorted(draft.tools) == sorted(real.tools)
    for number in draft.tools:
        assert f"number = {number}\n" in draft.text


def test_the_command_writes_and_never_overwrites(tmp_path, capsys):
    program, job = tmp_path / "part.nc", tmp_path / "part.toml"
    program.write_text(PART)
    assert command(["init", str(program)]) == 0
    assert "guess" in capsys.readouterr().err and Job.load(job).name == "part"
    job.write_text("mine")
    assert command(["init", str(program)]) == 2 and job.read_text() == "mine"
    assert "--force" in capsys.readouterr().err
    assert (
        command(["init", str(program), "--out", str(program), "--force"]) == 2 and program.read_text() == PART
    )
    assert command(["init", str(program), "--force"]) == 0 and Job.load(job).name == "part"
    capsys.readouterr()
    assert command(["init", str(job)]) == 2 and "job file" in capsys.readouterr().err
    folder = tmp_path / "jobs"
    folder.mkdir()
    assert command(["init", str(program), "--out", str(folder / "a.toml")]) == 0
    assert Job.load(folder / "a.toml").program_path.resolve() == program.resolve()
    capsys.readouterr()
    assert command(["init", str(program), "--out", "-"]) == 0
    printed = capsys.readouterr()
    assert "[stock]" in printed.out and "written" not in printed.err and "run -" not in printed.err
    name = f"{program.stem}.toml"
    assert (
        f"save the text as {name} in this directory" in printed.err
        and f"vmachining run {name}" in printed.err
    )
    program.write_text("G21 T1 M6 S1 M3\nG1 Z-1 F10\nM2\n")
    assert command(["init", str(program), "--force"]) == 1 and "MUST BE GIVEN" in job.read_text()


def test_the_job_of_another_program_beside_it_is_not_run(tmp_path, capsys):
    """part.nc has the job that lies beside part.h, and was run in its place."""
    (tmp_path / "part.nc").write_text(PART)
    (tmp_path / "part.h").write_text(
        "0 BEGIN PGM P MM\n1 TOOL CALL 1 Z S1000\n2 L X+9 F100\n3 END PGM P MM\n"
    )
    out = ["--out", str(tmp_path / "out"), "--stages", "cut", "--quiet"]
    assert command(["run", str(tmp_path / "part.nc"), *out]) == 0
    assert command(["run", str(tmp_path / "part.nc"), *out, "--resume"]) == 0
    capsys.readouterr()
    assert command(["run", str(tmp_path / "part.h"), *out]) == 2
    assert "part.toml is the job of another program" in capsys.readouterr().err


def test_a_guess_that_is_commented_out_is_no_guess_of_the_job(tmp_path):
    (tmp_path / "part.nc").write_text(PART)
    text = draft_job(tmp_path / "part.nc", tmp_path).text
    (tmp_path / "job.toml").write_text(text)
    before = guesses(Job.load(tmp_path / "job.toml"))
    (home,) = (line for line in text.splitlines() if line.startswith("home = "))
    (tmp_path / "job.toml").write_text(text.replace(home, f"# {home}\nhome = [0, 0, 80]"))
    after = guesses(Job.load(tmp_path / "job.toml"))
    assert len(before) > 1 and after == [text for text in before if not text.startswith("home")]


def test_a_shape_without_a_diameter_is_kept_and_its_diameter_asked_for(tmp_path):
    path = tmp_path / "drill.nc"
    path.write_text("G21 G90\n(T1 STUB DRILL)\nT1 M6\nS1000 M3\nG0 X5 Y5 Z2\nG81 Z-5 R1 F100\nG80\nM30\n")
    draft = draft_job(path, tmp_path)
    assert 'type = "drill"' in draft.text
    assert draft.open == ("no comment gives the diameter of tool 1 (cuts from line 6)",)


def test_a_number_beside_the_name_of_a_cutter_is_a_guess_that_is_said(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text(
        "G21 G90\nT1 M6 (ENDMILL 10)\nS1 M3\nG0 Z1\nG1 Z-1 F10\nX3\nT2 M6 (ENDMILL 2)\nG1 Z-2\nT3 M6\nG1 Z-3\nM2\n"
    )
    draft = draft_job(path, tmp_path)
    assert 'diameter_mm = 10   # GUESS: diameter of tool 1, from its name "ENDMILL 10"' in draft.text
    assert draft.open == (
        "no comment gives the diameters of tools 2 (cuts from line 8) and 3 (cuts from line 10)",
    )


def test_no_job_runs_without_a_program_that_may_cut(tmp_path):
    """A macro of the builder is left out, any other missing program stops the job, and names its file."""
    text = "O1\n(T1 D=10. - flat end mill)\nG21 G90 T1 M6 S1 M3\nG65 P9021\nG0 Z1.\nG1 Z-1. F10.\nX3.\nM98 P7\nM30\n"
    with pytest.raises(NCError, match=r"no program O7 .* O7\.nc"):
        read_job_program(drafted(tmp_path, text))
    assert read_job_program(drafted(tmp_path, text.replace("M98 P7\n", ""))).moves[-1].end[0] == 3.0
