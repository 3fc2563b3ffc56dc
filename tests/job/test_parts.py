"""Parts of a run give what one run gives, to the last digit; what is not a set of parts is refused by name."""

from __future__ import annotations

import itertools
import json
import shutil
import sys
from dataclasses import replace
from functools import partial

import pytest
from polars.testing import assert_frame_equal
from test_chunks import BALL, PROGRAM, TINY
from tinyjob import FEED, JOB, write_job

import vmachining as vm
from vmachining.cli.main import run as command
from vmachining.engines import entry_of
from vmachining.errors import EngineError, InputError, JobError
from vmachining.job import Job, Stopped, engagement_columns
from vmachining.job.parts import Part, Replayed, parse_part, read_parts
from vmachining.job.run import run_part

LONG, SHORT = (
    BALL + f"flute_length_mm = {flutes}\nlength_mm = 20\nshank_diameter_mm = 6" for flutes in (8, 2.2)
)
"""The shank of the short one touches."""
DEEP = "G1 Z-3.5\nG1 X7\nG0 X5 Y15\nM30"
"""A rapid goes through material: orders that ask and do not cut."""


@pytest.fixture
def small(monkeypatch):
    """Four shares and many chunks of a program that a test can wait for."""
    monkeypatch.setattr(
        sys.modules["vmachining.job.cutting"],
        "entry_of",
        lambda name: replace(entry_of(name), divided_from=1),
    )
    monkeypatch.setattr(engagement_columns, "CHUNK", 4)
    monkeypatch.setattr(engagement_columns, "CHUNK_SLOW", 4)


def job_of(folder, feed="", tool=LONG):
    return Job.load(
        write_job(folder, job=JOB + feed, program=PROGRAM.replace("M30", DEEP), swap={TINY: tool})
    )


def parts_of(job, folder, count):
    folders = [folder / f"{k}" for k in range(1, count + 1)]
    for k, out in enumerate(folders, 1):
        run_part(job, Part(k, count), out=out)
    return folders


@pytest.mark.parametrize("tool, feed, counts", [
    (LONG, FEED, (3, 6)),  # more parts than shares, too
    # 30 s of a processor: volumes along blocks are measured in the merge
    pytest.param(SHORT, FEED + "insert_blocks = true\n", (2,), marks=pytest.mark.long),
], ids=["parts cut", "the merge cuts"])  # fmt: skip
def test_parts_are_merged_to_the_tables_of_one_run(tmp_path, small, tool, feed, counts):
    job = job_of(tmp_path / "job", feed, tool)
    whole = vm.run(job, out=tmp_path / "whole", workers=1)
    whole.write(tmp_path / "whole", report=False)
    said = "".join(whole.blocks["warning"].drop_nulls())
    assert "rapid through material" in said and ("shank touches" in said) == (tool == SHORT)
    assert whole.blocks["chip_area_mm2"].count() > 20
    for count in counts:
        out = tmp_path / f"of{count}"
        parts = read_parts(parts_of(job, out, count))
        assert len(parts.cut) == (min(count, 4) if tool == LONG else 0) and len(parts.contact) == count
        found = vm.run(job, out=out / "merged", workers=1, parts=parts)
        found.write(out / "merged", report=False)
        assert_frame_equal(found.blocks, whole.blocks, check_exact=True)
        for name in ("blocks.csv", "scheduled_blocks.csv", "scheduled.nc", "stock.stl"):
            assert (out / "merged" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name
        for name in ("removed_lo_mm3", "removed_hi_mm3", "final_mm3", "contact_notes"):
            assert found.summary[name] == whole.summary[name], name


def test_a_part_that_is_stopped_anywhere_continues_to_the_same_numbers(tmp_path, small):
    job = job_of(tmp_path / "job")
    whole = vm.run(job, workers=1)
    (first,) = parts_of(job, tmp_path, 1)
    for stops in (12, len(whole.blocks) + 2):  # in cut, in contact
        asked = itertools.count()
        with pytest.raises(Stopped):
            run_part(job, Part(2, 2), out=tmp_path / f"at{stops}", stop=lambda n=stops, k=asked: next(k) >= n)
        with pytest.raises(InputError, match="2/2 is not complete"):
            read_parts([tmp_path / f"at{stops}"])
        run_part(job, Part(2, 2), out=tmp_path / f"at{stops}", resume=True)
        run_part(job, Part(1, 2), out=tmp_path / "one")
        found = vm.run(job, parts=read_parts([tmp_path / f"at{stops}", tmp_path / "one"]), workers=1)
        assert_frame_equal(found.blocks, whole.blocks, check_exact=True)
        assert found.stock.volume == whole.stock.volume
        shutil.rmtree(tmp_path / "one")
    with pytest.raises(InputError, match=r"holds part 1/1, and .*at12 part 2/2"):
        read_parts([tmp_path / "at12", first])


def test_what_is_no_set_of_parts_is_refused_by_name(tmp_path, small):
    job = job_of(tmp_path / "job")
    one, two, three = parts_of(job, tmp_path, 3)
    with pytest.raises(InputError, match="part 2 of 3 is missing"):
        read_parts([one, three])
    with pytest.raises(InputError, match="parts 1, 3 of 3 are missing"):
        read_parts([two])
    shutil.copytree(two, tmp_path / "copy")
    with pytest.raises(InputError, match=r"part 2/3 is there twice: .*2 and .*copy"):
        read_parts([one, two, three, tmp_path / "copy"])
    with pytest.raises(InputError, match="contains no part of a run"):
        read_parts([one, tmp_path / "job"])
    for key, value, text in (
        ("options", {"width": 0.5}, "part 3/3 was made with another width"),
        ("inputs", {"program": {"file": "p", "sha256": "0"}}, "part 3/3 was made of another program"),
        (
            "versions",
            {"source of vmachining": "other"},
            "part 3/3 was made with source of vmachining other, this is",
        ),
        ("versions", {"numpy": "1.0"}, "part 3/3 was made with numpy 1.0, this is"),
    ):
        other = tmp_path / f"other {next(iter(value))}"
        shutil.copytree(three, other)
        manifest = json.loads((other / "manifest.json").read_text())
        manifest[key] |= value
        (other / "manifest.json").write_text(json.dumps(manifest))
        with pytest.raises(InputError, match=text):
            read_parts([one, two, other])


def test_parts_count_from_the_first_order_where_a_run_without_parts_was_interrupted(tmp_path, small):
    job = job_of(tmp_path / "job")
    whole = vm.run(job, workers=1)
    parts, asked = read_parts(parts_of(job, tmp_path, 2)), itertools.count()
    with pytest.raises(Stopped):
        vm.run(job, out=tmp_path / "out", workers=1, stop=lambda: next(asked) >= 12)
    found = vm.run(job, out=tmp_path / "out", workers=1, resume=True, parts=parts)
    assert_frame_equal(found.blocks, whole.blocks, check_exact=True)
    assert found.stock.volume == whole.stock.volume


@pytest.mark.parametrize("orders, text", [(-1, "gives more than"), (1, "this run gives")])
def test_answers_to_more_or_fewer_orders_than_a_run_gives_are_no_result(
    tmp_path, small, monkeypatch, orders, text
):
    job = job_of(tmp_path / "job")
    parts = read_parts(parts_of(job, tmp_path, 2))
    real = Replayed.__init__

    def other(self, *given):
        real(self, *given)
        self._orders += orders

    monkeypatch.setattr(Replayed, "__init__", other)
    with pytest.raises(EngineError, match=text):
        vm.run(job, parts=parts, workers=1)


@pytest.mark.parametrize("damage", ["cut short", "another bit", "missing"])
def test_a_part_whose_file_is_damaged_is_named(tmp_path, small, damage):
    job = job_of(tmp_path / "job")
    folders = parts_of(job, tmp_path, 2)
    (file,) = folders[1].glob("checkpoint.program.*.npz")
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0x55
    file.unlink()
    if damage != "missing":
        file.write_bytes(data[: len(data) // 2] if damage == "cut short" else data)
    with pytest.raises(
        InputError, match=r"2/checkpoint\.program.*: this part cannot be used.*make the part again"
    ):
        vm.run(job, parts=read_parts(folders), workers=1)


@pytest.mark.parametrize("run", [vm.run, partial(run_part, part=Part(1, 2))])
def test_what_another_code_began_is_not_continued(run, tmp_path, small, monkeypatch):
    """The code would have been said to be that of the second half alone."""
    job, asked = job_of(tmp_path / "job"), itertools.count()
    with pytest.raises(Stopped):
        run(job, out=tmp_path / "1", workers=1, stop=lambda: next(asked) >= 12)
    monkeypatch.setattr(sys.modules["vmachining.job.files"], "_source_digest", lambda: "other")
    with pytest.raises(JobError, match=r"made with source of vmachining [0-9a-f]+, this is other"):
        run(job, out=tmp_path / "1", workers=1, resume=True)


def test_a_part_and_a_whole_result_do_not_replace_each_other(tmp_path, small):
    job = job_of(tmp_path / "job")
    whole, (one, _) = tmp_path / "whole", parts_of(job, tmp_path, 2)
    vm.run(job, out=whole).write(whole, report=False)
    before = {path: path.read_bytes() for folder in (whole, one) for path in folder.iterdir()}
    with pytest.raises(InputError, match=r"whole: holds the result of this job, .*--force"):
        run_part(job, Part(1, 2), out=whole)
    with pytest.raises(InputError, match="1: holds part 1/2 of this job"):
        run_part(job, Part(2, 2), out=one)
    with pytest.raises(InputError, match="1: holds part 1/2 of this job"):
        vm.run(job, out=one)
    assert {path: path.read_bytes() for folder in (whole, one) for path in folder.iterdir()} == before
    run_part(job, Part(1, 2), out=whole, force=True)
    with pytest.raises(
        InputError, match=r"is the file \d of the parts of this job"
    ):  # it was lost, and an internal failure
        vm.run(job, out=one, parts=read_parts([one, tmp_path / "2"]), force=True)
    read_parts([one, tmp_path / "2"])


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "a/b", "1/0", "-1/2", ""])
def test_words_that_are_no_part(text):
    with pytest.raises(InputError, match="is not understood"):
        parse_part(text)


def test_a_part_takes_no_option_that_only_the_merge_can_keep(tmp_path, small, capsys):
    """Both were ignored without a word, and merge had no way to ask for the second."""
    write_job(tmp_path / "job")
    words = ["run", str(tmp_path / "job" / "job.toml"), "--part", "1/2", "--out", str(tmp_path / "1")]
    for option, text in ((["--stock", "3mf"], "belongs to merge"), (["--stock-at", "3"], "needs the whole")):
        assert command([*words, *option]) == 2 and text in capsys.readouterr().err
    assert command([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"part": "1/2", "out": str(tmp_path / "1")}


def test_a_table_as_csv_that_the_parts_were_asked_for_is_written_by_the_merge(tmp_path, small, monkeypatch):
    """`merge` has no --csv: it forgot that of its parts, so that a long program had no blocks.csv."""
    monkeypatch.setattr(sys.modules["vmachining.job.course"], "MOST_CSV", 2)
    write_job(tmp_path / "job")
    job, out, parts = (
        str(tmp_path / "job" / "job.toml"),
        tmp_path / "merged",
        [str(tmp_path / k) for k in "12"],
    )
    for k, part in enumerate(parts, 1):
        words = ["run", job, "--part", f"{k}/2", "--out", part, "--csv", "--stages", "cut", "--quiet"]
        assert command(words) == 0
    assert command(["merge", *parts, "--out", str(out), "--quiet"]) == 0
    assert (out / "blocks.csv").is_file()
    assert "table_note" not in json.loads((out / "summary.json").read_text())
