"""engage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note, progress_bar
from vmachining.errors import EngineError, InputError, SweepError
from vmachining.job import Job
from vmachining.job import engage as engaged
from vmachining.job.folder import engagement_files, engagement_folder

__all__ = ["engage"]

MOST_CHIPS = 2000
"""Positions whose chips are drawn in one picture."""


def engage(
    file: Path,
    *,
    block: str,
    at: float,
    every: float | None,
    method: str,
    angles: int,
    phase: float,
    edge: str,
    bottom: bool,
    seconds: float,
    pitch: float,
    out: Path | None,
    workers: int,
    chips: bool,
    as_json: bool,
) -> int:
    """`vmachining engage`."""
    job = Job.load(file)
    options: dict[str, Any] = {
        "method": method, "angles": angles, "phase": phase, "edge": edge, "bottom": bottom, "seconds": seconds,
        "pitch": pitch,
    }  # fmt: skip
    if every is not None or chips or not block.strip().isdecimal():
        return _many(
            job,
            block,
            at,
            every,
            options,
            out or Path("out") / f"{job.name}-engagement",
            workers,
            chips,
            as_json,
        )
    if out is not None:
        engagement_folder(out).refuse_foreign(job.inputs)
    try:
        found = engaged(job, int(block), at=at, **options)
    except (EngineError, SweepError) as exc:
        if method != "brep":
            raise
        # not a bug of ours: no solid, or OCCT gave up; the other method has an answer
        note(f"vmachining: {exc}{'' if exc.remedy else '; take --method dexel, or more --seconds'}")
        return Code.FINDINGS
    if out is not None:
        from vmachining.report import write_engagement

        paths = write_engagement(found, out, name=job.name)
        note(f"wrote {', '.join(path.name for path in paths)} to {out}", quiet=as_json)
        if not any(path.suffix == ".png" for path in paths):
            note("no PNG: matplotlib is not installed (pip install 'vmachining[notebooks]')", quiet=as_json)
    if as_json:
        emit(found.to_dict())
        return Code.DONE
    s = found.summary
    arcs = s["arcs_feed_deg"] if s["arcs_feed_deg"] is not None else s["arcs_deg"]
    turned = (
        "from the feed (90 degrees is straight ahead)" if s["arcs_feed_deg"] is not None else "of the tool"
    )
    tip, axis = (", ".join(f"{v:.6g}" for v in s[key]) for key in ("tip_mm", "axis"))
    print(f"{job.name}: block {block}, line {s['line']}, at {at:g}, method {method}")
    print(f"  tool      tip ({tip}) mm, axis ({axis})")
    if found.is_air:
        print("  engaged   nowhere: air")
    else:
        told = ", ".join(f"{a:.6f} to {b:.6f}" for a, b in arcs) + f" degrees {turned}"
        told = "all round" if found.is_round else told
        deep = "feed along the axis" if s["ae_mm"] is None else f"radial {s['ae_mm']:.6f} mm"
        print(f"  engaged   {told}")
        print(f"  depth     axial {s['ap_mm']:.6f} mm, {deep}")
        print(f"  cut       at most {s['length_max_mm']:.6f} mm of the edge")
        print(f"  surface   {s['area_mm2']:.6g} mm2, {100 * s['area_fraction']:.4g} % of what cuts")
        if s["removal_mm3_per_mm"] is not None:
            print(f"  removes   {s['removal_mm3_per_mm']:.6g} mm3 per mm of path")
    for text in s["notes"]:
        print(f"  note      {text}")
    return Code.DONE


def _chips(out: Path) -> list[Path]:
    """Pictures of the chips over the time of the program."""
    import polars as pl

    from vmachining.report import write_chips

    table = pl.read_parquet(out / "chips.parquet")
    time = table.group_by("position", maintain_order=True).agg(pl.col("time_s").first())["time_s"]
    if table["feed_per_tooth_mm"].null_count():
        note(
            "areas and thicknesses are per mm of feed per tooth: the job lacks flutes, a spindle speed or a feed"
        )
    return write_chips(table, out, time=time.to_numpy())


def _many(
    job: Job,
    blocks: str,
    at: float,
    every: float | None,
    options: dict[str, Any],
    out: Path,
    workers: int,
    chips: bool,
    as_json: bool,
) -> int:
    """`--block all|7,10-20`, `--every MM`: tables on disk, a summary on the screen."""
    from vmachining.job.engage import Scene
    from vmachining.job.engage_many import engage_many, positions

    asked = positions(Scene.of(job), blocks, at=at, every_mm=every)
    if chips and len(asked) > MOST_CHIPS:
        raise InputError(
            f"--chips of {len(asked)} positions, {MOST_CHIPS} at most",
            remedy="take fewer blocks, or a longer --every",
        )
    with engagement_files(out, job.inputs):
        with progress_bar(quiet=as_json) as progress:
            table = engage_many(job, asked, out, workers=workers, progress=progress, chips=chips, **options)
        files = ["engagement.parquet", "positions.parquet", "positions.csv"]
        unanswered = int(table["tip_x_mm"].null_count())
        if chips and unanswered < len(asked):
            files += ["chips.parquet", *(path.name for path in _chips(out))]
    if as_json:
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
