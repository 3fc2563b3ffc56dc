"""toolpath pocket."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from vmachining.cli.main import Code
from vmachining.cli.nc_commands import Pocket
from vmachining.cli.screen import emit, told
from vmachining.errors import InputError
from vmachining.job.files import write_atomic


def pocket(o: Pocket) -> int:
    from vmachining.toolpath import MODES, STRATEGIES, Triangle, advice, pocket_lengths
    from vmachining.toolpath.pocket import level_program, pocket_job

    sides, radius, out, plot = o.sides, o.radius, o.out, o.plot
    given = None if o.angles is None else _angles(o.angles)
    best = advice(*sides, radius)
    rows: list[dict[str, Any]] = []
    for name in STRATEGIES:
        books = {
            mode: pocket_lengths(*sides, radius, strategy=name, mode=mode, angles=given).length
            for mode in MODES[1:]
        }
        true = next(p for p in best if p.strategy == name)
        rows.append(
            {
                "strategy": name, "length_mm": true.length, **{f"{mode}_mm": value for mode, value in books.items()},
                "passes": true.passes, "uncovered_mm2": true.uncovered_area, "gouge_mm2": true.gouge_area,
            }
        )  # fmt: skip
    chosen = best[0] if o.strategy is None else next((p for p in best if p.strategy == o.strategy), None)
    if chosen is None:
        raise InputError(f"unknown strategy {o.strategy!r}", remedy=f"one of {', '.join(STRATEGIES)}")
    warnings = [text for text in (Triangle.of(*sides, radius, angles=given).misfit,) if text]
    files: list[Path] = []
    if out is not None:
        if not out.name or out.suffix == ".toml":
            raise InputError(f"--out {str(out)!r} names the program, for instance pocket.nc")
        job = out.with_suffix(".toml")
        if taken := [str(path) for path in (out, job) if path.exists()]:
            raise InputError(
                f"{', '.join(taken)} exists", remedy="choose another --out; existing files are not replaced"
            )
        title = f"TRIANGULAR POCKET {' '.join(f'{v:g}' for v in sides)} R{radius:g} {chosen.strategy.upper()}"
        text = level_program(
            chosen.path, depth_mm=o.depth, step_mm=o.step or o.depth, feed_mm_min=o.feed,
            plunge_mm_min=o.plunge or o.feed / 3.0, title=title,
        )  # fmt: skip
        write_atomic(out, text)
        write_atomic(job, pocket_job(Triangle.of(*sides, radius), out.name, depth_mm=o.depth))
        files = [out, job]
    if plot is not None:
        from vmachining.report.paper import is_picture, write_figure
        from vmachining.report.pockets import draw_pockets, write_pocket_page

        if is_picture(plot, "--plot"):
            write_figure(draw_pockets(Triangle.of(*sides, radius), best), plot)
        else:
            write_pocket_page(Triangle.of(*sides, radius), best, plot)
        files.append(plot)
    if o.as_json:
        emit(
            {
                "strategies": rows, "shortest": best[0].strategy, "chosen": chosen.strategy, "path_mm": chosen.path.tolist(),
                "warnings": warnings, "files": [str(path) for path in files],
            }
        )  # fmt: skip
        return Code.DONE
    print("strategy  true length  as published  corrected  passes  uncovered  gouge")
    for row in sorted(rows, key=lambda row: row["length_mm"]):
        print(
            f"{row['strategy']:8}  {row['length_mm']:11.4f}  {row['book_mm']:12.4f}  {row['book_corrected_mm']:9.4f}  "
            f"{row['passes']:6d}  {row['uncovered_mm2']:9.4f}  {row['gouge_mm2']:.4f}"
        )
    print(f"shortest: {best[0].strategy}, {best[0].length:.4f} mm")
    told(warnings, files)
    return Code.DONE


def _angles(text: str) -> tuple[float, float, float]:
    try:
        alpha, beta, gamma = (float(part) for part in text.split(","))
    except ValueError as exc:
        raise InputError(f"--angles {text!r}: expected three degrees such as 90,53,37") from exc
    return alpha, beta, gamma
