"""Invented cases are the same whatever else is loaded, and a seed repeats them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

TEST = """
from hypothesis import given, settings
from hypothesis import strategies as st
{loaded}
@settings(max_examples=40)
@given(x=st.floats(), n=st.integers(), t=st.text())
def test_it(x, n, t):
    with open({out!r}, "a", encoding="utf-8") as out:
        print(repr((x, n, t)), file=out)
"""


def cases(folder: Path, loaded: str, *options: str) -> str:
    folder.mkdir()
    out, test = folder / "cases", folder / "test_it.py"
    test.write_text(TEST.format(loaded=loaded, out="cases"))
    (folder / "other.py").write_text("A = 1234.5678, 987654321987, 'a literal'\n")
    (folder / "conftest.py").write_text(Path(__file__).with_name("conftest.py").read_text())
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-c", "/dev/null", *options, "test_it.py"],
        cwd=folder, check=True, capture_output=True,
    )  # fmt: skip
    return out.read_text()


@pytest.mark.parametrize("options", [(), ("--hypothesis-seed=7",)], ids=["fixed", "seeded"])
def test_cases_do_not_depend_on_what_is_loaded(options, tmp_path):
    first = cases(tmp_path / "a", "", *options)
    assert first.count("\n") == 40
    assert cases(tmp_path / "b", "import other", *options) == first


def test_fresh_cases_differ(tmp_path):
    assert cases(tmp_path / "a", "", "--fresh") != cases(tmp_path / "b", "", "--fresh")
