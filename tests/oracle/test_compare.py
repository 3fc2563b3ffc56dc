"""Comparison with the shipped pack: the slot's closed forms are inside, spoilt ones are found."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import polars as pl
import pytest

import vmachining as vm
from tests.models.shipped import MODELS, generator
from vmachining.cli.main import run
from vmachining.errors import InputError

PACK = MODELS / "reference_pack" / "slot"


def exact() -> dict[int, float]:
    """{line: mm^3} of every feed block, from the generator's closed forms."""
    table = pl.read_csv(PACK / "blocks.csv").filter(pl.col("motion") != "rapid")
    return dict(zip(table["line"], (block.volume for block in generator("slot").path()), strict=True))


def write(path: Path, rows, header=("line", "removed_mm3"), delimiter=",") -> Path:
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, delimiter=delimiter).writerows([header, *rows])
    return path


def test_closed_forms_are_inside_every_bracket() -> None:
    values = exact()
    found = vm.compare({"line": list(values), "removed_mm3": list(values.values())}, PACK)
    assert found.agrees and found.total_inside
    assert found.counts["inside"] == len(values) == 109
    assert found.counts["idle"] == 4  # the rapids, left out
    assert found.removed_mm3 == pytest.approx(5256.167996, abs=1e-6)  # models/slot/README.md
    assert found.verdict == "agrees: all 109 lines are inside"
    row = found.blocks.row(by_predicate=pl.col("line") == 28, named=True)  # block 19: the steepest descent
    assert row["removed_mm3"] == pytest.approx(107.415927, abs=1e-6)
    assert row["error_mm3"] == row["removed_mm3"] - row["reference_mm3"]
    assert row["relative_error"] == row["error_mm3"] / row["reference_mm3"]


def test_by_block_and_by_line_and_from_a_result_agree(tmp_path: Path) -> None:
    table = pl.read_csv(PACK / "blocks.csv")
    by_block = vm.compare(table, PACK)
    by_line = vm.compare(table.select("line", "removed_mm3"), PACK)
    assert by_block.key == "block" and by_line.key == "line"
    assert by_block.agrees and by_line.agrees
    assert by_block.counts["inside"] == by_line.counts["inside"] == 113
    assert by_block.blocks["error_mm3"].abs().max() <= 1e-9  # a CSV table has twelve digits


def test_results_are_read_as_a_run_leaves_them(tmp_path: Path) -> None:
    """Of more than 100,000 blocks there is no CSV file."""
    pl.read_csv(PACK / "blocks.csv").write_parquet(tmp_path / "blocks.parquet")
    assert vm.compare(tmp_path, PACK).agrees and vm.compare(tmp_path / "blocks.parquet", PACK).agrees
    assert run(["compare", str(tmp_path), str(PACK)]) == 0
    for folder in (tmp_path / "flat", tmp_path / "runs" / "slot"):
        folder.mkdir(parents=True)
    (tmp_path / "blocks.parquet").rename(tmp_path / "runs" / "slot" / "blocks.parquet")
    (tmp_path / "flat" / "slot.parquet").write_bytes(
        (tmp_path / "runs" / "slot" / "blocks.parquet").read_bytes()
    )
    for results in (tmp_path / "flat", tmp_path / "runs"):
        assert list(vm.oracle.compare_set(results, PACK.parent).cases) == ["slot"]
    (tmp_path / "broken.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match=r"broken\.parquet: cannot read the table"):
        vm.compare(tmp_path / "broken.parquet", PACK)


def test_rows_of_a_line_are_summed(tmp_path: Path) -> None:
    rows = [(line, share * volume) for line, volume in exact().items() for share in (0.25, 0.75)]
    for delimiter in ",;\t":
        file = write(tmp_path / "r.csv", rows, delimiter=delimiter)
        found = vm.compare(file, PACK)
        assert found.agrees and found.removed_mm3 == pytest.approx(5256.167996, abs=1e-6)


def test_wrong_missing_and_extra_blocks_are_told_apart() -> None:
    values = exact()
    lo, hi = (
        pl.read_csv(PACK / "blocks.csv").row(by_predicate=pl.col("line") == 20, named=True)[name]
        for name in ("removed_lo_mm3", "removed_hi_mm3")
    )
    values[20], values[21] = hi + 0.5, -1.0
    del values[25]
    values |= {900: 3.0, 901: 0.0}
    found = vm.compare({"line": list(values), "removed_mm3": list(values.values())}, PACK)
    status = dict(zip(found.blocks["line"], found.blocks["status"], strict=True))
    assert [status[line] for line in (20, 21, 25, 900, 901)] == ["high", "low", "missing", "extra", "idle"]
    assert not found.agrees and found.total_inside is None
    assert found.worst()["line"].to_list() == [21, 900, 20, 25]
    assert found.worst()["outside_mm3"].to_list()[2] == pytest.approx(0.5, abs=1e-9)
    assert "105 are inside" not in found.verdict and "of 109 lines 106 are inside, 2 outside" in found.verdict
    assert "1 missing" in found.verdict and lo < hi


def test_a_tolerance_widens_and_is_stated() -> None:
    values = {line: 1.02 * volume for line, volume in exact().items()}
    table = {"line": list(values), "removed_mm3": list(values.values())}
    bare = vm.compare(table, PACK)
    assert not bare.agrees and bare.total_inside is False
    relative = vm.compare(
        table, PACK, tolerance_rel=0.02 * 1.05
    )  # the estimate is within 5 % of the exact one
    assert relative.agrees and "widened by 0.021 of the volume" in relative.verdict
    # the farthest distance outside is the tolerance that is needed, to rounding
    assert vm.compare(table, PACK, tolerance_mm3=bare.outside_mm3 + 1e-9).agrees
    assert not vm.compare(table, PACK, tolerance_mm3=bare.outside_mm3 - 1e-9).agrees


def test_exit_codes_and_pure_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    values = exact()
    good = write(tmp_path / "good.csv", values.items())
    assert run(["compare", str(good), str(PACK)]) == 0
    assert "agrees: all 109 lines are inside" in capsys.readouterr().out
    bad = write(tmp_path / "bad.csv", {**values, 20: 0.0}.items())
    assert run(["compare", str(bad), str(PACK)]) == 1
    shown = capsys.readouterr().out
    assert "worst 1 of 1" in shown and "disagrees" in shown and "low" in shown
    assert run(["compare", str(bad), str(PACK), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["low"] == 1 and told["worst"][0]["line"] == 20 and len(told["blocks"]) == 113
    assert run(["compare", str(bad), str(PACK), "--tolerance-mm3", "41"]) == 0  # line 20 removes 40
    assert "widened by 41 mm3" in capsys.readouterr().out


def test_all_at_their_bounds_agree_but_their_sum_gives_them_away() -> None:
    table = pl.read_parquet(PACK / "blocks.parquet")
    found = vm.compare(table.select("block", pl.col("removed_hi_mm3").alias("removed_mm3")), PACK)
    assert found.agrees  # a bound belongs to its bracket
    summed = math.fsum(table["removed_hi_mm3"])
    narrow = json.loads((PACK / "summary.json").read_text())["removed_hi_mm3"]
    assert found.total_inside == (summed <= narrow)
    assert ("their sum is not" in found.verdict) == (summed > narrow)


@pytest.mark.parametrize("command", ["compare", "pack"])
def test_help_has_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([command, "--help"]) == 0
    assert f"\n    vmachining {command} " in capsys.readouterr().out


BAD = {
    "no volume": ("line,volume\n9,1\n", ["r.csv:1", "no column removed_mm3", "line, volume"]),
    "no key": ("n,removed_mm3\n9,1\n", ["r.csv:1", "no column block or line"]),
    "not a number": ("line,removed_mm3\n9,1\n\n10,abc\n", ["r.csv:4", "'abc'", "line 10", "decimal point"]),
    "nan": ("line,removed_mm3\n9,nan\n", ["r.csv:2", "not a finite number"]),
    "empty cell": ("line,removed_mm3\n9,\n", ["r.csv:2", "0 for a block that removes nothing"]),
    "half a line": ("line,removed_mm3\n9.5,1\n", ["r.csv:2", "'9.5' is not a whole number"]),
    "twice": ("block,removed_mm3\n3,1\n3,1\n", ["r.csv:3", "block 3 comes twice", "by line"]),
    "decimal comma": ("line,removed_mm3\n9,1,5\n", ["r.csv:2", "3 cells", "decimal comma"]),
    "empty": ("", ["r.csv:1", "no table"]),
    "header only": ("line,removed_mm3\n", ["no results"]),
    "large block": ("block,removed_mm3\n1e30,1\n", ["r.csv:2", "block '1e30' is too large"]),
    "large line": (f"line,removed_mm3\n-{'9' * 20},1\n", ["r.csv:2", "is too large for a number of a line"]),
    "large volumes": (
        "line,removed_mm3\n1,1e308\n2,1e308\n",
        ["r.csv:2", "'1e308' of line 1 is beyond 1e+30"],
    ),
    "large volumes of a line": (
        "line,removed_mm3\n1,1\n1,-1e308\n1,-1e308\n",
        ["r.csv:3", "beyond 1e+30 mm3"],
    ),
    "column twice": ("line,line,removed_mm3\n1,1,1\n", ["r.csv:1", "line twice"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_results_are_refused_with_their_place(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, words = BAD[case]
    (tmp_path / "r.csv").write_text(text, encoding="utf-8")
    assert run(["compare", str(tmp_path / "r.csv"), str(PACK)]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    for word in words:
        assert word in told


def test_bad_tables_of_python_are_refused() -> None:
    with pytest.raises(InputError, match=r"row 1: line 1000.* is not a whole number"):
        vm.compare({"line": [10**400], "removed_mm3": [1.0]}, PACK)  # no float holds it
    with pytest.raises(InputError, match="table: 2 values of line, 1 of removed_mm3"):
        vm.compare({"line": [9, 10], "removed_mm3": [1.0]}, PACK)


def test_bad_references_are_refused(tmp_path: Path) -> None:
    table = {"line": [9], "removed_mm3": [0.0]}
    with pytest.raises(InputError, match=r"no such directory.*vmachining run or vmachining pack"):
        vm.compare(table, tmp_path / "none")
    with pytest.raises(InputError, match=r"no manifest\.json"):
        vm.compare(table, tmp_path)
    (tmp_path / "manifest.json").write_text('{"complete": false}')
    with pytest.raises(InputError, match=r"not complete.*--resume"):
        vm.compare(table, tmp_path)
    for name in ("manifest.json", "blocks.csv", "summary.json"):
        (tmp_path / name).write_bytes((PACK / name).read_bytes())
    assert vm.compare(table, tmp_path).counts["missing"] == 108  # the CSV table alone will do
    (tmp_path / "blocks.csv").write_text((PACK / "blocks.csv").read_text().replace("0.0", "0.1"))
    with pytest.raises(InputError, match=r"blocks\.csv: differs from the file"):
        vm.compare(table, tmp_path)
    (tmp_path / "manifest.json").write_text('{"complete": true}')
    (tmp_path / "blocks.csv").write_bytes((PACK / "blocks.csv").read_bytes())
    good = json.loads((PACK / "summary.json").read_text())
    for bad, what in (
        ([], "removed_lo_mm3"),
        ({**good, "removed_mm3": None}, "removed_mm3"),
        ({**good, "removed_hi_mm3": "many"}, "removed_hi_mm3"),
        ({**good, "removed_hi_mm3": 10**400}, "removed_hi_mm3"),
        ({**good, "stock_slack_mm3": {}}, "stock_slack_mm3"),
    ):
        (tmp_path / "summary.json").write_text(json.dumps(bad))
        with pytest.raises(InputError, match=f"the summary has no number {what}; give the directory"):
            vm.compare(table, tmp_path)
    with pytest.raises(InputError, match="tolerance_rel -1"):
        vm.compare(table, PACK, tolerance_rel=-1.0)
    with pytest.raises(InputError, match=r"tolerance_mm3 1e\+308: expected a number from 0 to 1e\+30"):
        vm.compare(table, PACK, tolerance_mm3=1e308)
    with pytest.raises(InputError, match="tolerance_mm3 nan"):
        vm.compare(table, PACK, tolerance_mm3=math.nan)


def test_results_of_another_program_are_refused_by_their_first_other_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A table that has as many blocks and other texts is about other blocks; blanks make no other text."""
    table = pl.read_csv(PACK / "blocks.csv")
    line, text = table.row(7, named=True)["line"], table.row(7, named=True)["text"]
    other = table.with_columns(text=pl.when(pl.col("block") == 7).then(pl.lit("G1 X1")).otherwise("text"))
    other.write_csv(tmp_path / "other.csv")
    assert run(["compare", str(tmp_path / "other.csv"), str(PACK)]) == 2
    said = capsys.readouterr().err
    assert f"other.csv:9: belongs to another program: block 7 is 'G1 X1' here and {text!r}" in said
    with pytest.raises(InputError, match=f"another program: line {line} is"):
        vm.compare(other.drop("block"), PACK)
    assert vm.compare(other.drop("text"), PACK).agrees
    assert vm.compare(table.with_columns(pl.col("text").str.replace_all(" ", "  ")), PACK).agrees
