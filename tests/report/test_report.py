"""The page: self-contained, escaped, honest, and light enough to open."""

from __future__ import annotations

import base64
import json
import re

import numpy as np
import pytest
from tinyjob import FEED, JOB, PROGRAM, write_job

from vmachining.job import Job, run
from vmachining.report import write_report
from vmachining.report.figures import along_program
from vmachining.report.thin import MAX_POINTS, thin_mesh, thin_rows

EVIL = "(</script><script>alert`1`</script><img src=x onerror=alert`2`>&amp;)"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A job whose name, comments and warnings try to break out."""
    folder = tmp_path_factory.mktemp("report")
    program = PROGRAM.replace("N70 G0 Z5", f"N70 G0 X-4 Y9 {EVIL}").replace("N30 S8000 M3\n", "")
    job = write_job(folder, job=JOB + FEED, program=program, swap={'name = "tiny"': 'name = "<b>tiny</b>&"'})
    result = run(Job.load(job))
    write_report(result, folder / "report.html")
    return result, (folder / "report.html").read_text(encoding="utf-8")


def body(text):
    """The page without plotly, style and figures."""
    text = re.sub(r"<script>.*?</script>", "", text, count=1, flags=re.S)
    return re.sub(r"<style>.*?</style>", "", text, count=1, flags=re.S)


def figures(text):
    return json.loads(
        re.search(r'<script id="figures" type="application/json">(.*?)</script>', text, re.S)[1]
    )


def test_nothing_is_fetched(page):
    text = body(page[1])
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//""", text)
    assert page[1].count("Plotly.newPlot(plots") == 1


def test_foreign_text_is_escaped(page):
    text = body(page[1])
    assert "<img" not in text and "alert`1`</script>" not in text and "<b>tiny</b>" not in text
    assert "&lt;b&gt;tiny&lt;/b&gt;&amp;" in text
    assert "&lt;img src=x onerror=alert`2`&gt;" in text  # in the table of warnings
    hover = figures(page[1])["plots"]["layout"]["meta"]["labels"]
    assert any("&lt;img" in label for label in hover) and not any("<img" in label for label in hover)


def test_the_page_says_what_it_does_not_know(page):
    text = page[1]
    for words in (
        "Not certified here",
        "Widest intervals",
        "rapid through material",
        "sha256",
        "Scheduled time",
    ):
        assert words in text


@pytest.mark.slow  # 4 s
def test_the_page_says_what_the_second_engine_said(page, tmp_path):
    """Nobody asked it; it agreed on all blocks; it refused one."""
    nobody = body(page[1])
    assert "not certified by a second engine" in nobody and "No second engine (B-rep)" in nobody
    result = run(Job.load(write_job(tmp_path)), brep="all")
    counts = result.summary["brep"]
    assert counts["asked"] == counts["agreed"] + counts["retried"] > 2
    write_report(result, tmp_path / "r.html")
    text = body((tmp_path / "r.html").read_text(encoding="utf-8"))
    asked = counts["asked"]
    assert f"B-rep agreed on {asked} of {asked} blocks" in text and "second engine" not in text
    known, unknown = text.split("Not certified here")
    assert f"was asked about {asked} blocks" in known and "was asked about" not in unknown
    counts.update(agreed=counts["agreed"] - 1, refused=1)
    write_report(result, tmp_path / "r.html")
    text = body((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert f"B-rep agreed on {asked - 1} of {asked} blocks" in text and "1 it refused" in text


def test_the_figures_hold_the_numbers(page):
    result, text = page
    data = figures(text)
    names = [trace["name"] for trace in data["stock"]["data"]]
    assert names[:2] == ["uncut stock", "cut surface"] and "rapid through material" in names
    drawn = along_program(result.blocks, result.schedule.after_rate)
    removed = next(trace for trace in drawn.data if trace.name == "removed volume")
    assert np.array_equal(removed.y[::2], result.blocks["removed_mm3"].to_numpy())


def test_sums_by_tool_and_the_rate_when_scheduled(page):
    result, text = page
    assert "Totals by tool" in text and "T1 flat 4 mm" in text
    assert f"{float(result.blocks['time_s'].sum()):,.1f}" in text
    packed = figures(text)["block_rate_after"]
    rates = np.frombuffer(base64.b64decode(packed), dtype="<f4")
    assert np.array_equal(rates, np.nan_to_num(result.schedule.after_rate).astype("<f4"))


def test_warnings_without_a_row_and_notes_about_all_volumes_are_shown(tmp_path):
    program = PROGRAM.replace("N130 M30", "N130 S900 M5\nM30")
    result = run(Job.load(write_job(tmp_path, program=program)))
    result.findings.append((14, "N125 (loose) <b>", "W999 a line that does not move"))
    result.summary["notes"].append("triangulated <i>within</i> 1 mm")
    write_report(result, tmp_path / "r.html")
    text = body((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert "W999 a line that does not move" in text and "N125 (loose) &lt;b&gt;" in text
    assert "triangulated &lt;i&gt;within&lt;/i&gt; 1 mm" in text and "None: no rapid met" not in text


def test_a_view_is_as_large_as_its_frame():
    from vmachining.report.figures import FRAME, _zoom

    for extent in ([100, 100, 1], [1, 1, 100], [300, 10, 5], [1, 1, 1]):
        size = _zoom(np.array(extent, dtype=float)) * np.array(extent)
        eye = np.array([-0.75, -1.3, 1.05]) / np.linalg.norm([-0.75, -1.3, 1.05])
        right = np.array([1.3, -0.75, 0]) / np.hypot(1.3, 0.75)
        shown = [abs(right) @ size, abs(np.cross(eye, right)) @ size]
        assert max(shown[0] / FRAME[0], shown[1] / FRAME[1]) == pytest.approx(1.0)


def test_many_triangles_become_few_and_keep_the_shape():
    n = 120
    x, y = np.meshgrid(np.linspace(0, 10, n), np.linspace(0, 10, n))
    vertices = np.stack([x.ravel(), y.ravel(), np.sin(x).ravel()], axis=1)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate([np.stack([a, a + 1, a + n], 1), np.stack([a + 1, a + n + 1, a + n], 1)])
    block = np.arange(len(triangles))
    thin = thin_mesh(vertices, triangles, block, limit=5000)
    assert 500 < len(thin.triangles) <= 5000 and len(thin.block) == len(thin.triangles) and thin.cell > 0
    assert np.abs(thin.vertices.min(axis=0) - vertices.min(axis=0)).max() <= thin.cell
    assert thin_mesh(vertices, triangles, block, limit=10**6).triangles is triangles


def test_long_series_keep_their_extremes():
    weight = np.random.default_rng(1).random(10 * MAX_POINTS)
    weight[12345] = 7.0
    rows = thin_rows(len(weight), weight)
    assert len(rows) <= MAX_POINTS + 2 and 12345 in rows and rows[0] == 0 and rows[-1] == len(weight) - 1
    assert (np.diff(rows) > 0).all() and len(thin_rows(5, weight[:5])) == 5
