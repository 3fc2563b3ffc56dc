"""Tables of engagement: what only one of two calls engaged, by arithmetic; packs that carry one."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from slowness import slowness
from tinyjob import write_job

import vmachining as vm
from tests.models.shipped import MODELS
from vmachining.cli.main import run
from vmachining.errors import InputError

PACK = MODELS / "reference_pack" / "slot"
SLOT = 2


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A directory of `vmachining engage --out` with the slot of the tiny job: 1 mm deep over half a turn."""
    home = tmp_path_factory.mktemp("engage")
    job = write_job(home)
    out = home / "out"
    assert run(["engage", str(job), "--block", str(SLOT), "--angles", "36", "--out", str(out)]) == 0
    return out


def slot(depth=1.0, *, angles=36, **more):
    """The slot as somebody else may hand it in: engaged from 0 to 180 degrees, closed at neither end."""
    phi = [360.0 * k / angles for k in range(angles)]
    turn = [p for p in phi if 0 < p < 180]
    return {
        "block": [SLOT] * len(turn), "phi_deg": turn, "lower_mm": [0.0] * len(turn),
        "upper_mm": [depth] * len(turn), **more,
    }  # fmt: skip


def test_the_closed_form_agrees(folder):
    found = vm.compare_engagement(slot(), folder)
    assert found.agrees and found.worst_mm < 1e-6
    # block, no angle of theirs at and beyond 180 degrees: nothing is engaged there
    assert found.counts == {"inside": 17, "outside": 0, "missing": 0, "idle": 19}
    assert found.verdict.startswith("agrees: all 17 angles within 0.0001 mm")


@pytest.mark.parametrize(("depth", "error"), [(1.01, 0.01), (0.8, 0.2)])
def test_the_error_is_what_only_one_calls_engaged(folder, depth, error):
    found = vm.compare_engagement(slot(depth), folder)
    assert not found.agrees and found.counts["outside"] == 17
    assert found.worst_mm == pytest.approx(error, abs=1e-6)
    assert vm.compare_engagement(slot(depth), folder, tolerance_mm=1.01 * error).agrees


def test_shifted_split_and_missing_intervals(folder):
    shifted = slot()
    shifted["lower_mm"] = [0.05] * 17
    shifted["upper_mm"] = [1.05] * 17
    assert vm.compare_engagement(shifted, folder).worst_mm == pytest.approx(0.1, abs=1e-6)
    split = {name: [v for v in column for _ in range(2)] for name, column in slot().items()}
    split["upper_mm"][0::2] = [0.4] * 17
    split["lower_mm"][1::2] = [0.4] * 17
    assert vm.compare_engagement(split, folder).agrees
    short = {name: column[:-3] for name, column in slot().items()}
    found = vm.compare_engagement(short, folder)
    assert found.counts["missing"] == 3 and not found.agrees
    assert found.worst_mm == pytest.approx(1.0, abs=1e-6)
    assert set(found.worst()["phi_deg"]) == {150.0, 160.0, 170.0}


def test_digits_of_the_angle_and_other_angles_do_not_matter(folder):
    theirs = slot(angles=72)
    theirs["phi_deg"] = [round(p + 1e-7, 7) for p in theirs["phi_deg"]]
    found = vm.compare_engagement(theirs, folder)
    assert found.agrees and found.ignored == 18
    assert not vm.compare_engagement({**slot(), "block": [7] * 17}, folder).agrees  # nothing to compare


def test_an_engagement_is_its_own_reference(folder, tmp_path):
    found = vm.engage(vm.Job.load(write_job(tmp_path)), SLOT, angles=36)
    assert vm.compare_engagement(found, folder).worst_mm == 0.0
    assert vm.compare_engagement(found.table(), found).agrees


BAD = {
    "columns": ({"block": [2], "phi_deg": [10.0], "lower_mm": [0.0]}, "no column upper_mm.*give the columns"),
    "half": (slot() | {"upper_mm": [None] * 17}, "row 1: an angle or one end of an interval is empty"),
    "order": (slot(-1.0), "lower_mm 0 lies above upper_mm -1"),
    "word": (slot() | {"phi_deg": ["ten"] * 17}, "phi_deg 'ten' is not a finite number; write a number"),
    "half a block": (slot() | {"block": [1.7] * 17}, r"row 1: block 1\.7 is not a whole number"),
    "no block": (slot() | {"block": [2, None, *[2] * 15]}, "row 2: block None is not a whole number"),
    "short": (slot() | {"upper_mm": [1.0] * 16}, "table: 17 values of block, 16 of upper_mm"),
    "few instants": (slot(at=[0.5]), "table: 17 values of block, 1 of at"),
    "no instant": (slot(at=[0.5] * 16 + [None]), "row 17: an instant is empty"),
    "long": (slot(1e308), r"upper_mm 1e\+308 is beyond 1e\+30"),
    "nothing": ({name: [] for name in slot()}, "a header and no results; one row per interval"),
}


@pytest.mark.parametrize("case", BAD)
def test_tables_that_cannot_be_read(folder, case):
    table, words = BAD[case]
    with pytest.raises(InputError, match=words):
        vm.compare_engagement(table, folder)


def test_a_parquet_table_that_lacks_a_column_is_named(tmp_path):
    """The message said "table" for a file."""
    pl.DataFrame(slot()).drop("upper_mm").write_parquet(tmp_path / "engagement.parquet")
    with pytest.raises(InputError, match=r"engagement\.parquet: no column upper_mm"):
        vm.compare_engagement(slot(), tmp_path)


HEADER = "# made by hand\n\nblock,phi_deg,lower_mm,upper_mm"
BAD_FILES = {
    "word": (
        f"{HEADER}\n2,10,0,1\n2,x,0,1\n",
        ["t.csv:5: phi_deg 'x'", "write a number with a decimal point"],
    ),
    "half a block": (
        f"{HEADER}\n1.7,10,0,1\n",
        ["t.csv:4: block '1.7' is not a whole number", "remove rows"],
    ),
    "large block": (f"{HEADER}\n1e30,10,0,1\n", ["t.csv:4: block '1e30' is too large"]),
    "order": (f"{HEADER}\n2,10,1,0\n", ["t.csv:4: lower_mm 1 lies above upper_mm 0", "lowest point"]),
    "half": (f"{HEADER}\n2,10,,1\n", ["t.csv:4: an angle or one end of an interval is empty"]),
    "column twice": (f"{HEADER},upper_mm\n2,10,0,1,1\n", ["t.csv:3: column upper_mm twice"]),
    "decimal comma": (f"{HEADER}\n2,10,0,1,5\n", ["t.csv:4: 5 cells", "a decimal comma needs ;"]),
    "header only": (f"{HEADER}\n", ["t.csv: a header and no results"]),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_files_that_cannot_be_read_are_told_with_their_place(case, folder, tmp_path, capsys):
    text, words = BAD_FILES[case]
    (tmp_path / "t.csv").write_text(text)
    assert run(["compare", str(tmp_path / "t.csv"), str(folder)]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    for word in words:
        assert word in told


def test_columns_that_are_not_needed_may_come_twice(folder, tmp_path):
    lines = [f"{SLOT},{p},0,1,stock,stock" for p in slot()["phi_deg"]]
    (tmp_path / "t.csv").write_text("\n".join(["block,phi_deg,lower_mm,upper_mm,by,by", *lines]))
    assert vm.compare_engagement(tmp_path / "t.csv", folder).agrees


def test_angles_near_a_whole_turn_are_those_near_zero():
    ours = pl.DataFrame({"block": [1], "at": [0.5], "phi_deg": [0.0], "lower_mm": [0.0], "upper_mm": [1.0]})
    for phi, agrees in ((360.0 - 5e-7, True), (-1e-20, True), (5e-7, True), (2e-6, False), (-2e-6, False)):
        assert vm.compare_engagement(ours.with_columns(phi_deg=pl.lit(phi)), ours).agrees == agrees


def test_many_angles_with_fewer_digits_take_no_quadratic_time():
    """A look at every angle for each of these takes more than a minute."""
    n = 60_000
    phi = np.linspace(0.0, 360.0, n, endpoint=False)
    ours = pl.DataFrame({"block": 1, "at": 0.5, "phi_deg": phi, "lower_mm": 0.0, "upper_mm": 1.0})
    begin = time.process_time()
    found = vm.compare_engagement(ours.with_columns(phi_deg=(phi + 3e-7) % 360.0), ours)
    assert found.agrees and found.counts["inside"] == n
    assert time.process_time() - begin < 20.0 * slowness()


def test_references_that_cannot_be_used(folder, tmp_path):
    with pytest.raises(InputError, match="no such directory; give the directory that vmachining engage"):
        vm.compare_engagement(slot(), tmp_path / "none")
    with pytest.raises(InputError, match="no table of engagement in it"):
        vm.compare_engagement(slot(), tmp_path)
    with pytest.raises(InputError, match="expected a number from 0"):
        vm.compare_engagement(slot(), folder, tolerance_mm=-1.0)
    (tmp_path / "manifest.json").write_text('{"files": {}}')
    (tmp_path / "engagement.csv").write_bytes((folder / "engagement.csv").read_bytes())
    with pytest.raises(InputError, match="differs from the file that the pack was made with"):
        vm.compare_engagement(slot(), tmp_path)
    (tmp_path / "manifest.json").unlink()
    assert vm.compare_engagement(slot(), tmp_path).agrees  # the CSV alone will do
    both = pl.concat([pl.read_csv(folder / "engagement.csv"), pl.read_csv(folder / "engagement.csv")])
    both = both.with_columns(at=pl.Series(np.repeat([0.25, 0.5], len(both) // 2)))
    with pytest.raises(InputError, match=f"several instants of block {SLOT}"):
        vm.compare_engagement(slot(), both)
    assert vm.compare_engagement(slot(at=[0.25] * 17), both).counts["missing"] == 17


def test_the_command_knows_the_table_by_its_columns(folder, tmp_path, capsys):
    path = tmp_path / "theirs.csv"
    pl.DataFrame(slot()).write_csv(path, separator=";")
    assert run(["compare", str(path), str(folder)]) == 0
    assert "verdict    agrees: all 17 angles" in capsys.readouterr().out
    pl.DataFrame(slot(0.9)).write_csv(path)
    assert run(["compare", str(path), str(folder), "--json"]) == 1
    record = json.loads(capsys.readouterr().out)
    assert record["outside"] == 17 and record["worst_mm"] == pytest.approx(0.1, abs=1e-6)
    assert run(["compare", str(path), str(folder)]) == 1
    assert "17 outside" in capsys.readouterr().out
    assert run(["compare", str(path), str(folder), "--tolerance-mm", "0.2"]) == 0
    assert run(["compare", str(path), str(folder), "--tolerance-mm3", "0.2"]) == 2
    assert "--tolerance-mm" in capsys.readouterr().err
    assert run(["compare", str(PACK / "blocks.csv"), str(PACK), "--tolerance-mm", "0.2"]) == 2


def test_packs_carry_engagement(tmp_path: Path) -> None:
    job = write_job(tmp_path / "in")
    vm.write_pack(job, tmp_path / "pack", engagement=2)
    table = pl.read_parquet(tmp_path / "pack" / "engagement.parquet")
    assert table["block"].unique().sort().to_list() == [2, 7]  # first and last block that remove something
    assert table["phi_deg"][0] == 5.0 and len(table["phi_deg"].unique()) == 36
    assert pl.read_csv(tmp_path / "pack" / "engagement.csv")["length_mm"].sum() == table["length_mm"].sum()
    assert "Columns of `engagement`" in (tmp_path / "pack" / "README.md").read_text()
    phi = [5.0 + 10.0 * k for k in range(18)]
    theirs = {"block": [2] * 18, "phi_deg": phi, "lower_mm": [0.0] * 18, "upper_mm": [1.0] * 18}
    other = table.filter(pl.col("block") == 7).select("block", "phi_deg", "lower_mm", "upper_mm")
    both = pl.concat([pl.DataFrame(theirs, schema=other.schema), other])
    assert vm.compare_engagement(both, tmp_path / "pack").agrees
    vm.write_pack(job, tmp_path / "none", engagement=0)
    assert not (tmp_path / "none" / "engagement.csv").exists()
    assert "Columns of `engagement`" not in (tmp_path / "none" / "README.md").read_text()
    with pytest.raises(InputError, match="expected 0 to"):
        vm.write_pack(job, tmp_path / "bad", engagement=-1)


def test_the_shipped_pack_says_what_a_slot_is() -> None:
    """Flat end mill R5 in a ramping slot: engaged over the front half, from the rim to the top of the stock."""
    table = pl.read_parquet(PACK / "engagement.parquet")
    assert len(table["block"].unique()) == 8
    cut = table.drop_nulls("lower_mm").filter(pl.col("lower_by") == "edge", pl.col("upper_by") == "stock")
    assert len(cut) > 100
    assert np.allclose(cut["ue_z_mm"], 0.0, atol=1e-6)
    assert np.allclose(cut["length_mm"], -cut["le_z_mm"], atol=1e-6)
    assert ((cut["phi_feed_deg"] > 0) & (cut["phi_feed_deg"] < 180)).all()
    found = vm.compare_engagement(PACK / "engagement.csv", PACK)
    assert found.agrees and found.worst_mm <= 1e-9  # a CSV table has twelve digits
