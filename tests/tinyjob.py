"""The smallest job worth running, and ways to spoil it. Used by the tests of job, cli and report."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

PROGRAM = """\
%
N10 G21 G17 G90 G94
N20 T1 M6
N30 S8000 M3
N40 G0 X-4 Y4 Z5
N50 G0 Z-1
N60 G1 X14 F600
N70 G0 Z5
N80 G0 X3 Y12
N90 G1 Z-0.5 F300
N100 G2 X7 Y12 I2 J0
N110 G1 Y9 F500
N120 G0 Z5
N130 M30
%
"""
"""Line 7 cuts a slot through the whole stock: 4 x 1 x 10 mm, exactly 40 mm^3."""

JOB = """\
name = "tiny"
units = "mm"

[program]
file = "tiny.nc"
home = [0, 0, 20]

[machine]
rapid_mm_min = 6000
max_feed_mm_min = 4000

[[tools]]
number = 1
type = "flat"
diameter_mm = 4
length_mm = 20

[stock]
box = { min = [0, 0, -4], max = [10, 18, 0] }

[accuracy]
chord_mm = 0.05
"""

FEED = """
[feed]
strategy = "volume"
min_mm_min = 60
max_mm_min = 3000
"""

SLOT_MM3 = 40.0


def write_job(
    folder: Path,
    *,
    job: str = JOB,
    program: str = PROGRAM,
    swap: Mapping[str, str] | None = None,
    name: str = "job.toml",
) -> Path:
    """Write program and job file; `swap` replaces pieces of the job file, each of which must be there."""
    for old, new in (swap or {}).items():
        assert old in job, old
        job = job.replace(old, new)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "tiny.nc").write_text(program, encoding="utf-8")
    path = folder / name
    path.write_text(job, encoding="utf-8")
    return path
