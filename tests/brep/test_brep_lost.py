"""Processes of a driver that are lost while a value is judged: what is asked again, and what is not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cadquery as cq
import pytest

from vmachining import Bracket, FlatEnd, Sweep
from vmachining.engines.brep import Blank, Status, check_blocks, workers
from vmachining.engines.brep.rungs import FACETS, MESHES, RAYS
from vmachining.geometry import Line

BOX = Blank("box", (0, -20, -20), (30, 20, 0))
TOOL = FlatEnd(diameter=10, length=40)


def ends_at(what: str, end: type[Exception], monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Processes of a driver end as soon as they tell of something; all that they told until then, as it comes."""
    real, told = workers._Worker._receive, list[str]()

    def ends(self: workers._Worker, seconds: float) -> Any:
        answer = real(self, seconds)
        told.append(answer if isinstance(answer, str) else "")
        if answer == what:
            self.rung = answer
            raise end("for a test")
        return answer

    monkeypatch.setattr(workers._Worker, "_receive", ends)
    return told


@pytest.mark.parametrize("end", [workers._Late, workers._Gone])
def test_a_mesh_that_hangs_or_crashes_costs_one_process_of_a_block(
    end: type[Exception], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A doubtful value, near a curved face of a STEP stock: meshes end the process, the same boolean is asked again, and
    sections confirm it."""
    told = ends_at(MESHES, end, monkeypatch)
    across = Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))
    ((_, verdict),) = check_blocks(hollow(tmp_path), [[across]], {0: Bracket(200.0, 250.0, 400.0)})
    assert (
        told.count("ready") == 2
        and verdict.status is Status.AGREED
        and verdict.removed_mm3 == pytest.approx(300.0)
    )
    assert verdict.sure_mm3 is not None and verdict.sure_mm3 < 10.0


def hollow(folder: Path) -> Blank:
    """`BOX` as STEP with a hole from below that ends 5e-3 mm under a slot 1 mm deep: rays do not tell its round wall."""
    hole = cq.Workplane("XY").circle(3.0).extrude(20.0 - 1.005).translate((15, 0, -20))
    part = cq.Workplane("XY").box(30, 40, 20).translate((15, 0, -10)).cut(hole)
    cq.exporters.export(part, str(folder / "hollow.step"))
    return Blank("step", file=str(folder / "hollow.step"))


@pytest.mark.parametrize("end", [workers._Late, workers._Gone])
def test_rays_that_hang_or_crash_cost_one_process_of_a_block(
    end: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same boolean is asked again, and stands without them, confirmed by meshes as it is in doubt."""
    made = ends_at(RAYS, end, monkeypatch)
    across = Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))
    ((_, verdict),) = check_blocks(BOX, [[across]], {0: Bracket(200.0, 250.0, 400.0)})
    assert made.count(RAYS) == 1 and made.count("plain") == 2
    assert verdict.status is Status.AGREED and verdict.removed_mm3 == pytest.approx(300.0)
    assert "facets" in made and verdict.sure_mm3 is not None and verdict.sure_mm3 < 10.0


def test_what_did_not_stand_is_not_asked_again_after_a_process_was_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A boolean outside of a bracket (a wrong one), then meshes that end the process: these were not asked to confirm it."""
    made = ends_at(MESHES, workers._Gone, monkeypatch)
    across = Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))
    rungs = ("plain", FACETS, "turned")
    ((_, verdict),) = check_blocks(BOX, [[across]], {0: Bracket(301.0, 305.0, 310.0)}, rungs=rungs)
    assert [made.count(rung) for rung in rungs] == [1, 1, 1]
    assert verdict.status is Status.REFUSED and "300 mm3 is outside" in verdict.reason
