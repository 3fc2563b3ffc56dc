"""Programs of other people's machines in, jobs that run out: dialects, units, tools of libraries, one command."""

from __future__ import annotations

import json
import re
import tomllib
import zipfile
from math import pi, radians, tan
from pathlib import Path

import pytest

from vmachining.cli.jobs import draft_again
from vmachining.cli.main import run as command
from vmachining.errors import InputError, NCError
from vmachining.job import Job, draft_job, run
from vmachining.job.asked import made_with
from vmachining.nc.toolcomments import cutter_notes
from vmachining.nc.toollibrary import read_tool_library

NX = """TOOL PATH/SLOT,TOOL,MILL_D10
TLDATA/MILL,10.0000,0.0000,75.0000,0.0000,0.0000
MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000
$$ centerline data
PAINT/PATH
RAPID
GOTO/0.0000,0.0000,20.0000,0.0000000,0.0000000,1.0000000
RAPID
GOTO/0.0000,0.0000,1.0000
FEDRAT/MMPM,250.0000
GOTO/0.0000,0.0000,-2.0000
GOTO/30.0000,0.0000,-2.0000
RAPID
GOTO/30.0000,0.0000,20.0000
END-OF-PATH
TOOL PATH/DRILL,TOOL,STD_D8
TLDATA/DRILL,MILL,8.0000,0.0000,80.0000,118.0000,35.0000
MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000
RAPID
GOTO/15.0000,20.0000,20.0000,0.0000000,0.0000000,1.0000000
CYCLE/DRILL,RAPTO,3.0000,FEDTO,-10.0000,RTRCTO,AUTO,MMPM,100.0000
GOTO/15.0000,20.0000,0.0000
CYCLE/OFF
END-OF-PATH
"""


def volume_of_nx() -> float:
    """A slot with two round ends, 2 deep, and a drilled hole with its cone."""
    tip = 4 / tan(radians(59))
    return (10 * 30 + pi * 25) * 2 + pi * 16 * (10 - tip + tip / 3)


def test_a_cl_file_runs_by_one_command(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.cls").write_text(NX)
    assert command(["run", "part.cls", "--out", "out", "--stock", "stl"]) in (0, 1)
    told = capsys.readouterr().err
    assert "guess" in told and "apt" in (tmp_path / "part.toml").read_text()
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["removed_lo_mm3"] <= volume_of_nx() <= summary["removed_hi_mm3"]


OPEN = "%\nO1\nG21 G90\nT3 M6\nS900 M3\nG0 X0 Y0 Z5\nG1 Z-1 F100\nX20\nG0 Z9\nT4 M6\nG0 Y9\nG1 Z-2\nG0 Z9\nM30\n%\n"
SLOT_AND_PLUNGE = 8 * 20 + pi * 16 + pi * 9 * 2
"""A flat end of 8 mm over 20 mm, 1 deep; one of 6 mm, 2 deep."""


def removed(folder: Path) -> tuple[float, float]:
    summary = json.loads((folder / "summary.json").read_text())
    return summary["removed_lo_mm3"], summary["removed_hi_mm3"]


def test_what_a_draft_leaves_open_is_asked_for_once_in_words_to_type(tmp_path, monkeypatch, capsys):
    """One sentence with line and option for each tool; an untouched draft takes them, and keeps them for the next time."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.nc").write_text(OPEN)
    assert command(["run", "part.nc", "--out", "out"]) == 2
    told = capsys.readouterr().err
    assert (
        "part.nc: no comment gives the diameters of tools 3 (cuts from line 7) and 4 (cuts from line 12);"
        in told
    )
    assert "vmachining run part.nc --tool 3=TYPE:DIAMETER --tool 4=TYPE:DIAMETER (TYPE is flat, ball" in told
    assert command(["run", "part.nc", "--out", "out", "--tool", "3=flat:8"]) == 2
    assert "--tool 4=TYPE:DIAMETER" in (told := capsys.readouterr().err) and "--tool 3" not in told
    assert command(["run", "part.nc", "--out", "out", "--stages", "cut", "--tool", "4=flat:6"]) == 0
    low, high = removed(tmp_path / "out")
    assert low <= SLOT_AND_PLUNGE <= high
    before = (tmp_path / "part.toml").read_text()
    assert before.count("# given by --tool") == 2 and "# MUST BE GIVEN:" not in before
    assert command(["run", "part.nc", "--out", "out", "--stages", "cut", "--resume"]) == 0
    assert (tmp_path / "part.toml").read_text() == before


def test_a_draft_remembers_its_library_from_everywhere(tmp_path, monkeypatch):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "part.nc").write_text(OPEN)
    (tmp_path / "shop.csv").write_text("number,type,diameter_mm\n3,flat end mill,8\n")
    monkeypatch.chdir(tmp_path)
    assert command(["run", "parts/part.nc", "--tools", "shop.csv"]) == 2  # tool 4 is missing
    monkeypatch.chdir(tmp_path / "parts")
    assert command(["init", "part.nc", "--tool", "4=6", "--tools", "../shop.csv", "--out", "own.toml"]) == 0
    assert "GUESS: --tool gives the diameter of tool 4 alone" in (tmp_path / "parts" / "own.toml").read_text()
    draft = draft_again(
        Path("part.nc"),
        Path("part.toml"),
        made_with(Path("part.toml")) or [],
        tools=None,
        units="",
        given=["4=ball:6"],
    )
    assert not draft.open and draft.text.count("diameter_mm = 8") == 1


def test_an_edited_draft_is_never_written_anew(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.nc").write_text(OPEN)
    assert command(["run", "part.nc"]) == 2
    mine = (tmp_path / "part.toml").read_text().replace("[stock]", "[stock]  # mine")
    (tmp_path / "part.toml").write_text(mine)
    capsys.readouterr()
    assert command(["run", "part.nc", "--tool", "3=flat:8", "--tool", "4=flat:6"]) == 2
    assert "has been edited" in capsys.readouterr().err and (tmp_path / "part.toml").read_text() == mine


def test_a_library_tells_what_a_program_does_not(tmp_path, monkeypatch):
    """Named, it is believed; the only one beside the program is a guess; of two that know the tools neither is taken."""
    (tmp_path / "part.nc").write_text(OPEN)
    (tmp_path / "shop.csv").write_text(
        "number,type,diameter_mm,flutes\n3,flat end mill,8,4\n4,flat end mill,6,4\n"
    )
    named = draft_job(tmp_path / "part.nc", tmp_path, library=tmp_path / "shop.csv")
    assert not named.open and not any("diameter" in guess for guess in named.guesses)
    (tmp_path / "shop.csv").rename(tmp_path / "tools.csv")
    beside = draft_job(tmp_path / "part.nc", tmp_path)
    assert not beside.open
    assert sum("from tools.csv, next to the program" in guess for guess in beside.guesses) == 2
    job = Job.from_mapping(tomllib.loads(beside.text), tmp_path)
    assert [tool.profile.max_radius for tool in job.tools.values()] == [4.0, 3.0]
    (tmp_path / "TOOL.T").write_text(
        "BEGIN TOOL .T MM\nT   NAME     L      R     R2\n3   MILL     80.5   5     0\n[END]\n"
    )
    (tmp_path / "tools.json").write_text("{")
    two = draft_job(tmp_path / "part.nc", tmp_path)
    assert any(
        "tools.json next to the program is left out, the tool library is damaged" in g for g in two.guesses
    )
    assert "# GUESS: tool library tools.json" in two.text
    assert len(two.ask) == 2 and two.beside == ("TOOL.T", "tools.csv")


@pytest.mark.parametrize(
    ("word", "kind", "radius"),
    [
        ("3=flat:8", "flat", 4.0), ("3=ball:1/2in", "ball", 6.35), ("3=bull:10mm:.0625in", "bull", 5.0),
        ("3=drill:8.5:140", "drill", 4.25), ("3=taper:1:7", "taper", None), ("3=chamfer:10:90deg", "drill", 5.0),
        ("3=1-1/2in", "flat", 19.05), ("03 = ball : 6", "ball", 3.0),
    ],
)  # fmt: skip
def test_tools_in_words(tmp_path, word, kind, radius):
    (tmp_path / "part.nc").write_text(OPEN.replace("T4 M6", ""))
    draft = draft_job(tmp_path / "part.nc", tmp_path, tools=[word])
    assert f'type = "{kind}"' in draft.text and not draft.open
    profile = Job.from_mapping(tomllib.loads(draft.text), tmp_path).tools[3].profile
    assert radius is None or profile.max_radius == pytest.approx(radius)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["3=flat"], "it must be NUMBER=TYPE:DIAMETER"), (["3=flat:0"], "a diameter of 0 mm"), (["9=flat:8"], "has no tool 9"),
        (["3=flat:8", "3=ball:6"], "given twice"), (["3=bull:8"], "needs its corner radius"),
        (["3=flat:8:1"], "flat has one size"),        (["3=bull:8:9"], "at most half"), (["3=drill:8:3mm"], "has one size"),
        (["3=taper:1"], "half angle"),
        (["3=cone:4"], "it must be"), (["3=flat:1/0in"], "a fraction over 0"),
    ],
)  # fmt: skip
def test_words_that_tell_no_tool(tmp_path, words, said):
    (tmp_path / "part.nc").write_text(OPEN)
    with pytest.raises(InputError, match=re.escape(said)):
        draft_job(tmp_path / "part.nc", tmp_path, tools=words)


def test_a_tool_that_only_plunges_is_taken_as_a_drill_with_a_mark(tmp_path):
    text = "G21 G90\nT3 M6 (D8)\nS900 M3\nG0 Z5\nG81 X0 Z-9 R1 F90\nX20\n{}G80\nM30\n"
    for more, kind in (("X40\n", "drill"), ("", "flat"), ("X40\nG1 Z-1\nX50\n", "flat")):
        (tmp_path / "part.nc").write_text(text.format(more))
        draft = draft_job(tmp_path / "part.nc", tmp_path)
        assert f'type = "{kind}"   # GUESS: ' in draft.text and "diameter_mm = 8\n" in draft.text
    (tmp_path / "part.nc").write_text(text.replace("(D8)", "").format("X40\n"))
    assert draft_job(tmp_path / "part.nc", tmp_path).ask == ("--tool 3=drill:DIAMETER",)


def test_cuts_without_a_tool_beside_others_are_said_by_the_draft(tmp_path):
    """No job runs it: the tool of such a cut is none."""
    text = (
        "0 BEGIN PGM A MM\n1 TOOL CALL 2 Z S900\n2 L X+9 F90\n3 TOOL CALL 0 Z\n4 L X+20 F90\n5 END PGM A MM\n"
    )
    (tmp_path / "part.h").write_text(text)
    assert any("line 5: a cut without a tool" in e for e in draft_job(tmp_path / "part.h", tmp_path).errors)


def test_a_missing_subprogram_is_said_by_the_draft_too(tmp_path, capsys):
    text = (
        "%\nO1\nG21 G90\n(T3 D=8 CR=0 - flat end mill)\nT3 M6\nS900 M3\nG0 Z5\nG1 Z-1 F100\nM98 P77\nM30\n%\n"
    )
    (tmp_path / "part.nc").write_text(text)
    assert command(["init", str(tmp_path / "part.nc")]) == 1
    assert "W383" in capsys.readouterr().err
    (tmp_path / "O0077.nc").write_text("O77\nX20.\nM99\n")
    assert command(["init", str(tmp_path / "part.nc"), "--force"]) == 0


def test_a_program_with_findings_keeps_its_dialect(tmp_path):
    (tmp_path / "part.nc").write_text("G21 G90\nT1 M6\nS1000 M3\nG22\nG23.5 Q\nG1 X1 F100\nM30\n")
    draft = draft_job(tmp_path / "part.nc", tmp_path)
    assert draft.dialect in ("iso", "fanuc") and draft.errors


def test_inches_are_inferred_and_drills_keep_their_size(tmp_path):
    text = (
        "%\nO1 (ALL DIMENSIONS IN INCH)\n(T1 D=0.25 CR=0. TAPER=118deg - drill)\nG90\nT1 M6\nS900 M3\n"
        "G0 X0 Y0 Z1.\nG99 G81 Z-.5 R.1 F5.\nX1.\nG80\nM30\n%\n"
    )
    (tmp_path / "part.nc").write_text(text)
    draft = draft_job(tmp_path / "part.nc", tmp_path)
    assert draft.units == "inch" and any("units" in guess for guess in draft.guesses)
    job = Job.from_mapping(tomllib.loads(draft.text), tmp_path)
    assert job.tools[1].profile.max_radius == pytest.approx(3.175)
    point = 3.175 / tan(radians(59))
    holes = 2 * pi * 3.175**2 * (12.7 - point + point / 3)
    summary = run(job).summary
    assert summary["removed_lo_mm3"] <= holes <= summary["removed_hi_mm3"]


def test_programs_that_declare_where_the_tool_is_run(tmp_path):
    """G92 takes the home of the job for X0 Y0 Z50: the slot lies where that says, and the stock around it."""
    text = "(T1 D=4 CR=0 - flat end mill)\nG21 G90 T1 M6 S9 M3\nG92 X0 Y0 Z50\nG0 Z1\nG1 Z-1 F100\nX20\nG0 Z50\nM2\n"
    (tmp_path / "part.nc").write_text(text)
    draft = draft_job(tmp_path / "part.nc", tmp_path)
    summary = run(Job.from_mapping(tomllib.loads(draft.text), tmp_path)).summary
    assert summary["removed_mm3"] > 0.0
    assert summary["removed_lo_mm3"] <= 80 + 4 * pi <= summary["removed_hi_mm3"]


def test_compensation_asks_for_its_entry(tmp_path):
    text = "(T1 D=4 CR=0 - flat end mill)\nG21 G90 T1 M6 S9 M3\nG0 Z1\nG1 Z-1 F100\nG41 D1 X20\nX40\nG40 Y30\nM2\n"
    (tmp_path / "part.nc").write_text(text)
    assert any(
        "crc_entry" in guess and "line 5" in guess
        for guess in draft_job(tmp_path / "part.nc", tmp_path).guesses
    )


def test_a_program_that_is_compensated_throughout_asks_for_its_diameter(tmp_path):
    """Nothing of its path is known without the radius of the tool: it was refused instead of asked for."""
    text = "G21 G90\nT1 M6\nS3000 M3\nG0 X-20 Y0 Z-1\nG41 D1 G1 X0 F100\nX10 Y5\nG40 X20\nM30\n"
    (tmp_path / "part.nc").write_text(text)
    draft = draft_job(tmp_path / "part.nc", tmp_path)
    assert any("diameter" in missing for missing in draft.open) and not draft.errors
    box = tomllib.loads(draft.text)["stock"]["box"]
    assert box["min"][0] <= 0.0 and box["max"][0] >= 20.0


FUSION = {"data": [
    {"type": "flat end mill", "unit": "inches", "geometry": {"DC": 0.25, "NOF": 3}, "post-process": {"number": 1}},
    {"type": "bull nose end mill", "unit": "millimeters", "geometry": {"DC": 10, "RE": 2}, "post-process": {"number": 2}},
    {"type": "drill", "unit": "millimeters", "geometry": {"DC": 5, "SIG": 140}, "post-process": {"number": 3}},
    {"type": "dovetail mill", "unit": "millimeters", "geometry": {"DC": 9}, "post-process": {"number": 4}},
    {"type": "holder", "unit": "millimeters"},
]}  # fmt: skip
ITEMS = {1: ("flat", 6.35, None, None, 3), 2: ("bull", 10, 2, None, None), 3: ("drill", 5, None, 140, None),
         4: (None, 9, None, None, None)}  # fmt: skip


def test_libraries_of_tools(tmp_path):
    (tmp_path / "a.json").write_text(json.dumps(FUSION))
    with zipfile.ZipFile(tmp_path / "a.tools", "w") as archive:
        archive.writestr("tools.json", json.dumps(FUSION))
    for name in ("a.json", "a.tools"):
        assert {n: note[2:7] for n, note in read_tool_library(tmp_path / name).items()} == ITEMS
    bit = {
        "version": 2,
        "name": "5mm",
        "shape": "ballend.fcstd",
        "parameter": {"Diameter": "5.0000 mm", "Flutes": "2"},
    }
    (tmp_path / "5mm.fctb").write_text(json.dumps(bit))
    (tmp_path / "shop.fctl").write_text(json.dumps({"tools": [{"nr": 7, "path": "5mm.fctb"}]}))
    assert read_tool_library(tmp_path / "5mm.fctb")[1][2:4] == ("ball", 5.0)
    assert read_tool_library(tmp_path / "shop.fctl")[7][2:7] == ("ball", 5.0, None, None, 2)
    (tmp_path / "TOOL.T").write_text(
        "BEGIN TOOL .T MM\nT   NAME     L      R     R2   CUT T-ANGLE\n4   BALL     80.5   5     5    2\n"
        "5   DRILL    90     4     0        118\n[END]\n"
    )
    table = read_tool_library(tmp_path / "TOOL.T")
    assert (table[4][2:7], table[5][2:4]) == ((None, 10.0, 5.0, None, 2), ("drill", 8.0))


SOLIDWORKS = """PARTNO/1
UNIT/MM
INSERT/[HOLDER=C40] 6.0mm JOBBER DRILL
CUTTER/6.,0,3.,1.802582,31.,0,102.
LOAD/TOOL,15
FEDRAT/100.,MMPM
GOTO/12.,17.,25.
GOTO/12.,17.,-3.
GOTO/12.,17.,25.
INSERT/[HOLDER=C40] 14MM CRB 4FL 32 LOC
CUTTER/14.,0,7.,0,0,0,84.
LOAD/TOOL,5
GOTO/20.,17.,5.
GOTO/20.,17.,-2.
GOTO/60.,17.,-2.
GOTO/60.,17.,25.
FINI
"""


def test_a_cutter_before_its_load_is_that_of_the_load(tmp_path):
    """SolidWorks CAM writes CUTTER, then LOAD; NX the other way round. A cutter belongs to the LOAD with no motion between."""
    notes = cutter_notes(SOLIDWORKS.splitlines(), 1.0)
    assert (notes[15].kind, notes[15].diameter_mm, notes[15].angle_deg) == ("drill", 6.0, 118.0)
    assert (notes[5].kind, notes[5].diameter_mm) == (None, 14.0)
    turned = SOLIDWORKS.replace(
        "CUTTER/14.,0,7.,0,0,0,84.\nLOAD/TOOL,5", "LOAD/TOOL,5\nCUTTER/14.,0,7.,0,0,0,84."
    )
    assert cutter_notes(turned.splitlines(), 1.0)[5].diameter_mm == 14.0
    (tmp_path / "part.apt").write_text(SOLIDWORKS)
    text = draft_job(tmp_path / "part.apt", tmp_path / "job.toml").text
    assert 'units = "mm"   # of the stock' in text and 'type = "drill"' in text and "diameter_mm = 14" in text


def test_a_cl_file_in_inches_per_minute_is_drafted_in_inches(tmp_path):
    """No UNITS record: feeds in IPM say it, so the cutter of TLDATA and its length are inches too, and the job says so."""
    (tmp_path / "part.cls").write_text(
        "TOOL PATH/A,TOOL,M1\nTLDATA/MILL,0.5,0.0625,3.0,0.0,0.0\nLOAD/TOOL,1\nSPINDL/RPM,900,CLW\nRAPID\n"
        "GOTO/0,0,1,0,0,1\nFEDRAT/IPM,10\nGOTO/0,0,-0.1\nGOTO/2,0,-0.1\nEND-OF-PATH\n"
    )
    draft = draft_job(tmp_path / "part.cls", tmp_path)
    job = Job.from_mapping(tomllib.loads(draft.text), tmp_path)
    assert (draft.units, job.tools[1].profile.max_radius) == ("inch", pytest.approx(6.35))
    assert "length_mm = 76.2\n" in draft.text and any("units" in guess for guess in draft.guesses)


def test_a_linuxcnc_table_is_in_the_unit_of_the_program_and_its_comments_tell_shapes(tmp_path):
    (tmp_path / "part.nc").write_text("G20 G90\nT3 M6\nS900 M3\nG0 X0 Y0 Z1\nG1 Z-.1 F10\nX2\nG0 Z1\nM2\n")
    (tmp_path / "shop.tbl").write_text("T3 P3 Z0.5 D0.25 ;1/4 ball nose\n")
    draft = draft_job(tmp_path / "part.nc", tmp_path, library=tmp_path / "shop.tbl")
    assert 'type = "ball"' in draft.text and "diameter_mm = 6.35" in draft.text
    assert any("diameter_mm" in guess and "no unit" in guess for guess in draft.guesses)


IDLE_TOOLS = [  # a probe or a tool at the end that cuts nothing, in three languages
    ("a.nc", "%\nO1\nG21 G90 G54\nT9 M6\nG43 H9 Z50.\n"
             "T1 M6\nS1 M3\nG0 X0 Y0\nG43 H1 Z5.\nT7\nG1 Z-2. F9\nX30.\nG0 Z50.\nM30\n%\n"),
    ("a.h", "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S1\n2 L X+0 Y+0 R0 FMAX M3\n3 L Z-2 F9\n4 L X+30\n5 L Z+50 FMAX\n"
            "6 TOOL CALL 9 Z\n7 L Z+60 FMAX\n8 M30\n9 END PGM A MM\n"),
    ("a.mpf", "G17 G71 G90 G54\nT1 M6\nS1 M3\nG0 X0 Y0\nZ5\nG1 Z-2 F9\nX30\nG0 Z50\nT9\nM6\nM30\n"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text"), IDLE_TOOLS)
def test_tools_that_cut_nothing_need_no_table(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    (tmp_path / "a.toml").write_text(draft_job(tmp_path / name, tmp_path, tools=("1=flat:10",)).text)
    summary = run(Job.load(tmp_path / "a.toml"), stages=("cut",)).summary
    assert summary["removed_lo_mm3"] <= 2 * (10 * 30 + 25 * pi) <= summary["removed_hi_mm3"]
    cuts = (
        text.replace("T7\n", "T9 M6\n")
        .replace("L Z-2", "TOOL CALL 9 Z S1\n33 L Z-2")
        .replace("Z5\n", "Z5\nT9\nM6\n")
    )
    (tmp_path / name).write_text(cuts)
    with pytest.raises(NCError, match=r"E321|tool 9"):
        run(Job.load(tmp_path / "a.toml"), stages=("cut",))


def test_arcs_beside_an_unknown_radius_are_no_errors_of_a_draft(tmp_path):
    text = "G21 G90 G54\nT2 M6\nS1 M3\nG0 X8 Y-74\nZ-2\nG1 G41 X12. Y-70. D2 F9\nG3 X0. Y-58. I-12.\nG1 X-65\nG40 Y-80\nM30\n"
    (tmp_path / "a.nc").write_text(text)
    draft = draft_job(tmp_path / "a.nc", tmp_path)
    assert draft.ask == ("--tool 2=TYPE:DIAMETER",) and not draft.errors


def test_feed_motions_from_a_guessed_home_tell_nothing_of_the_stock(tmp_path):
    (tmp_path / "a.nc").write_text(
        "G21 G17 G90 G54\nT1 M6\nS1 M3\nG1 X5. Y5. F3000\nZ10.\nZ3. F200\nX40.\nM30\n"
    )
    text = draft_job(tmp_path / "a.nc", tmp_path, tools=("1=flat:10",)).text
    assert tomllib.loads(text)["stock"]["box"] == {"min": [-2, -2, 1], "max": [47, 12, 5]}
    assert "length_mm = 50 " in text
