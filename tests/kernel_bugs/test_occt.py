"""Faults of OCCT that cost us something, each strict: the day one is gone, its test fails and we hear of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from vmachining import BullNose, Job, Sweep
from vmachining.engines.brep import BlockChecker, Status, Verdict, solids
from vmachining.engines.judges import Judge
from vmachining.engines.protocol import Removal
from vmachining.geometry import Line
from vmachining.job.brep import RayWitness, blank
from vmachining.job.contact import ToolParts
from vmachining.job.reading import read_job_program
from vmachining.job.stock import raw_stock
from vmachining.job.toolpath import Toolpath

MOULD = Path(__file__).parents[2] / "models" / "mould" / "job.toml"
OFF = "a plain cut of tangent spheres and cylinders is valid and 0.15 % too small (242) or 0.2 % too large (337)"


@pytest.fixture(scope="module", params=[242, 337])
def finishing(request: pytest.FixtureRequest) -> tuple[Verdict, Verdict]:
    """A block of 1 mm of a ball in models/mould: by a plain cut alone, in no bracket; and by the gate."""
    job, block = Job.load(MOULD), request.param
    tools = {number: ToolParts.of(tool) for number, tool in job.tools.items()}
    sweeps = Toolpath.of(read_job_program(job), job.machine).sweeps_until(block, tools)
    work = BlockChecker(blank(job), sweeps)
    rays = RayWitness(raw_stock(job), sweeps)(block, again=True)
    anything = [Judge("nobody", Removal(0.0, 1.0, 1e9))]
    return work.check(block, anything, ["plain"]), work.check(block, [rays])


@pytest.mark.xfail(strict=True, reason=OFF)
def test_a_plain_cut_finds_what_exact_rays_find(finishing: tuple[Verdict, Verdict]) -> None:
    plain, gated = finishing
    rays, value = gated.judges[0].removal, plain.tried[0][1]
    assert value is not None and rays.lo <= value <= rays.hi


def test_the_gate_does_not_let_it_through(finishing: tuple[Verdict, Verdict]) -> None:
    plain, gated = finishing
    rays, wrong = gated.judges[0].removal, plain.tried[0][1]
    assert (
        wrong is not None and abs(wrong - rays.estimate) < 0.01 * wrong
    )  # no bracket of the mesh engine tells it
    assert gated.status in (Status.RETRIED, Status.REFUSED)
    if gated.removed_mm3 is not None:
        assert rays.lo <= gated.removed_mm3 <= rays.hi


@pytest.mark.xfail(
    strict=True, reason="BRepGProp integrates badly shaped torus and sweep faces to 1e-3, not 1e-6"
)
def test_volume_properties_of_a_shallow_ramp() -> None:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    sweep = Sweep.along(BullNose(diameter=10, corner_radius=2, length=40), Line((0, 0, 0), (30, 0, -0.3)))
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(solids(sweep)[0].shape, properties)
    assert properties.Mass() == pytest.approx(sweep.volume, rel=1e-6)
