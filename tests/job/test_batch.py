"""A batch: the same rows whoever does the jobs, a data set that answers the queries of the docs, a page, whose files."""

from __future__ import annotations

import csv
import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import duckdb
import polars as pl
import pytest
from polars.testing import assert_frame_equal
from tinyjob import FEED, JOB, SLOT_MM3, write_job

from vmachining.errors import InputError
from vmachining.job.batch import folders_of, run_many
from vmachining.job.batch.one import Order, mark, one_job
from vmachining.job.table import COLUMNS
from vmachining.report.batch import write_index

PAGE = Path(__file__).parents[2] / "docs" / "batch.md"
MEASURED = {"seconds", "peak_mb"}
ONLY_SLOT = "T1 M6\nS8000 M3\nG0 X-4 Y4 Z5\nG0 Z-1\nG1 X14 F600\nG0 Z5\nM30\n"


class Notes:
    """A watcher that keeps what it is told."""

    def __init__(self):
        self.places, self.rows = [], []

    def at(self, index, stage, done, total):
        self.places.append((index, stage, done, total))

    def ended(self, index, row, done, total):
        self.rows.append((index, row["status"], done, total))

    def note(self, text):
        raise AssertionError(text)


@pytest.fixture(scope="module")
def jobs(tmp_path_factory):
    root = tmp_path_factory.mktemp("jobs")
    return [
        write_job(root / "a", swap={'name = "tiny"': 'name = "007"'}, program=ONLY_SLOT),
        write_job(root / "b", program=""),
        write_job(root / "c", job=JOB + FEED, swap={'name = "tiny"': 'name = "with <b>feed</b>"'}),
    ]


def test_tables_as_csv_come_when_they_are_asked_for(tmp_path, monkeypatch):
    """Of more than 100,000 blocks there is none. Here in this process, where few are many."""
    monkeypatch.setattr("vmachining.job.course.MOST_CSV", 3)
    job = write_job(tmp_path / "job", program=ONLY_SLOT)
    order = Order(str(job), str(tmp_path / "out"), (), True, (), None, 0.0)
    for options, there in (
        (None, False),
        ({"csv": False}, False),
        ({"csv": True}, True),
        ({"csv": True}, True),
    ):
        row = one_job(order._replace(options=options, before=mark(tmp_path / "out")), stop=lambda: False)
        assert row["exit_code"] == 0 and (tmp_path / "out" / "blocks.csv").exists() is there
    assert row["status"] == "skipped"


@pytest.fixture(scope="module")
def batch(jobs, tmp_path_factory):
    """(directory, rows, watcher) of a batch in one process."""
    out, notes = tmp_path_factory.mktemp("night"), Notes()
    return out, run_many(jobs, out, formats=(), watcher=notes), notes


def dataset(out):
    return pl.scan_parquet(out / "dataset" / "*" / "*.parquet", hive_schema={"job": pl.String}).collect()


def queries(out, language):
    blocks = re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    return [block.replace("out/night", str(out)) for block in blocks]


@pytest.mark.slow  # 5 s
def test_the_number_of_processes_changes_no_number(jobs, batch, tmp_path):
    out, rows, _ = batch
    other = run_many(jobs, tmp_path, workers=2, formats=())
    for one, two in zip(rows, other, strict=True):
        assert {k: v for k, v in one.items() if k not in MEASURED | {"out"}} == {
            k: v for k, v in two.items() if k not in MEASURED | {"out"}
        }
    assert_frame_equal(
        dataset(out).sort("job", "block"), dataset(tmp_path).sort("job", "block"), check_exact=True
    )
    for name in ("007/blocks.csv", "with_b_feed_b/blocks.csv", "with_b_feed_b/scheduled.nc"):
        assert (out / name).read_bytes() == (tmp_path / name).read_bytes()


def test_a_failure_stops_nobody_and_is_told(batch):
    out, rows, notes = batch
    assert [row["status"] for row in rows] == ["done", "failed", "done"]
    assert rows[1]["exit_code"] == 2 and "empty" in rows[1]["message"] and rows[1]["out"] is None
    assert [told[1:] for told in notes.rows] == [("done", 1, 3), ("failed", 2, 3), ("done", 3, 3)]
    with (out / "batch.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["status"] for row in table] == ["done", "failed", "done"]
    assert json.loads((out / "batch.json").read_text())["complete"] is True


def test_blocks_are_told_while_a_job_is_on_its_way(batch):
    _, rows, notes = batch
    for index in (0, 2):
        blocks = rows[index]["blocks"]
        assert (index, "program", blocks, blocks) in notes.places
    assert any(stage == "scheduled" for index, stage, *_ in notes.places if index == 2)


def test_the_data_set_is_the_blocks_of_the_complete_jobs(batch):
    out, rows, _ = batch
    whole = dataset(out)
    assert whole.columns == [*COLUMNS, "job"] and set(whole["job"]) == {"007", "with_b_feed_b"}
    for row in (rows[0], rows[2]):
        folder = Path(row["out"])
        mine = whole.filter(pl.col("job") == folder.name).drop("job")
        assert_frame_equal(mine, pl.read_parquet(folder / "blocks.parquet"), check_exact=True)


def test_queries_of_the_docs_run_and_tell_the_slot(batch):
    """The slot is 4 x 1 x 10 mm, so its bracket has 40 in it."""
    out, _, _ = batch
    volumes, widest, tools = (duckdb.sql(query).pl() for query in queries(out, "sql"))
    assert set(volumes["job"]) == {"007", "with_b_feed_b"}
    slot = volumes.row(by_predicate=pl.col("job") == "007", named=True)
    assert slot["lo_mm3"] <= SLOT_MM3 <= slot["hi_mm3"]
    assert widest["width_mm3"].is_sorted(descending=True) and (widest["width_mm3"] > 0).all()
    together = dataset(out)
    assert tools["tool"].to_list() == [1]
    assert tools["cutting_s"][0] + tools["air_s"][0] == pytest.approx(together["time_s"].sum(), rel=1e-12)
    names: dict[str, object] = {}
    (python,) = queries(out, "python")
    exec(python, names)
    again = names["per_job"]
    assert again["job"].to_list() == volumes["job"].to_list()
    assert again["removed_mm3"].to_list() == pytest.approx(volumes["removed_mm3"].to_list(), rel=1e-12)


def test_mean_feeds_are_path_over_time(batch):
    _, rows, _ = batch
    # the only feed block runs at F600 without an acceleration limit
    assert rows[0]["mean_feed_mm_min"] == pytest.approx(600.0, rel=1e-12)
    assert rows[0]["scheduled_mean_feed_mm_min"] is None
    before, after = rows[2]["mean_feed_mm_min"], rows[2]["scheduled_mean_feed_mm_min"]
    assert after != pytest.approx(before, rel=1e-3) and 60.0 <= after <= 3000.0


class Links(HTMLParser):
    def __init__(self):
        super().__init__()
        self.found, self.outside = [], []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.outside += [v for k, v in attrs if k in ("src", "href") and v and v.startswith(("http", "//"))]
        if tag == "a":
            self.found.append(values["href"])


def test_the_page_has_failures_first_totals_and_links_that_lead_somewhere(batch):
    out, rows, _ = batch
    page = (out / "index.html").read_text(encoding="utf-8")
    links = Links()
    links.feed(page)
    assert not links.outside and "<b>feed</b>" not in page
    assert links.found and all((out / unquote(link)).is_file() for link in links.found)
    assert {"007/report.html", "with_b_feed_b/report.html"} <= set(links.found)
    assert page.index("Needs a look") < page.index(rows[1]["message"][-20:]) < page.index("Complete jobs")
    total = sum(row["removed_mm3"] for row in rows if row["removed_mm3"] is not None)
    assert f"{total:.6g}" in page.split("Needs a look")[0]


def test_the_page_leads_to_the_parquet_table_of_a_long_program(batch, tmp_path):
    """Above 100,000 blocks there is no blocks.csv."""
    out, rows, _ = batch
    long = tmp_path / Path(rows[0]["out"]).name
    shutil.copytree(rows[0]["out"], long)
    (long / "blocks.csv").unlink()
    write_index(
        [rows[0] | {"out": str(long)}], tmp_path / "index.html", json.loads((out / "batch.json").read_text())
    )
    links = Links()
    links.feed((tmp_path / "index.html").read_text(encoding="utf-8"))
    assert f"{long.name}/blocks.parquet" in links.found and f"{long.name}/blocks.csv" not in links.found


@pytest.mark.slow  # 4 s
def test_a_later_batch_forgets_jobs_that_are_not_its_own(jobs, tmp_path):
    run_many(jobs[:1], tmp_path, formats=())
    run_many(jobs[1:2], tmp_path, formats=())
    assert not (tmp_path / "dataset" / "job=007").exists() and (tmp_path / "007" / "blocks.csv").exists()
    assert "007" not in (tmp_path / "batch.csv").read_text()


@pytest.mark.parametrize("name", ["job=a/blocks.parquet", "job=007/blocks.parquet", "notes.txt"])
def test_a_data_set_of_somebody_else_is_refused(name, jobs, tmp_path):
    path = tmp_path / "dataset" / name
    path.parent.mkdir(parents=True)
    path.write_bytes(b"mine")
    with pytest.raises(InputError, match=r"queries read all of dataset/") as caught:
        run_many(jobs, tmp_path, formats=())
    assert str(path) in str(caught.value) and path.read_bytes() == b"mine"
    assert not (tmp_path / "batch.csv").exists()


@pytest.mark.slow  # 4 s
def test_a_partition_that_was_changed_is_somebodys(jobs, tmp_path):
    run_many(jobs[1:], tmp_path, formats=())
    path = tmp_path / "dataset" / "job=with_b_feed_b" / "blocks.parquet"
    run_many(jobs[1:], tmp_path, formats=(), resume=True)
    with path.open("ab") as file:
        file.write(b"more")
    with pytest.raises(InputError, match="was not made by this command"):
        run_many(jobs[1:], tmp_path, formats=(), resume=True)


def test_no_job_has_a_directory_with_a_name_of_the_batch(tmp_path):
    files = [tmp_path / f"{stem}.toml" for stem in ("dataset", "index.html", "batch.csv", "batch.json", "a")]
    names = [folder.name for folder in folders_of(files, tmp_path)]
    assert names == ["dataset-2", "index.html-2", "batch.csv-2", "batch.json-2", "a"]


@pytest.mark.slow  # 4 s: two interpreters start
def test_two_processes_begin_with_the_longest_program(tmp_path):
    """The shortest waits for somebody to be through; rows stay in the order of the files."""
    again = "G1 X0 F600\nG1 X14 F600\n"
    jobs = [
        write_job(
            tmp_path / name,
            swap={'name = "tiny"': f'name = "{name}"'},
            program=ONLY_SLOT.replace("G0 Z5\nM30\n", again * repeats + "G0 Z5\nM30\n"),
        )
        for name, repeats in (("middle", 4), ("short", 0), ("long", 8))
    ]
    told = []

    class Events(Notes):
        def at(self, index, *place):
            told.append(("at", index))

        def ended(self, index, *row):
            told.append(("ended", index))

    rows = run_many(jobs, tmp_path / "out", workers=2, formats=(), watcher=Events())
    assert [row["name"] for row in rows] == ["middle", "short", "long"]
    before = told[: [what for what, _ in told].index("ended")]
    assert ("at", 1) not in before and ("at", 1) in told
