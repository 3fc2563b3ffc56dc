"""Features of a part that comes as STEP and as STL: areas and lengths of walls, overhangs and sharp edges in closed form."""

from __future__ import annotations

from math import pi, radians
from pathlib import Path

import numpy as np
import pytest
from tinyjob import write_job

from vmachining.engines.vectors.part import DesignPart, features
from vmachining.job import Job
from vmachining.job.stock import design_mesh

CHORD = 0.01
"""mm between facets and part, of both files."""

BOSS, CAP = 6.0, 9.0
"""mm: radii of a boss, 8 high, on a plate of 40 x 30 x 10, and of the cap on it, 2 high."""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    import cadquery as cq

    folder = tmp_path_factory.mktemp("mushroom")
    plate = cq.Workplane().box(40, 30, 10, centered=(True, True, False))
    boss = cq.Workplane().circle(BOSS).extrude(8).translate((0, 0, 10))
    body = plate.union(boss).union(cq.Workplane().circle(CAP).extrude(2).translate((0, 0, 18)))
    cq.exporters.export(body, str(folder / "part.step"))
    cq.exporters.export(body, str(folder / "part.stl"), tolerance=CHORD / 4, angularTolerance=1.0)
    return folder


@pytest.mark.parametrize("kind", ["step", "stl"])
def test_features_of_a_file(kind: str, files: Path) -> None:
    """A circle is a polygon with corners on it and a sagitta of CHORD at most: shorter by CHORD / (3 r) of itself at most."""
    job = write_job(files / kind, swap={"chord_mm = 0.05": f"chord_mm = {CHORD}"})
    job.write_text(job.read_text() + f'\n[design]\n{kind} = "{files / f"part.{kind}"}"\n')
    mesh = design_mesh(Job.load(job))
    assert mesh is not None
    part = DesignPart(mesh)
    found = features(part, radians(75.0), radians(30.0))
    cross = np.cross(part.corners[:, 1] - part.corners[:, 0], part.corners[:, 2] - part.corners[:, 0])
    area = np.linalg.norm(cross, axis=1) / 2.0
    round_wall, ring = 2 * pi * BOSS * 8 + 2 * pi * CAP * 2, pi * (CAP**2 - BOSS**2)
    slack = CHORD / BOSS
    assert 1400.0 + (1.0 - slack) * round_wall <= area[found.wall].sum() <= 1400.0 + round_wall + 1e-3
    assert area[found.overhang].sum() == pytest.approx(ring, abs=2 * pi * (BOSS + CAP) * CHORD)
    length = np.linalg.norm(found.edge[:, 1] - found.edge[:, 0], axis=1).sum()
    straight, circles = 2 * (40.0 + 30.0) + 4 * 10.0, 2 * pi * (2 * BOSS + 2 * CAP)
    assert straight + (1.0 - slack) * circles <= length <= straight + circles + 1e-3
