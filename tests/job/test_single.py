"""One sweep: what cannot be written costs no number that is known."""

from math import cos, inf, radians, sin

import pytest

import vmachining as vm
from vmachining.errors import EngineError
from vmachining.job.single import sweep_record, swept_volume
from vmachining.sweep.flux import FluxVolume

FLAT = vm.FlatEnd(diameter=20, length=50)
TILTED = vm.Sweep(
    FLAT,
    vm.Pose((0, 0, 0), (0, 0, 1)),
    vm.Pose((0, 0, 0), (0, -sin(radians(30)), cos(radians(30)))),
)


def test_no_volume_is_more_than_what_is_entered():
    """A tilt by 30 degrees about the tip enters 193.018 mm3 twice, V = 29303.046344 by a closed form: facets reach farther."""
    found = swept_volume(TILTED, 0.5)
    assert found.lo < 29303.046344 <= found.hi == pytest.approx(29303.046344 + 193.018, rel=1e-6)
    assert not found.proven and found.estimate == pytest.approx(29303.046344, rel=1e-5)


def test_facets_that_hold_more_than_is_entered_are_a_contradiction(monkeypatch):
    """Where the search for what is entered twice was given up, no formula is there to say so."""
    monkeypatch.setattr(vm.Sweep, "flux", lambda *_: FluxVolume(1e4, 1e3, 0.0, inf, 0.0))
    with pytest.raises(EngineError, match=r"inner solid has .* all that is entered 11000"):
        swept_volume(TILTED, 0.5)


def test_a_step_that_cannot_be_written_leaves_the_volume(tmp_path):
    ball = vm.BallNose(diameter=10, length=40)
    said: list[str] = []
    record = sweep_record(
        vm.Sweep(ball, (0, 0, 0), (30, 0, 0)), 0.1, tmp_path / "none" / "s.step", said.append
    )
    exact = ball.profile.volume + 30 * ball.profile.meridian_area
    assert record["volume_mm3"] == pytest.approx(exact) and record["lo_mm3"] < exact < record["hi_mm3"]
    assert "cannot write" in record["step_refused"] and record["step_refused"].count("brep engine") == 1
    assert said[0] == "mesh of the inner solid" and said[-1] == "writing s.step"  # for who waits
