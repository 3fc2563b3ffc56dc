"""Programs as CAM posts write them, where the collection is at hand: how many read clean, how many by one finding."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from vmachining.errors import NCError
from vmachining.nc import parse_program

POSTS = Path(__file__).parents[3] / "shared" / "data" / "posts"

LEAST = {
    "apt-cl": (19, 0), "fanuc-like-iso": (38, 23), "fanuc-macro": (5, 7), "grbl-fusion-360-hobby": (15, 2),
    "haas": (4, 1), "heidenhain": (6, 6), "okuma": (0, 1), "sinumerik": (4, 5),
}  # fmt: skip
"""Files read without an error, and files with one finding that names the cause: counts reached, which may only rise."""


@pytest.mark.slow  # reads a hundred programs: 20 s
@pytest.mark.skipif(not POSTS.is_dir(), reason=f"no shared data: {POSTS} is absent")
@pytest.mark.parametrize("family", LEAST)
def test_share_of_posted_programs_that_are_read(family):
    counts: Counter[int] = Counter()
    for file in sorted((POSTS / family).iterdir()):
        try:
            program = parse_program(file.read_bytes(), file.name, dialect="auto", rotary="ABC")
        except NCError:
            counts[1] += 1
            continue
        counts[min(len(program.errors), 2)] += 1
        codes = [finding.code for finding in program.findings if finding.severity == "I"]
        assert len([code for code in codes if code == "I214"]) < 60  # a note for each word, not for each line
    clean, named = LEAST[family]
    assert counts[0] >= clean and counts[0] + counts[1] >= clean + named, counts
