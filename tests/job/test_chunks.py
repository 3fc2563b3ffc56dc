"""Chunks of blocks side by side give what one after the other gives, and an exception or a stop comes in its turn."""

from __future__ import annotations

import threading
import time
from contextlib import closing

import pytest
from polars.testing import assert_frame_equal
from tinyjob import write_job

from vmachining.job import Job, Stopped, engagement_columns
from vmachining.job.chunks import Beside, in_order
from vmachining.job.engagement_columns import engagement_pass
from vmachining.job.reading import read_job_program
from vmachining.job.toolpath import Toolpath

ROWS = "".join(
    f"G1 X{14 if k % 2 else -4} Y{1 + 0.4 * k:.1f} Z{-0.3 - 0.1 * (k % 5):.1f} F600\n" for k in range(24)
)
ARCS = "G1 Z-1\nG2 X7 Y12 I2 J0\nG3 X3 Y8 I-2 J-2 Z-2\n"
PROGRAM = f"T1 M6\nS8000 M3\nG0 X-4 Y1 Z1\n{ROWS}G1 X3 Y12\n{ARCS}M30\n"
BALL = 'type = "ball"\ndiameter_mm = 4\nflutes = 2\n'
TINY = 'type = "flat"\ndiameter_mm = 4\nlength_mm = 20'


def _pass(folder, tool, **options):
    job = Job.load(write_job(folder, program=PROGRAM, swap={TINY: tool}))
    return engagement_pass(job, Toolpath.of(read_job_program(job), job.machine), **options)


def test_results_come_in_order_and_an_exception_in_its_turn():
    def work(hand: str, item: int) -> int:
        time.sleep(0.002 * (5 - item % 5))
        if item == 7:
            raise ValueError(item)
        return item

    for hands in (["a"], ["a", "b"], ["a", "b", "c"]):
        found = []
        with pytest.raises(ValueError, match="7"), closing(in_order(work, range(12), hands)) as results:
            found.extend(results)
        assert found == list(range(7))


@pytest.mark.parametrize("threads", [1, 2])
def test_work_beside_gives_its_result_or_its_exception_when_asked(threads):
    def fails() -> int:
        raise ValueError("asked")

    with Beside(threads) as beside:
        number, name, fault = (beside.later(work) for work in (lambda: 7, threading.get_ident, fails))
        assert number() == 7 and (name() == threading.get_ident()) == (threads == 1)
        with pytest.raises(ValueError, match="asked"):
            fault()


def test_contact_is_the_same_with_any_number_of_threads(tmp_path, monkeypatch):
    monkeypatch.setattr(engagement_columns, "CHUNK", 4)
    whole = _pass(tmp_path / "one", BALL + "length_mm = 20")
    assert whole.columns["ap_mm"].count() > 20
    for workers in (2, 3):
        found = _pass(tmp_path / f"{workers}", BALL + "length_mm = 20", workers=workers)
        assert_frame_equal(found.columns, whole.columns, check_exact=True)
        assert (found.area_per_feed == whole.area_per_feed).all() and (found.block == whole.block).all()


def test_a_stop_is_heard_between_chunks_and_the_rest_is_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(engagement_columns, "CHUNK", 4)
    tool, asked, file = BALL + "length_mm = 20", [], tmp_path / "point.npz"
    whole = _pass(tmp_path / "job", tool)
    with pytest.raises(Stopped):
        _pass(
            tmp_path / "job", tool, workers=2, stop=lambda: asked.append(1) or len(asked) > 3,
            checkpoint=lambda state, done: state.save(file),
        )  # fmt: skip
    found = _pass(tmp_path / "job", tool, workers=2, known=[file])
    assert_frame_equal(found.columns, whole.columns, check_exact=True)


def test_what_flutes_and_shank_are_called_changes_no_contact(tmp_path):
    """A tool with `flute_length_mm` was taken for another one in every motion, and a touch at tips for material."""
    plain = _pass(tmp_path / "plain", BALL + "length_mm = 20").columns
    fluted = _pass(tmp_path / "fluted", BALL + "flute_length_mm = 20\nlength_mm = 60").columns
    assert_frame_equal(plain, fluted, check_exact=True)
