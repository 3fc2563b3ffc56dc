"""What cannot be done is refused before the first block, with the number and a value that can."""

import re

import numpy as np
import pytest
from tinyjob import JOB, write_job

from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.straight import facets
from vmachining.errors import JobError
from vmachining.job import Job, run
from vmachining.job.contact import ToolParts
from vmachining.job.cost import cutter_facets, estimate, refuse_costly, refuse_fine
from vmachining.job.reading import read_job_program
from vmachining.job.stock import raw_stock
from vmachining.job.toolpath import Toolpath
from vmachining.tool import BallNose, BullNose, FlatEnd, Taper

BALL = {'type = "flat"': 'type = "ball"'}
BOX = "{ min = [0, 0, -4], max = [10, 18, 0] }"
POSES = "x_mm,y_mm,z_mm,i,j,k,feed_mm_min\n" + "".join(
    f"{5 + k % 2},9,-1,{0.1 * (k % 3)},0,1,600\n" for k in range(1500)
)


def refusal(folder, **job):
    """The message of the refusal, and the chord it recommends."""
    with pytest.raises(JobError) as caught:
        run(Job.load(write_job(folder, **job)), out=folder / "out", engine="mesh")
    assert not (folder / "out").exists() and caught.value.line is not None
    return str(caught.value), float(re.search(r"take chord_mm = (\S+) or more", str(caught.value))[1])


def accepted(folder, chord, **job):
    """Whether a chord passes both checks; None of it cuts anything."""
    text = job.pop("job", JOB).replace("chord_mm = 0.05", f"chord_mm = {chord}")
    loaded = Job.load(write_job(folder, job=text, **job))
    tools = {number: ToolParts.of(tool) for number, tool in loaded.tools.items()}
    refuse_fine(loaded, tools, chord)
    refuse_costly(
        loaded,
        Toolpath.of(read_job_program(loaded), loaded.machine),
        tools,
        raw_stock(loaded).bounds,
        chord,
    )


@pytest.mark.parametrize("chord", ["1e-9", "1e-12", "1e-300"])
def test_a_chord_far_too_fine_is_refused_with_one_that_is_not(chord, tmp_path):
    text, feasible = refusal(tmp_path, swap={"chord_mm = 0.05": f"chord_mm = {chord}"})
    assert "facets" in text and "the stock reaches 18 mm" in text
    accepted(tmp_path / "b", feasible)
    assert feasible < 1e-7  # and not merely something coarse


def test_a_ball_of_a_micrometre_chord_is_refused(tmp_path):
    """Its facets grow as 1 / chord: 4 mm need some 15 million of them."""
    text, feasible = refusal(tmp_path, swap={"chord_mm = 0.05": "chord_mm = 1e-6", **BALL})
    assert int(re.search(r"would have ([\d,]+) facets", text)[1].replace(",", "")) > 5e6
    accepted(tmp_path / "b", feasible, swap=BALL)


def test_a_stock_whose_coordinates_have_no_digits_left_is_refused(tmp_path):
    """1e9 mm at a chord of 0.001: brackets there were seen to miss a slot's closed form."""
    far = {BOX: "{ min = [-1e9, -1e9, -1e9], max = [1e9, 1e9, 0] }"}
    text, feasible = refusal(tmp_path, swap={**far, "chord_mm = 0.05": "chord_mm = 0.001"})
    assert "reaches 1e+09 mm" in text and feasible == 1.0
    with pytest.raises(JobError, match="within 1e"):  # of any job
        Job.load(write_job(tmp_path / "b", swap={BOX: "{ min = [0, 0, -4], max = [5e12, 18, 0] }"}))


def test_a_round_bar_of_too_many_facets_is_refused_before_it_is_made(tmp_path):
    bar = {
        "box = " + BOX: "cylinder = { center = [5, 9], radius = 900, z = [-4, 0] }",
        "chord_mm = 0.05": "chord_mm = 1e-6",
    }
    text, _ = refusal(tmp_path, swap=bar)
    assert "the round stock would have" in text


def test_a_program_of_years_is_refused(tmp_path):
    poses = {'file = "tiny.nc"': 'file = "tiny.nc"\ndialect = "poses"', "chord_mm = 0.05": "chord_mm = 1e-5"}
    text, feasible = refusal(tmp_path, program=POSES, swap=poses)
    assert re.search(r"would take about \d+ days", text) and feasible > 1e-5


def test_the_cost_of_a_small_job_is_small(tmp_path):
    job = Job.load(write_job(tmp_path))
    cost = estimate(Toolpath.of(read_job_program(job)), {1: ToolParts.of(job.tools[1])}, 0.05)
    assert 0.0 < cost.longest_s < 1.0 and cost.seconds < 5.0


@pytest.mark.parametrize("chord", [0.1, 0.01])
@pytest.mark.parametrize(
    "tool",
    [
        FlatEnd(diameter=10, length=30), BallNose(diameter=10, length=30),
        BullNose(diameter=20, corner_radius=3, length=30), Taper(diameter=6, taper_deg=10, corner_radius=1, length=30),
    ],
    ids=["flat", "ball", "bull", "taper"],
)  # fmt: skip
def test_facets_are_counted_as_they_are_made(tool, chord):
    made = sum(len(part.body.triangles) for part in facets(tool.cutter, chord, Side.INNER).parts)
    assert 0.5 < cutter_facets(tool.cutter, chord) / made < 2.5
    assert np.isfinite(made)
