"""engage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from vmachining.cli.judge_commands import Engage
from vmachining.cli.main import Code
from vmachining.cli.options import belong
from vmachining.cli.screen import emit, note, progress_bar
from vmachining.errors import EngineError, InputError, SweepError
from vmachining.job import Job
from vmachining.job import engage as engaged
from vmachining.job.folder import engagement_files, engagement_folder

MOST_CHIPS = 2000
"""Positions whose chips are drawn in one picture."""


def engage(o: Engage) -> int:
    job, block, at, out, as_json = Job.load(o.job), o.block, o.at, o.out, o.as_json
    names = ("method", "angles", "phase", "edge", "bottom", "seconds", "pitch")
    options: dict[str, Any] = {name: getattr(o, name) for name in names}
    if o.every is not None or o.chips or o.section is not None or not block.strip().isdecimal():
        return _many(job, o, options, out or Path("out") / f"{job.name}-engagement")
    if out is not None:
        engagement_folder(out).refuse_foreign(job.inputs)
    try:
        found = engaged(job, int(block), at=at, **options)
    except (EngineError, SweepError) as exc:
        if o.method != "brep":
            raise
        # not a bug of ours: no solid, or OCCT gave up; the other method has an answer
        note(f"vmachining: {exc}{'' if exc.remedy else '; take --method dexel, or more --seconds'}")
        return Code.FINDINGS
    if out is not None:
        from vmachining.report import write_engagement

        paths = write_engagement(found, out, name=job.name)
        note(f"wrote {', '.join(path.name for path in paths)} to {out}", quiet=as_json)
    if as_json:
        emit(found.to_dict())
        return Code.DONE
    print(f"{job.name}: block {block}, line {found.line}, at {at:g}, method {o.method}")
    for name, words in (*found.facts.items(), *(("note", text) for text in found.notes)):
        print(f"  {name:<8}  {words}")
    return Code.DONE


def _chips(out: Path) -> list[Path]:
    """The table as text, and a picture of the chips."""
    import polars as pl

    from vmachining.report.paper import ChipTable, draw_chips, write_figures

    pl.read_parquet(out / "chips.parquet").write_csv(out / "chips.csv")
    found = ChipTable.load(out)
    if not found.scaled:
        note(
            "areas and thicknesses are per mm of feed per tooth: the job lacks flutes, a spindle speed or a feed"
        )
    return [out / "chips.csv", *write_figures({"chips": draw_chips(found)}, out, ["png"])]


def _many(job: Job, o: Engage, options: dict[str, Any], out: Path) -> int:
    """`--block all|7,10-20`, `--every MM`: tables on disk, a summary on the screen."""
    import polars as pl

    from vmachining.job.engage import Scene
    from vmachining.job.engage_many import engage_many, positions
    from vmachining.job.section import section_table
    from vmachining.report.paper import draw_section, write_figures

    scene = Scene.of(job)
    if o.every is not None:
        belong(o, ("at",), "is one place of a block, and --every has many")
    asked = positions(scene, o.block, at=o.at, every_mm=o.every)
    if o.chips and len(asked) > MOST_CHIPS:
        remedy = "take fewer blocks, or a longer --every"
        raise InputError(f"--chips of {len(asked)} positions, {MOST_CHIPS} at most", remedy=remedy)
    if o.section is not None and o.edge != "straight":
        raise InputError("--section takes the straight edge: a wound one lies in no plane")
    with engagement_files(out, job.inputs):
        with progress_bar(quiet=o.as_json) as progress:
            table = engage_many(
                job, asked, out, workers=o.workers, progress=progress, chips=o.chips, **options
            )
        files = ["engagement.parquet", "positions.parquet", "positions.csv"]
        unanswered = int(table["tip_x_mm"].null_count())
        if o.chips and unanswered < len(asked):
            files += ["chips.parquet", "chip_points.parquet", *(path.name for path in _chips(out))]
        if o.section is not None:
            found = section_table(scene, pl.read_parquet(out / "engagement.parquet"), o.section)
            found.write_parquet(out / "section.parquet")
            drawn = write_figures({"section": draw_section(found)}, out, ["png"])
            files += ["section.parquet", *(path.name for path in drawn)]
    if o.as_json:
        emit({"positions": len(table), "unanswered": unanswered, "out": str(out), "files": files})
    else:
        air = int((table["arcs"] == 0).sum())
        print(f"{job.name}: {len(table)} positions, {air} in air, {unanswered} without an answer")
        deepest, longest = (
            table[name].fill_null(0.0).to_numpy().max() for name in ("ap_mm", "length_max_mm")
        )
        print(f"  axial     at most {deepest:.6f} mm")
        print(f"  cut       at most {longest:.6f} mm of the edge")
        print(f"  files     {', '.join(files)} in {out}")
        for row in table.filter(table["tip_x_mm"].is_null()).head(3).iter_rows(named=True):
            print(f"  block {row['block']} at {row['at']:.4g}: {row['note']}")
    return Code.FINDINGS if unanswered else Code.DONE
