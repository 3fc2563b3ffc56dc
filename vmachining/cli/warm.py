"""`vmachining warm`: every kernel compiled now, in two processes, so that no later command waits for it."""

from __future__ import annotations

import os
import subprocess
import sys
import time

from vmachining.cli.job_commands import Warm
from vmachining.cli.screen import note
from vmachining.disk import Scratch

PROGRAM = """\
G21 G17 G90 G94 T1 M6 S5000 M3
G0 X-5 Y5 Z5
G0 Z-1
G1 X5 F600
G1 X8 Z-1.5
G2 X12 Y9 I0 J4
G3 X8 Y13 Z-2 I-4 J0
G0 Z5
M30
"""

JOB = {
    "program": {"file": "warm.nc", "home": [0, 0, 20]},
    "machine": {"rapid_mm_min": 6000, "max_feed_mm_min": 4000, "max_acceleration_mm_s2": 2000},
    "tools": [{"number": 1, "type": "bull", "diameter_mm": 6, "corner_radius_mm": 1, "length_mm": 30, "flute_length_mm": 15,
               "flutes": 2, "helix_deg": 30}],
    "force": {"coefficients": "aluminium_like_constant"}, "stock": {"box": {"min": [0, 0, -8], "max": [16, 16, 0]}},
    "design": {"stl": "warm.stl"}, "vectors": {"spacing_mm": 1.0},
    "accuracy": {"chord_mm": 0.1, "width": 0.003, "width_mm3": 0.001},
    "feed": {"strategy": "volume", "reference": "auto", "min_mm_min": 60, "max_mm_min": 3000},
}  # fmt: skip


def warm(o: Warm) -> int:
    """Compile in two processes; says what happens and how long it took. Returns 0, or 1 if one of them failed."""
    begin = time.monotonic()
    note("compiling kernels, once, in two processes: this takes a minute or so", quiet=o.quiet)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    workers = [
        subprocess.Popen(
            [sys.executable, "-c", f"from vmachining.cli.warm import part; part({k})"],
            env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )
        for k in (0, 1)
    ]  # fmt: skip
    failed = 0
    try:
        for worker in workers:
            said = worker.communicate()[1]
            if worker.returncode:
                failed = 1
                told = said.decode(errors="replace").strip()
                note((told or f"a process ended with exit code {worker.returncode}").splitlines()[-1])
    finally:
        for worker in workers:
            worker.kill()
    if failed:
        note("not all kernels could be compiled ahead; commands compile what they need")
    else:
        note(f"kernels are compiled ({time.monotonic() - begin:.0f} s)", quiet=o.quiet)
    return failed


def part(k: int) -> None:
    """What one of the two processes compiles: cutting with upright tools and jobs, or tools that turn and engagement."""
    (_jobs, _turns)[k]()


def _jobs() -> None:
    from vmachining.engines import ENGINES
    from vmachining.job import Job, engage, run
    from vmachining.job.stock import write_stock
    from vmachining.stock import BoxStock

    with Scratch() as folder:
        (folder / "warm.nc").write_text(PROGRAM)
        write_stock(BoxStock((1, 1, -8), (15, 15, -1)).mesh(0.1)[0], folder / "warm.stl")
        job = Job.from_mapping(JOB, folder)
        for engine in ENGINES:
            run(job, engine=engine, workers=1)
        engage(job, 3)
        engage(job, 3, method="analytic")
    demonstrated()


def demonstrated() -> None:
    """What `vmachining demo` needs, whatever that is."""
    from vmachining.cli.demo import demo_job
    from vmachining.job import Job, run

    with Scratch() as folder:
        run(Job.load(demo_job("slot")), workers=1).write(folder / "demo")


def _turns() -> None:
    import numpy as np

    from vmachining.engines import ENGINES, engine_class
    from vmachining.engines.protocol import Options
    from vmachining.stock import BoxStock, MeshStock
    from vmachining.sweep import Pose, Sweep
    from vmachining.tool import BallNose, BullNose

    tool = BullNose(diameter=6, corner_radius=1, length=30)
    turn = Sweep(tool, Pose((5, 5, -2)), Pose((9, 6, -2), (0.28, 0.0, 0.96)))
    ball = Sweep(BallNose(diameter=6, length=30), (3, 3, -2), (9, 4, -3))
    points = np.array([[6.0, 5.0, 0.0], [60.0, 5.0, 0.0]])
    assert turn.volume is not None or turn.flux is not None
    for sweep in (turn, Sweep(tool, (0, 0, 0), (5, 1, 0.5))):
        sweep.signed_distance(points)
        sweep.contains(points)
        sweep.ray_intervals(points, (0.0, 0.0, 1.0))
    box = BoxStock((0, 0, -8), (16, 16, 0))
    around, _ = box.mesh(0.1)
    mesh = MeshStock(*around)
    mesh.signed_distance(points)
    mesh.crossings(points[:, :2])
    for name in ENGINES:
        kind = engine_class(name)
        if kind.takes(turn):
            engine = kind.of(box, Options(chord=0.1, design=mesh))
            engine.cut(turn, 0)
            engine.cut(ball, 1)
            engine.surface()
