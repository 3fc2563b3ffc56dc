"""What a user's type checker sees: each line is checked by mypy, strictly, and never run."""

from pathlib import Path
from typing import assert_type

import numpy as np
import numpy.typing as npt
import polars as pl
import trimesh
from matplotlib.figure import Figure

import vmachining as vm

tool = vm.BallNose(diameter=10, length=40)
sweep = vm.Sweep(tool, (0, 0, 0), vm.Pose((30, 0, 0), (0, 0, 1)))
assert_type(sweep.bounds, npt.NDArray[np.float64])
assert_type(sweep.volume, float | None)
assert_type(sweep.plot(), Figure)

one, two = vm.Interval(1, 2, 3), vm.Interval(4, 5, 6, proven=False)
assert_type(one + two, vm.Interval)
assert_type(one.width, float)
assert_type(2.5 in one, bool)

workpiece = vm.Workpiece(vm.Box((0, 0, -20), (100, 60, 0)), engine="columns", width=0.01)
assert_type(workpiece.volume, vm.Interval)
mesh: trimesh.Trimesh = workpiece.surface().to_trimesh()

job = vm.Job(
    program="slot.nc", tools=[tool], stock=vm.Box((0, 0, -20), (100, 60, 0)), feed=vm.Feed(strategy="force")
)
assert_type(job.replace(stock=vm.Cylinder((0, 0), 30, (-20, 0))), vm.Job)
result = vm.run(job, engine="columns")
assert_type(result, vm.RunResult)
assert_type(result.blocks, pl.DataFrame)
assert_type(result.removed, vm.Interval)
assert_type(result.contact(3), vm.Engagement)
assert_type(result.contact(3).plot(), Figure)
assert_type(result.plot("load"), Figure)
assert_type(result.write("out"), Path)

try:
    assert_type(vm.read_program("part.nc").moves[0].end, tuple[float, float, float])
except vm.NCError as error:
    assert_type(error.line, int | None)
    assert_type(error.remedy, str | None)

vm.BallNose(diameter="10", length=40)  # type: ignore[arg-type]
vm.Interval(1, 2, 3).lo = 0.0  # type: ignore[misc]
vm.Sweep(tool, (0, 0, 0))  # type: ignore[call-arg]
vm.run(job, engine=3)  # type: ignore[arg-type]
vm.run(job, contact="some")  # type: ignore[arg-type]
result.plot("loads")  # type: ignore[arg-type]
result.contact(3, method="boolean")  # type: ignore[arg-type]
vm.engage(job, 3, edge="spiral")  # type: ignore[arg-type]
vm.Feed(strategy="fast")  # type: ignore[arg-type]
vm.run(job, width=0.003, stages=("cut", "contact"), contact="sample", progress=True)
