"""view."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path

from vmachining.cli.job_commands import RunOptions, View
from vmachining.cli.jobs import run_job
from vmachining.cli.main import Code
from vmachining.cli.screen import note
from vmachining.errors import InputError, VMachiningError
from vmachining.job import Job
from vmachining.job.batch import safe_name
from vmachining.job.files import read_manifest
from vmachining.report.backplot import live_page
from vmachining.report.live import LOOPBACK, REPORT, Live, serve

LOOK_SECONDS = 0.5
"""Between two looks at the files of a job."""


def view(o: View) -> int:
    """`vmachining view`: serves until Ctrl-C; of a job, runs it first and whenever its files change."""
    target = o.target
    if target.is_dir():
        if o.engine is not None:
            raise InputError(
                f"--engine {o.engine}: {target} is a result, and nothing is cut", remedy="give the job"
            )
        manifest = read_manifest(target)
        if manifest is None or REPORT not in manifest.get("outputs", ()):
            raise InputError(
                "no result directory with a report", file=target, remedy="give a job file, or what run had as --out"
            )  # fmt: skip
        live = Live(target, str(manifest.get("job", target.name)))
    else:
        job = Job.load(target)
        live = Live(o.out if o.out is not None else Path("out") / safe_name(job.name), job.name)
    server = serve(live, o.port)
    try:
        print(f"http://{LOOPBACK}:{server.server_port}/", flush=True)
        note("Ctrl-C ends it")
        if not target.is_dir():
            return _runs(target, live, o.engine, o.once)
        while True:
            time.sleep(3600.0)
    except KeyboardInterrupt:
        return Code.DONE
    finally:
        server.shutdown()


def _runs(file: Path, live: Live, engine: str | None, once: bool) -> int:
    """Run the job, then look at its files; a failure of the first run is that of the command."""
    first = True
    while True:
        seen = _times(file)
        live.progress("program", 0, 1)
        try:
            live.page = live_page(Job.load(file))
            code = run_job(file, RunOptions(engine=engine), out=live.folder, told=live.progress)
            if code == Code.INTERRUPTED:
                return code
            live.ended()
        except (VMachiningError, OSError) as exc:
            if first:
                raise
            live.ended(str(exc))
            note(f"vmachining: {exc}")
        first = False
        while once or _times(file) == seen:
            time.sleep(LOOK_SECONDS)
        note("files have changed: running again")


def _times(file: Path) -> dict[str, float | None]:
    """When the files of a job were changed; the job file alone where it cannot be read."""
    found: dict[str, float | None] = {}
    paths = [file]
    with suppress(VMachiningError, OSError):
        paths += Job.load(file).inputs.values()
    for path in paths:
        try:
            found[str(path)] = path.stat().st_mtime
        except OSError:
            found[str(path)] = None
    return found
