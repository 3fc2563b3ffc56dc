"""Code on the pages runs as it stands, in a clone."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from vmachining.cli.app import command

ROOT = Path(__file__).parents[2]
TASKS = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A folder where the page's relative names lead into the clone, and its results into a scratch directory."""
    (tmp_path / "models").symlink_to(ROOT / "models")
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_python_of_the_tasks(clone, capsys):
    names: dict = {}
    for code in re.findall(r"```python\n(.*?)```", TASKS, re.DOTALL):
        exec(compile(code, "docs/tasks.md", "exec"), names)
    assert len(names["volumes"]) == len(names["bounds"]) == len(names["proven"])
    assert ((names["bounds"][:, 0] <= names["volumes"]) & (names["volumes"] <= names["bounds"][:, 1])).all()
    assert names["depths"]["ap_mm"].max() > 0 and (clone / "out/part.stl").stat().st_size > 1000
    # a bull nose along the middle of 100 mm, 3 mm deep: 10 wide, and two sectors of a circle of 5 beside it
    assert f"{names['removed'].estimate:.4g} mm3" == f"{100 * (10 * 3 + 2 * _corner(5.0, 3.0)):.4g} mm3"
    assert (clone / "out/slot-scheduled/blocks.parquet").is_file()


def test_the_first_hour(clone, capsys):
    """A slot of the width of the tool 4 mm deep, widened by 6 mm: ap and ae of both, and one removal rate for both after
    scheduling: 600 mm/min at 10 mm of width or 1000 at 6."""
    page = (ROOT / "docs" / "first_hour.md").read_text(encoding="utf-8")
    names: dict = {}
    for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(compile(code, "docs/first_hour.md", "exec"), names)
    for line, width in ((6, 10.0), (10, 6.0)):
        (k,) = (names["lines"] == line).nonzero()[0]
        assert names["ap"][k] == pytest.approx(4.0, abs=1e-6) and names["ae"][k] == pytest.approx(
            width, abs=1e-3
        )
        assert names["lo"][k] - 1e-6 <= 4 * width * 100 <= names["hi"][k] + 1e-6
    feeds = names["scheduled"].blocks.filter(names["scheduled"].blocks["line"] == 10)["scheduled_feed_mm_min"]
    assert feeds[0] == pytest.approx(1000.0, rel=0.02)
    assert Path("engagement.pdf").stat().st_size > 1000 and Path("contact.png").stat().st_size > 1000
    assert names["here"].ap == pytest.approx(4.0, abs=1e-6)


def _corner(r: float, depth: float) -> float:
    """Area between the floor and a height, of a quarter circle that rises from the floor: integral of sqrt(r^2 - (r - z)^2)."""
    from math import acos, sqrt

    left = r - depth
    return (r * r * acos(left / r) - left * sqrt(r * r - left * left)) / 2


def test_options_of_the_tasks_exist():
    """Every command of the page is one, with options that it has."""
    root = command()
    spoken = re.findall(r"(?:^|`)vmachining ([^\n`]*)", TASKS, re.MULTILINE)
    assert len(spoken) > 8
    for words in map(shlex.split, spoken):
        found = root.commands[words[0]]
        known = {option for item in found.params for option in item.opts}
        assert {word for word in words if word.startswith("--")} <= known, words
