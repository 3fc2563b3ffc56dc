"""The page: self-contained, escaped, honest, and light enough to open."""

from __future__ import annotations

import base64
import hashlib
import html
import re
from pathlib import Path

import numpy as np
import pytest
from pagedata import unpacked
from scipy.spatial.transform import Rotation
from tinyjob import FEED, JOB, PROGRAM, write_job

import vmachining.report
from vmachining.job import Job, run
from vmachining.job.reading import read_job_program
from vmachining.job.toolpath import Toolpath
from vmachining.report import write_report
from vmachining.report.payload import _volume, path_payload
from vmachining.report.thin import MAX_POINTS, thin_mesh, thin_rows
from vmachining.stock import CylinderStock

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
    """The page without its code, style and data."""
    for part in (r"<script>.*?</script>", r"<style>.*?</style>", r'<script id="data".*?</script>'):
        text = re.sub(part, "", text, count=1, flags=re.S)
    return text


def test_nothing_is_fetched(page):
    text = body(page[1])
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//""", text)
    assert "default-src 'none'" in text and "connect-src" not in text


def test_only_the_code_of_the_page_may_run(page):
    """The policy names the digest of the one script; an injected one would not run."""
    policy = re.search(r"script-src &#39;sha256-(.+?)&#39;|script-src 'sha256-(.+?)'", page[1])
    named = html.unescape(policy[1] or policy[2])
    code = re.search(r"<script>(.*?)</script>", page[1], re.S)[1]
    assert base64.b64decode(named) == hashlib.sha256(code.encode()).digest()


def test_foreign_text_is_escaped(page):
    text = body(page[1])
    assert "<img src=x" not in text and "alert`1`</script>" not in text and "<b>tiny</b>" not in text
    assert "&lt;b&gt;tiny&lt;/b&gt;&amp;" in text
    assert "&lt;img src=x onerror=alert`2`&gt;" in text  # in the table of warnings
    head, _ = unpacked(page[1])
    assert any(EVIL in line for line in head["source"])  # as it is: the page sets it as text, never as markup


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
    """Exact rays alone looked; the B-rep engine agreed on all blocks; it refused one."""
    rays, judge = body(page[1]), page[0].summary["second_judge"]
    assert judge["blocks"] > 2 and judge["disputed_blocks"] == 0
    assert f"a second engine agrees on {judge['blocks']} blocks" in rays
    assert f"A second engine (exact rays) checked {judge['blocks']} blocks" in rays
    result = run(Job.load(write_job(tmp_path)), brep="all")
    counts = result.summary["brep"]
    assert counts["asked"] == counts["agreed"] + counts["retried"] > 2
    write_report(result, tmp_path / "r.html")
    text = body((tmp_path / "r.html").read_text(encoding="utf-8"))
    asked = counts["asked"]
    assert f"B-rep agreed on {asked} of {asked} blocks" in text and "second engine" not in text
    known, unknown = text.split("Not certified here")
    assert f"The B-rep engine checked {asked} blocks" in known and "B-rep engine checked" not in unknown
    seen = result.blocks["removed_dexel_mm3"].count()
    assert seen > 1 and f"Exact rays judged {seen} blocks in addition to the B-rep engine" in known
    counts.update(agreed=counts["agreed"] - 1, refused=1)
    write_report(result, tmp_path / "r.html")
    text = body((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert f"B-rep agreed on {asked - 1} of {asked} blocks" in text and "1 it refused" in text


def test_the_data_are_those_of_the_table(page):
    result, text = page
    head, arrays = unpacked(text)
    blocks = result.blocks
    assert arrays["block"].tolist() == blocks["block"].to_list() and head["texts"] == blocks["text"].to_list()
    for name in ("removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "mrr_mm3_min", "chip_area_mm2"):
        if name in arrays:
            assert np.array_equal(arrays[name], blocks[name].to_numpy().astype("<f4"), equal_nan=True)
    begin = np.cumsum(blocks["time_s"].to_numpy()) - blocks["time_s"].to_numpy()
    assert arrays["begin_s"] == pytest.approx(begin, rel=1e-6) and head["ends"]["time"] == pytest.approx(
        begin[-1] + blocks["time_s"][-1]
    )
    assert 3 in arrays["kind"] and 1 in arrays["kind"]  # a rapid through material, and feeds
    surface = result.surface
    assert np.array_equal(arrays["triangles"].reshape(-1, 3), surface.triangles)
    assert np.array_equal(arrays["face_block"], surface.block)


def test_every_piece_of_the_path_belongs_to_its_block(page):
    """Ends of feed motions are the positions that the table states."""
    result, text = page
    _, arrays = unpacked(text)
    points, rows, kind = arrays["points"].reshape(-1, 3), arrays["segment_row"], arrays["kind"]
    ends = result.blocks.select("x_mm", "y_mm", "z_mm").to_numpy()
    for row in range(len(ends)):
        last = np.flatnonzero((rows == row) & (kind > 0))[-1]
        assert points[last + 1] == pytest.approx(ends[row], abs=1e-4)


def test_raw_heights_are_those_of_the_box(page):
    result, text = page
    head, arrays = unpacked(text)
    box, grid = result.job.keys.stock.box, head["grid"]
    assert set(np.unique(arrays["heights"])) == {np.float32(box.max[2])} and grid["floor"] == box.min[2]
    assert grid["columns"] * grid["pitch"] >= box.max[0] - box.min[0]


def test_cells_of_a_leaning_tool_hold_distances_to_the_raw_bar():
    """Of a cylinder, whose distance has a closed form; kept to two cells, in steps of 2 / 127 of one."""
    radius, (bottom, top) = 7.0, (-20.0, 1.0)
    made = _volume(CylinderStock((1.0, -2.0), radius, (bottom, top)))
    low, pitch, size = (np.array(made["volume"][name]) for name in ("low", "pitch", "size"))
    k, j, i = np.indices(size[::-1])
    x, y, z = (low[c] + pitch * n for c, n in enumerate((i, j, k)))
    aside, above = np.hypot(x - 1.0, y + 2.0) - radius, np.maximum(bottom - z, z - top)
    away = np.where((aside > 0) & (above > 0), np.hypot(aside, above), np.maximum(aside, above))
    told = made["arrays"]["volume"].reshape(size[::-1]) * (2.0 * pitch / 127.0)
    assert np.abs(told - np.clip(away, -2.0 * pitch, 2.0 * pitch)).max() <= pitch / 127.0 * 1.001
    shell = np.ones(size[::-1], dtype=bool)
    shell[1:-1, 1:-1, 1:-1] = False
    assert (told[shell] > 0.0).all()  # the surface closes within the cells


@pytest.mark.parametrize("chain", ["c-table-b-head", "bc-table", "cb-head"])
def test_the_machine_that_is_played_holds_the_tool_as_the_path_does(chain, tmp_path):
    """Tables turned back from the path and the head turned from home agree on the tool axis, whoever carries what."""
    program = (
        "G21 G90 G17\nT1 M6\nS6000 M3\nG0 X40 Y-30 Z10\nG0 B70 C20\nG1 X30 Y5 C50 F500\nG1 B-30 Y20\nM30\n"
    )
    job = Job.load(
        write_job(
            tmp_path, job=JOB.replace("[machine]\n", f'[machine]\nchain = "{chain}"\n'), program=program
        )
    )
    toolpath = Toolpath.of(read_job_program(job), job.machine)
    told = path_payload(toolpath, job).text
    head, arrays = unpacked(f'<script id="data" type="application/octet-stream">{told}</script>')
    leans, turns = arrays["axes"].reshape(-1, 3), arrays["turns"].reshape(len(arrays["axes"]) // 3, -1)
    assert np.ptp(turns, axis=0).min() >= 50.0
    for name, expected in (("b", [70.0, 70.0, -30.0]), ("c", [20.0, 50.0, 50.0])):  # curves over the program
        assert arrays[f"rotary_{name}_deg"][-3:].tolist() == expected
    assert [line["label"] for line in head["curves"][0]["lines"]] == ["B", "C"]
    for lean, angles in zip(leans, turns, strict=True):
        part, held = Rotation.identity(), Rotation.identity()
        for axis, angle in zip(head["machine"], angles, strict=True):
            turn = Rotation.from_rotvec(axis["sign"] * np.radians(angle) * np.array(axis["direction"]))
            part, held = (part * turn, held) if axis["table"] else (part, held * turn)
        assert part.inv().apply(lean) == pytest.approx(held.apply([0, 0, 1]), abs=1e-5)


def test_the_bundle_was_made_of_its_sources():
    """`npm ci && npm run build` in the folder of the front end makes it."""
    room = Path(vmachining.report.__file__).parent
    digest = hashlib.sha256()
    for path in sorted((room / "frontend" / "src").iterdir()):
        digest.update(f"{path.name}\n".encode() + path.read_bytes())
    digest.update((room / "frontend" / "package-lock.json").read_bytes())
    for name in ("report.js", "batch.js"):
        first = (room / "static" / name).read_text(encoding="utf-8").splitlines()[0]
        assert first.endswith(digest.hexdigest())


def test_sums_by_tool_and_the_rate_when_scheduled(page):
    result, text = page
    assert "Totals by tool" in text and "T1 flat 4 mm" in text
    assert f"{float(result.blocks['time_s'].sum()):,.1f}" in text
    rates = unpacked(text)[1]["scheduled_mrr_mm3_min"]
    assert np.array_equal(rates, result.schedule.after_rate.astype("<f4"), equal_nan=True)


def test_warnings_without_a_row_and_notes_about_all_volumes_are_shown(tmp_path):
    program = PROGRAM.replace("N130 M30", "N130 S900 M5\nM30")
    result = run(Job.load(write_job(tmp_path, program=program)))
    result.findings.append((14, "N125 (loose) <b>", "W999 a line that does not move"))
    result.summary["notes"].append("triangulated <i>within</i> 1 mm")
    write_report(result, tmp_path / "r.html")
    text = body((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert "W999 a line that does not move" in text and "N125 (loose) &lt;b&gt;" in text
    assert "triangulated &lt;i&gt;within&lt;/i&gt; 1 mm" in text and "None: no rapid met" not in text


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
