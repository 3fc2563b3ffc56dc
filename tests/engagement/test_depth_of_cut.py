"""ap and ae as a machinist means them: of what the edge enters, not of finished walls that it slides along."""

from __future__ import annotations

import numpy as np
import pytest
from tinyjob import JOB

import vmachining as vm
from vmachining.job import Scene
from vmachining.job.engagement_columns import engagement_pass
from vmachining.job.reading import read_job_program
from vmachining.job.toolpath import Toolpath

HEAD = "G21 G17 G90 G94\nT1 M6\nS3000 M3\n"
TOOL = 'type = "flat"\ndiameter_mm = 12\nlength_mm = 40\nflutes = 2\nhelix_deg = 30'
LEVELS = HEAD + (
    "G0 X-10 Y0 Z-1\nG1 X40 F600\nG0 Z5\nG0 X-10\nG0 Z-2\nG1 X40 F600\nG0 Z5\nG0 X-10\nG0 Z-3\nG1 X40 F600\nM30\n"
)
"""A slot in three levels of 1 mm, which enters from outside."""

THERE_AND_BACK = HEAD + "G0 X-10 Y0 Z5\nG1 Z-1 F600\nX40\nZ-2\nX-10\nZ-3\nX40\nM30\n"
TURNS = HEAD + "G0 X10 Y0 Z0\n" + "G3 X10 Y0 Z{} I-10 J0 F600\n" * 3 + "M30\n"


def load(folder, text, tool=TOOL):
    (folder / "tiny.nc").write_text(text)
    body = JOB.replace('type = "flat"\ndiameter_mm = 4\nlength_mm = 20', tool)
    body = body.replace("min = [0, 0, -4], max = [10, 18, 0]", "min = [-30, -30, -20], max = [30, 30, 0]")
    (folder / "job.toml").write_text(body)
    return vm.Job.load(folder / "job.toml")


def columns(job):
    return engagement_pass(job, Toolpath.of(read_job_program(job), job.machine)).columns


@pytest.mark.parametrize("text", [LEVELS, THERE_AND_BACK])
def test_levels_of_a_slot_are_as_deep_as_each_takes(tmp_path, text):
    """Every level removes 720 mm^3 in 60 mm: 12 wide and 1 deep; it reported 1, 2 and 3 mm."""
    job = load(tmp_path, text)
    found = columns(job)
    program = job.folder.joinpath("tiny.nc").read_text().splitlines()
    blocks = Toolpath.of(read_job_program(job), job.machine).blocks
    slots = [b.number for b in blocks if "X" in program[b.line - 1] and b.motion == "linear"]
    assert len(slots) == 3
    for number in slots:
        assert found["ap_mm"][number] == pytest.approx(1.0, abs=1e-6)
        assert found["ae_mm"][number] == pytest.approx(12.0, abs=1e-4)


@pytest.mark.parametrize("method", ["dexel", "analytic"])
@pytest.mark.parametrize("edge", ["straight", "helix"])
@pytest.mark.parametrize("bottom", [False, True])
def test_every_method_of_engage_knows_levels(tmp_path, method, edge, bottom):
    if method == "analytic" and edge == "helix":
        pytest.skip("method analytic works with the straight edge only")
    scene = Scene.of(load(tmp_path, LEVELS))
    cuts = sorted({cut[0] for cut in scene.cuts})
    for number in cuts:
        found = vm.engage(scene, number, at=0.5, method=method, edge=edge, bottom=bottom, angles=180)
        # a wound edge has its highest engaged point between two of 180 angles: 12 pi / 180 / tan(30) mm
        assert found.ap == pytest.approx(1.0, abs=1e-6 if edge == "straight" else 1e-3)
        assert found.ae == pytest.approx(12.0, abs=1e-3)


@pytest.mark.slow  # OCCT starts in a separate process, 18 s
def test_solids_know_levels(tmp_path):
    scene = Scene.of(load(tmp_path, LEVELS))
    last = max(cut[0] for cut in scene.cuts)
    found = vm.engage(scene, last, at=0.5, method="brep", angles=36)
    assert (found.ap, found.ae) == pytest.approx((1.0, 12.0), abs=1e-3)


def test_turns_of_a_helix_are_as_deep_as_each_takes(tmp_path):
    """Pitch 2: after the first turn the tool never cuts more than 2 mm below the turn before; it reported 4 and 6 mm."""
    job = load(tmp_path, TURNS.format(-2, -4, -6))
    found = columns(job).drop_nulls("ap_mm")["ap_mm"].to_numpy()
    np.testing.assert_allclose(
        found, 2.0, atol=0.02
    )  # the turn before is 2 mm higher exactly across the feed only
    scene = Scene.of(job)
    second = sorted({cut[0] for cut in scene.cuts})[1]
    assert vm.engage(scene, second, at=0.5, angles=72).ap == pytest.approx(2.0, abs=0.03)
