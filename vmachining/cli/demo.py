"""demo, and the models that come with the package."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

from vmachining.cli.job_commands import Demo, RunOptions
from vmachining.cli.jobs import run_job
from vmachining.cli.main import Code
from vmachining.cli.screen import emit
from vmachining.errors import InputError

ENGINES_OF_DEMOS = {"mould_cover": "vectors"}
"""Models that show another engine than that of `run`: vectors measure a part."""


def demo(o: Demo) -> int:
    if o.listed:
        return _list_demos(as_json=o.as_json)
    options = RunOptions(engine=ENGINES_OF_DEMOS.get(o.name), stock=o.stock)
    return run_job(demo_job(o.name), options, out=o.out, quiet=o.quiet, as_json=o.as_json)


def _list_demos(*, as_json: bool) -> int:
    """`vmachining demo --list`: seconds are of a processor, kernels compiled."""
    for name, job in demo_models().items():
        about, seconds = _said(job.parent / "README.md")
        if as_json:
            emit({"name": name, "about": about, "job": str(job), "processor_s": seconds})
        else:
            print(f"{name:<20}  {'' if seconds is None else f'{seconds:g} s':>6}  {about}")
    return Code.DONE


def _said(readme: Path) -> tuple[str, float | None]:
    """First sentence of a model's page, after its heading; seconds of a processor that it states."""
    text = readme.read_text(encoding="utf-8") if readme.is_file() else ""
    parts = [part for part in text.split("\n\n") if part.strip() and not part.startswith("#")]
    words = " ".join(parts[0].split()) if parts else ""
    found = re.search(r"^Processor time of `vmachining demo \w+`: ([\d.]+) s", text, flags=re.MULTILINE)
    about = re.split(r"(?<=[.:;])\s", words, maxsplit=1)[0].rstrip(".:;")
    return about, float(found[1]) if found else None


def demo_models() -> dict[str, Path]:
    """Job of each shipped model by its name: inside an installed package, or next to it in a source tree."""
    package = Path(str(files("vmachining")))
    for root in (package / "models", package.parent / "models"):
        jobs = sorted(root.glob("*/job.toml"))
        if jobs:
            return {job.parent.name: job for job in jobs}
    raise InputError("no models are installed with this package")


def demo_job(name: str = "slot") -> Path:
    known = demo_models()
    if name not in known:
        raise InputError(f"no model {name!r}", remedy=f"one of {', '.join(known)}")
    return known[name]
