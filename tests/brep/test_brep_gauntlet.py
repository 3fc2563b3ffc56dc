"""The gauntlet of single sweeps: passes on cheap seeds, keeps a journal, continues from it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.gauntlet import FAMILIES, sweep_gauntlet
from benchmarks.hard import HARD
from vmachining.cli.main import main


def test_a_run_goes_on_from_its_journal(tmp_path: Path) -> None:
    journal = tmp_path / "done.jsonl"
    first = list(sweep_gauntlet(2, 9, journal))
    assert [row["seed"] for row in first[:2]] == [9, 10]
    assert first[0]["motion"] == HARD[0]
    assert all(row["brep"] == "solid" and not row["failed"] for row in first[:2])
    rows = journal.read_text().splitlines()
    changed = json.dumps(json.loads(rows[0]) | {"reason": "kept"})
    journal.write_text(changed + "\n" + rows[1][:20])  # the second line was cut
    second = list(sweep_gauntlet(2, 9, journal))
    assert second[0]["reason"] == "kept" and second[1]["exact_mm3"] == first[1]["exact_mm3"]
    assert len(journal.read_text().splitlines()) == 2
    table = {row["family"]: row for row in second[2:-1]}
    assert tuple(table) == FAMILIES
    assert table["hard"]["passed"] == table["finishing"]["passed"] == 1
    assert second[-1]["blocks"] == second[-1]["passed"] == 2


def test_seeds_and_journal_belong_to_the_gauntlet(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["accuracy", "--seeds", "0:2"], ["sweep-gauntlet", "--seeds", "two"]):
        with pytest.raises(SystemExit) as left:
            main(["bench", *words])
        assert left.value.code == 2
    assert "FIRST:LAST" in capsys.readouterr().err
