"""One sweep: what cannot be written costs no number that is known."""

import pytest

import vmachining as vm
from vmachining.job.single import sweep_record


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
