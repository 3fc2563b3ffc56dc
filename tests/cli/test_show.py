"""Figures, the comparison of strategies and the live report, of one small run."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import urllib.error
import urllib.request
import xml.etree.ElementTree as ET

import numpy as np
import polars as pl
import pytest
from tinyjob import FEED, JOB, write_job

from vmachining.cli.main import run as command
from vmachining.job import Job, run
from vmachining.report.live import Live, live_page, serve
from vmachining.report.paper import KINDS
from vmachining.report.paper.body import nearest_faces
from vmachining.report.payload import GROWING

TEXT = (
    JOB.replace("length_mm = 20", "length_mm = 20\nflutes = 2")
    + FEED.replace('"volume"', '"force"\nreferences = [50, 100]')
    + '\n[force]\ncoefficients = "aluminium_like_constant"\n'
)
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("show")
    run(Job.load(write_job(folder, job=TEXT)), engine="columns").write(folder / "out")
    (folder / "run.csv").write_text("time,line\n" + "".join(f"{k},{k}\n" for k in range(4, 14)))
    assert command(["times", "join", str(folder / "run.csv"), "--results", str(folder / "out")]) == 0
    return folder / "out"


def test_every_kind_is_drawn_in_every_format_and_twice_the_same(results, tmp_path, capsys):
    assert command(["figure", str(results), "--format", "svg,pdf", "--out", str(tmp_path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert not told["missing"] and len(told["files"]) == 2 * len(KINDS)
    for kind in KINDS:
        svg = ET.parse(tmp_path / f"figure_{kind}.svg").getroot()
        assert svg.tag == f"{SVG}svg" and svg.get("width").startswith(f"{174 / 25.4 * 72:.3f}"[:6])
        pdf = (tmp_path / f"figure_{kind}.pdf").read_bytes()
        assert b"/FontFile2" in pdf and b"/Type3" not in pdf  # TrueType outlines lie in the file
    before = (tmp_path / "figure_load.pdf").read_bytes()
    again = ["figure", str(results), "--kind", "load", "--format", "png,pdf", "--out", str(tmp_path)]
    assert command(again) == 0
    assert (tmp_path / "figure_load.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "figure_load.pdf").read_bytes() == before


def test_what_a_directory_lacks_is_said(results, tmp_path, capsys):
    copy = tmp_path / "out"
    shutil.copytree(results, copy)
    (copy / "strategies.csv").unlink()
    (copy / "stock.stl").unlink()
    assert command(["figure", str(copy), "--format", "svg"]) == 0
    told = capsys.readouterr().err
    assert "schedule: no comparison of strategies" in told and "stock: no stock.stl" in told
    assert command(["figure", str(copy), "--kind", "schedule"]) == 2
    assert command(["figure", str(tmp_path)]) == 2
    assert command(["figure", str(results), "--kind", "loads"]) == 2
    told = capsys.readouterr().err
    assert "[feed]" in told and "no result directory" in told and "expected load, bracket" in told


def test_the_nearest_face_of_a_pyramid_is_its_closed_form():
    corners = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [2, 2, 2.0]])
    faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 2, 1], [0, 3, 2]])
    depth, face = nearest_faces(corners, faces, np.array([-1.0, -1.0]), 0.125, (48, 48))
    x = -1.0 + 0.125 * (np.arange(48) + 0.5)
    away = np.maximum(np.abs(x[None, :] - 2.0), np.abs(x[:, None] - 2.0))
    inside = away < 2.0
    np.testing.assert_allclose(depth[inside], 2.0 - away[inside], atol=1e-12)
    assert (face[~inside] == -1).all() and set(np.unique(face[inside])) == {0, 1, 2, 3}


def test_strategies_shows_the_table_of_the_run(results, capsys):
    assert command(["strategies", str(results), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["strategies"]
    assert told == pl.read_csv(results / "strategies.csv", infer_schema_length=None).to_dicts()
    assert command(["strategies", str(results)]) == 0
    assert "as programmed" in capsys.readouterr().out


def ask(port: int, path: str, host: str | None = None) -> tuple[int, bytes]:
    request = urllib.request.Request(
        f"http://127.0.0.1:{port}/{path}", headers={"Host": host} if host else {}
    )
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(request, timeout=10) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as exc:
        return exc.code, b""


def test_the_server_hands_out_results_and_nothing_else(results):
    live = Live(results, "tiny")
    server = serve(live)
    port = server.server_port
    try:
        assert ask(port, "")[0] == 200
        assert ask(port, "report.html?1") == (200, (results / "report.html").read_bytes())
        assert ask(port, "blocks.csv")[1] == (results / "blocks.csv").read_bytes()
        for path in ("../job.toml", "%2e%2e/job.toml", "manifest.json.bak", "/etc/passwd"):
            assert ask(port, path)[0] == 404
        assert ask(port, "report.html", host="example.org")[0] == 403
        live.progress("program", 3, 7)
        state = json.loads(ask(port, "state.json")[1])
        assert (state["done"], state["total"]) == (3, 7) and state["version"] != "0"
    finally:
        server.shutdown()
        server.server_close()


def test_a_run_in_hand_shows_its_path_and_the_rows_it_has_made(results, tmp_path):
    """The rows of the table, a torn last one left out; nothing of it where no run is in hand."""
    lines = (results / "blocks.csv").read_text(encoding="utf-8").splitlines()
    (tmp_path / "blocks.partial.csv").write_text("\n".join(lines[:4]) + "\n" + lines[4][:9], encoding="utf-8")
    live = Live(tmp_path, "tiny", page=live_page(Job.load(results.parent / "job.toml")))
    server = serve(live)
    port = server.server_port
    try:
        assert b"connect-src 'self'" in ask(port, "run.html")[1]
        rows = json.loads(ask(port, "rows.json?from=1")[1])["rows"]
        table = pl.read_csv(results / "blocks.csv", infer_schema_length=None)[1:3]
        names = ("block", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "mrr_mm3_min")
        assert [tuple(row) for row in rows] == table.select(names).rows()
        assert json.loads(ask(port, "rows.json?from=-1;drop")[1])["rows"][0][0] == 0
        live.page = ""
        assert ask(port, "run.html")[0] == 404
    finally:
        server.shutdown()
        server.server_close()


def test_view_of_a_directory_prints_its_address_and_ends_with_an_interruption(results, tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", "from vmachining.cli import main; main()", "view", str(results)],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"},
        # a script that has put these tests into the background has told them to ignore it
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    try:
        address = process.stdout.readline().strip()
        assert ask(int(address.rstrip("/").rpartition(":")[2]), "report.html")[0] == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20) == 0
    finally:
        process.kill()
    assert command(["view", str(tmp_path)]) == 2


CUT_SHORT = """
import sys, threading, time
from pathlib import Path
from vmachining.report.live import Live
from vmachining.report.payload import GROWING

path, over = Path(sys.argv[1]) / "blocks.partial.csv", threading.Event()
text = ",".join(["block", *GROWING]) + "\\n"
text += "".join(f"{k}" + ",1.5" * len(GROWING) + "\\n" for k in range(60_000))

def start_anew():
    while not over.is_set():
        path.write_text(text)

writer = threading.Thread(target=start_anew)
writer.start()
end, live = time.monotonic() + 1.0, Live(path.parent, "tiny")
while time.monotonic() < end:
    live.rows(59_000)
over.set()
writer.join()
"""


def test_rows_are_asked_for_while_a_run_starts_anew(tmp_path):
    """The table is cut short under its reader: a file mapped into memory then kills the process (SIGBUS)."""
    done = subprocess.run(
        [sys.executable, "-c", CUT_SHORT, str(tmp_path)], capture_output=True, check=False, text=True
    )
    assert done.returncode == 0, done.stderr


def test_the_live_view_shows_whole_rows_and_reads_each_of_them_once(tmp_path):
    live, path = Live(tmp_path, "tiny"), tmp_path / "blocks.partial.csv"
    head = ",".join(["block", *GROWING]) + "\n"
    air = "".join(
        f"{k},0.0,0.0,0.0,\n" for k in range(150)
    )  # no rate for so long that no number is guessed from it
    path.write_text(head + air + "150,1.5,1.25,1.75,90.5\n151,2.5,2.25,2.7")
    found = live.rows(0)
    assert [row[0] for row in found] == list(range(151))  # of 151 the upper end is not written yet
    assert found[0] == [0, 0.0, 0.0, 0.0, None] and found[150] == [150, 1.5, 1.25, 1.75, 90.5]
    assert live.rows(151) == []
    with path.open("a") as file:
        file.write("5,\n152,3.0,3.0,3.0,\n")
    path.write_bytes(path.read_bytes().replace(b"\n10,", b"\nxx,"))  # nobody looks there again
    assert live.rows(151) == [[151, 2.5, 2.25, 2.75, None], [152, 3.0, 3.0, 3.0, None]]
    path.write_text(head + "".join(f"{k},7.0,7.0,7.0,\n" for k in range(400)))  # a run that started anew
    assert live.rows(153) == [[k, 7.0, 7.0, 7.0, None] for k in range(153, 400)]
    path.write_text(head + "0,8.0,8.0,8.0,\n")
    assert live.rows(400) == [] and live.rows(0) == [[0, 8.0, 8.0, 8.0, None]]
