"""The site builds without a warning, and its generated pages know every key and column."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from vmachining.job.table import COLUMNS, MEANINGS
from vmachining.tool import table as tools

ROOT = Path(__file__).parents[2]


def test_every_column_has_a_meaning() -> None:
    assert MEANINGS.keys() == COLUMNS.keys()


def test_every_key_of_a_tool_has_a_meaning() -> None:
    assert set(tools.MEANINGS) == {*tools.COMMON, *(key for keys in tools.OWN.values() for key in keys)}


@pytest.mark.slow
def test_the_site_builds(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)],
        cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    for page, words in {
        "reference/job_file": ("chord_mm", "flute_length_mm"),
        "reference/tables": ("removed_lo_mm3",),
        "reference/command_line": ("--resume",),
        "reference/findings": ("E101",),
    }.items():
        text = (tmp_path / page / "index.html").read_text(encoding="utf-8")
        assert all(word in text for word in words), page
