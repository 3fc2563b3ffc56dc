"""A result directory served on loopback: the report in a frame, with what a run is doing above it; and the page of a path,
without a job (backplot) or while its run is in hand.

The server hands out files that the manifest of the directory names, and nothing else; it answers only requests that
name this machine as their host, so that no page from elsewhere can read along.
"""

from __future__ import annotations

import json
import threading
from dataclasses import dataclass, field
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from vmachining.errors import InputError, JobError
from vmachining.job import Job
from vmachining.job.files import read_manifest, write_atomic
from vmachining.job.folder import WORKING
from vmachining.job.reading import read_job_program
from vmachining.job.toolpath import Toolpath
from vmachining.report.numbers import chip, number, plural
from vmachining.report.page import PLOT_NOTE, rendered
from vmachining.report.payload import GROWING, path_payload

LOOPBACK = "127.0.0.1"
REPORT = "report.html"
MOST_ROWS = 5_000
"""Rows of one answer; the page asks again."""

KINDS = {
    ".html": "text/html; charset=utf-8", ".csv": "text/csv; charset=utf-8", ".json": "application/json",
    ".nc": "text/plain; charset=utf-8", ".parquet": "application/vnd.apache.parquet", ".stl": "model/stl", ".3mf": "model/3mf",
    ".glb": "model/gltf-binary",
    ".step": "model/step", ".svg": "image/svg+xml", ".png": "image/png", ".pdf": "application/pdf",
}  # fmt: skip
"""Content types of the files of a result directory."""


@dataclass(slots=True, eq=False)
class Live:
    """What the page shows. folder : results. name : of the job. message : of a run that failed, or empty.

    stage, done, total : of the run in hand, as its progress tells them; total 0: none runs.
    page : of the run in hand, see `live_page`; empty where none exists.
    """

    folder: Path
    name: str
    message: str = ""
    stage: str = ""
    done: int = 0
    total: int = 0
    page: str = ""
    _next: tuple[int, int] = (-1, 0)
    """Block that a page asks for next, and the byte at which its row will begin."""
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def progress(self, stage: str, done: int, total: int) -> None:
        with self._lock:
            self.stage, self.done, self.total = stage, done, total

    def ended(self, message: str = "") -> None:
        """No run is in hand any more; `message` says why it failed."""
        with self._lock:
            self.stage, self.done, self.total, self.message = "", 0, 0, message

    def state(self) -> dict[str, Any]:
        """What the page asks for once a second; `version` changes with the report."""
        report = self.folder / REPORT
        try:
            version = report.stat().st_mtime_ns if REPORT in self.outputs() else 0
        except OSError:
            version = 0
        with self._lock:
            return {
                "name": self.name, "stage": self.stage, "done": self.done, "total": self.total, "message": self.message,
                "version": str(version), "live": bool(self.page),
            }  # fmt: skip

    def rows(self, first: int) -> list[list[float | None]]:
        """Rows from block `first` on that the run in hand has made: block and `GROWING`, at most `MOST_ROWS`."""
        import polars as pl

        kinds = {"block": pl.Int64, **dict.fromkeys(GROWING, pl.Float64)}
        try:
            # read, not mapped: a run that starts anew cuts the file short, and a mapped page that is gone kills the process
            data = b"".join(self._lines(first))
            found = pl.read_csv(
                data, columns=list(kinds), schema_overrides=kinds, truncate_ragged_lines=True, ignore_errors=True,
            )  # fmt: skip
        except (OSError, ValueError, pl.exceptions.PolarsError):  # no table yet, or one that starts anew
            return []
        return [list(row) for row in found.drop_nulls(["block", "removed_mm3"]).iter_rows()]

    def _lines(self, first: int) -> list[bytes]:
        """Header and rows from block `first` on, those that are written to their end.

        A page asks about once a second. Where the next row begins is kept, so that a long table is not read from its beginning
        each time.
        """
        with (self.folder / WORKING[0]).open("rb") as file:
            lines, (block, at) = [file.readline()], self._next
            begin = len(lines[0])
            if block == first and at > begin:
                file.seek(at - 1)
                whole = file.read(1) == b"\n"
                row = file.readline()
                if whole and (not row or row.startswith(b"%d," % first)):  # else the run has started anew
                    begin = at
            file.seek(begin)
            for line in file:
                if not line.endswith(b"\n") or len(lines) > MOST_ROWS:
                    break
                begin += len(line)
                if (block := int(line.partition(b",")[0])) >= first:
                    lines.append(line)
                    self._next = block + 1, begin
        return lines

    def outputs(self) -> list[str]:
        """Files that a run has completed."""
        try:
            manifest = read_manifest(self.folder) or {}
        except JobError:
            return []
        return [str(name) for name in manifest.get("outputs", ())] if manifest.get("complete") else []


class _Handler(BaseHTTPRequestHandler):
    server: _Server

    def do_GET(self) -> None:
        live, port = self.server.live, self.server.server_port
        if self.headers.get("Host") not in (f"{LOOPBACK}:{port}", f"localhost:{port}"):
            self.send_error(HTTPStatus.FORBIDDEN, "use the name of this machine")
            return
        name = unquote(urlsplit(self.path).path).lstrip("/")
        if not name:
            self._answer((files("vmachining.report") / "live.html").read_bytes(), KINDS[".html"])
        elif name == "state.json":
            self._answer(json.dumps(live.state()).encode(), KINDS[".json"])
        elif name == "run.html" and live.page:
            self._answer(live.page.encode(), KINDS[".html"])
        elif name == "rows.json":
            query = parse_qs(urlsplit(self.path).query).get("from", ["0"])[0]
            first = int(query) if query.isascii() and query.isdigit() and len(query) < 12 else 0
            self._answer(json.dumps({"rows": live.rows(first)}).encode(), KINDS[".json"])
        elif name in live.outputs() and "/" not in name:
            try:
                data = (live.folder / name).read_bytes()
            except OSError:
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            self._answer(data, KINDS.get(Path(name).suffix, "application/octet-stream"))
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _answer(self, data: bytes, kind: str) -> None:
        self.send_response(HTTPStatus.OK)
        heads = {"Content-Type": kind, "Content-Length": str(len(data)), "Cache-Control": "no-store"}
        for name, value in {**heads, "X-Content-Type-Options": "nosniff"}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, format: str, *args: Any) -> None:
        """Requests are nobody's business."""


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, live: Live, port: int) -> None:
        self.live = live
        super().__init__((LOOPBACK, port), _Handler)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that has left in the middle of an answer is not an error."""


def serve(live: Live, port: int = 0) -> ThreadingHTTPServer:
    """A server that answers in a thread of its own until its `shutdown`; `server_port` is where.

    Raises InputError: The port is taken.
    """
    try:
        server = _Server(live, port)
    except OSError as exc:
        raise InputError(f"port {port}: {exc.strerror or exc}", remedy="take another, or 0 for any") from exc
    threading.Thread(target=server.serve_forever, name="vmachining-view", daemon=True).start()
    return server


MAX_FINDINGS = 200
"""Rows of the table; `nc check` prints them all."""


def write_backplot(toolpath: Toolpath, path: Path) -> None:
    """Write one page with the path, the program and the feeds to `path`, whole or not at all."""
    write_atomic(path, _page(toolpath, None))


def live_page(job: Job) -> str:
    """The page of a run in hand: path, program, tools and raw stock; it asks its server for rows and cuts along.

    Raises VMachiningError: Program, tools or stock cannot be used.
    """
    return _page(Toolpath.of(read_job_program(job), job.machine), job)


def _page(toolpath: Toolpath, job: Job | None) -> str:
    program, data = toolpath.program, path_payload(toolpath, job)
    found = [(f.line, f.code, f.word, f.message) for f in program.findings[:MAX_FINDINGS]]
    tools = plural(len({block.tool for block in toolpath.blocks}), "tool")
    errors = len(program.errors)
    note = "Drag to turn, wheel to zoom; click the path to mark its block."
    if data.stride > 1:
        note += f" One motion in {data.stride} is drawn."
    if data.field:
        note += f" {data.played}"
    return rendered(
        "backplot.html.j2", data,
        name=Path(program.name).name if job is None else job.name,
        subtitle=f"{program.dialect} · {plural(len(toolpath.blocks), 'block')} that move · {tools} · all lengths in mm",
        chips=[chip("bad", plural(errors, "error")) if errors else chip("ok", "reads clean"),
               chip("", f"path {number(sum(p.length for p in toolpath.paths), 5)} mm")],
        picture=None, view_note=note, schedule=None, live=job is not None,
        plot_note=PLOT_NOTE,
        findings=found if job is None else [],
    )  # fmt: skip
