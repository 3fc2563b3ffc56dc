"""sweep and bench."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note, status_line
from vmachining.errors import InputError

__all__ = ["bench", "sweep"]

STEP_MARK, PLOT_MARK = b"'vmachining'", b"vmachining sweep"
"""What tells files of this command from others: the system a STEP file comes from, the generator of a page."""


def sweep(name: str, *, chord: float, step: Path | None, brep: bool, plot: Path | None, as_json: bool) -> int:
    """`vmachining sweep`."""
    if not (math.isfinite(chord) and chord > 0):
        raise InputError(f"--chord {chord}: want a positive number")
    if step is not None and not brep:
        raise InputError(
            "--step writes the B-rep solid, which --no-brep leaves out", remedy="drop one of them"
        )
    if plot is not None and plot.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"--plot {plot}: want a name that ends in .html")
    from vmachining.job.folder import refuse_target
    from vmachining.job.sweepfile import read_sweep

    if step is not None:
        refuse_target(step, {"sweep": Path(name)}, STEP_MARK)
    if plot is not None:
        refuse_target(plot, {"sweep": Path(name)}, PLOT_MARK)
    found = read_sweep(name)
    from vmachining.job.single import sweep_record

    with status_line() as said:
        record = sweep_record(found, chord, step, said, brep=brep)
        if plot is not None:
            said(f"writing {plot.name}")
            from vmachining.report.sweep import plot_sweep

            plot_sweep(plot, found, chord)
    refused = record.get("step_refused")
    code = Code.FINDINGS if refused else Code.DONE
    if refused:
        note(f"vmachining: {step} was not written: {refused}")
    if as_json:
        emit(record)
        return code
    print(f"{record['volume_mm3']:.9g} mm3   [{record['lo_mm3']:.9g}, {record['hi_mm3']:.9g}]")
    if record["brep_mm3"] is not None:
        fit = f", splines within {record['brep_fit_mm']:.1g} mm" if record["brep_fit_mm"] else ""
        print(f"{record['brep_mm3']:.9g} mm3   B-rep, {record['brep_faces']} faces{fit}")
    elif brep:
        print(f"no B-rep value: {record['brep_note']}")
    return code


def bench(
    names: list[str],
    *,
    listed: bool,
    blocks: int | None,
    seeds: str | None,
    journal: Path | None,
    as_json: bool,
) -> int:
    """`vmachining bench`."""
    from vmachining.bench import CASES, SEEDED, SIZED, case, described

    for name in names:
        if name not in CASES:
            raise InputError(f"unknown case {name!r}", remedy=f"known: {', '.join(sorted(CASES))}")
    if listed:
        for name in names or sorted(CASES):
            about, takes = described(name)
            if as_json:
                emit({"case": name, "about": about, "takes": takes})
            else:
                print(f"{name:<19}  {takes:<14}  {about}")
        return Code.DONE
    options = _seeded(seeds, journal)
    if options and not (names and set(names) <= set(SEEDED)):
        raise InputError("--seeds and --journal belong to one case", remedy=f"name {', '.join(SEEDED)}")
    if blocks is not None:
        if options or not (names and set(names) <= set(SIZED)):
            raise InputError("--blocks belongs to some cases", remedy=f"name {', '.join(SIZED)}")
        options["blocks"] = blocks
    for name in names or sorted(CASES):
        for record in case(name)(**options):
            emit(record)
            sys.stdout.flush()
    return Code.DONE


def _seeded(seeds: str | None, journal: Path | None) -> dict[str, Any]:
    """Arguments of a case that goes by seeds."""
    options: dict[str, Any] = {} if journal is None else {"journal": journal}
    if seeds is not None:
        try:
            first, last = (int(word) for word in seeds.split(":"))
        except ValueError as exc:
            raise InputError(f"--seeds {seeds!r} is no range", remedy="want FIRST:LAST, like 0:200") from exc
        options |= {"first": first, "blocks": last - first}
    return options
