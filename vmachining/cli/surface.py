"""toolpath drop and toolpath surface."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note
from vmachining.errors import InputError
from vmachining.job.files import write_atomic
from vmachining.job.part import read_part
from vmachining.machine import load
from vmachining.toolpath.clpath import WRITERS, CLPath, Mark, cutter, path_job
from vmachining.toolpath.facets import FacetMesh, Surface, radii
from vmachining.toolpath.rotary import rotary_program

__all__ = ["drop", "surface"]


def drop(
    part: Path,
    *,
    points: str,
    tool: str | None,
    chord: float,
    floor: float | None,
    scale: float,
    as_json: bool,
) -> int:
    """`vmachining toolpath drop`."""
    mesh = read_part(part, chord_mm=chord, scale=scale)
    where = _points(points, mesh)
    model = Surface(mesh)
    warnings = list(mesh.notes)
    rows: list[dict[str, Any]] = []
    if tool is None:
        z, which = model.heights(where)
        kinds = ["facet" if k >= 0 else "none" for k in which]
    else:
        found = model.drop(where, *radii(cutter(tool)), floor=-np.inf if floor is None else floor)
        z, which = found.z, found.triangle
        kinds = [("none", "vertex", "edge", "facet")[k] for k in found.kind]
    for (x, y), height, facet, kind in zip(where.tolist(), z.tolist(), which.tolist(), kinds, strict=True):
        known = bool(np.isfinite(height))
        rows.append(
            {"x_mm": x, "y_mm": y, "z_mm": height if known else None, "contact": kind, "facet": facet + 1 if facet >= 0 else None}
        )  # fmt: skip
    for text in warnings:
        note(f"warning: {text}")
    if as_json:
        emit({"part": str(part), "tool": tool, "points": rows, "warnings": warnings})
        return Code.DONE
    print("x_mm,y_mm,z_mm,contact,facet")
    for row in rows:
        print(
            f"{row['x_mm']:.9g},{row['y_mm']:.9g},{'' if row['z_mm'] is None else format(row['z_mm'], '.9f')},"
            f"{row['contact']},{row['facet'] or ''}"
        )
    return Code.DONE


def _points(text: str, mesh: FacetMesh) -> Floats:
    """`x,y;x,y`, `grid:STEP` over the part, or a CSV file of x,y."""
    try:
        if text.startswith("grid:"):
            step = float(text[5:])
            if not (np.isfinite(step) and step > 0.0):
                raise ValueError
            low, high = mesh.bounds[:, :2]
            sides = [np.arange(low[k], high[k] + 1e-9 * step, step) for k in (0, 1)]
            if len(sides[0]) * len(sides[1]) > 2_000_000:
                raise InputError(f"--points {text}: {len(sides[0]) * len(sides[1])} points, at most 2000000")
            return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
        if Path(text).is_file():
            lines = Path(text).read_text(encoding="utf-8").splitlines()
            pairs = [line.split(",")[:2] for line in lines if line.strip() and line.lstrip()[0] not in "#xX"]
        else:
            pairs = [pair.split(",") for pair in text.split(";") if pair.strip()]
        out = np.array([[float(x), float(y)] for x, y in pairs])
    except (ValueError, OSError, UnicodeDecodeError) as exc:
        raise InputError(
            f"--points {text!r}: want 1,2;3,4 or grid:MM or a file of lines x,y", remedy="coordinates in mm"
        ) from exc
    if not len(out) or not np.isfinite(out).all():
        raise InputError(f"--points {text!r}: no points, or one that is no number")
    return out


def surface(
    part: Path,
    *,
    tool: str,
    scallop: float | None,
    step: float | None,
    chord: float,
    lead: float | None,
    tilt: float | None,
    tilt_limit: float,
    normals: str,
    direction: float,
    waterline: list[float] | None,
    levels: float | None,
    floor: float | None,
    feed: float,
    spindle: float,
    scale: float,
    one_way: bool,
    machine: str | None,
    joint_linear: bool,
    out: Path | None,
    as_json: bool,
) -> int:
    """`vmachining toolpath surface`."""
    end = cutter(tool)
    radius, corner = radii(end)
    chain = None if machine is None else load(machine)
    if out is not None:
        _check_out(out)
    if chain is not None and (out is None or WRITERS[out.suffix.lower()][0] != "iso"):
        raise InputError("--machine writes an NC program", remedy="give --out FILE.nc")
    if joint_linear and chain is None:
        raise InputError("--joint-linear is a way of a machine", remedy="name it by --machine")
    mesh = read_part(part, chord_mm=0.5 * chord, scale=scale)
    low, high = mesh.bounds
    end = cutter(tool, length_mm=float(max(4.0 * radius, high[2] - low[2] + 2.0 * radius)))
    model = Surface(mesh)
    path = _path(
        model, radius, corner, scallop=scallop, step=step, chord=chord, lead=lead, tilt=tilt, tilt_limit=tilt_limit,
        normals=normals, direction=direction, waterline=waterline, levels=levels, floor=floor, one_way=one_way,
    )  # fmt: skip
    warnings = [*mesh.notes, *path.notes]
    files: list[Path] = []
    if out is not None:
        dialect, writer = WRITERS[out.suffix.lower()]
        title = f"SURFACE {tool.upper()}"
        if chain is None:
            text = writer(path, feed_mm_min=feed, spindle_rev_min=spindle, title=title)
        else:
            text, told = rotary_program(
                path, chain, feed_mm_min=feed, spindle_rev_min=spindle, title=title, tcp=not joint_linear,
                tolerance_mm=0.5 * chord,
            )  # fmt: skip
            warnings += told
        job = out.with_suffix(".toml")
        write_atomic(out, text)
        write_atomic(
            job,
            path_job(
                path,
                out.name,
                dialect,
                end,
                low=low,
                high=high,
                name=part.stem,
                chord_mm=chord,
                machine=machine,
            ),
        )
        files = [out, job]
    marks = {mark.name.lower(): int((path.marks == mark).sum()) for mark in Mark}
    if as_json:
        emit(
            {
                "part": str(part), "facets": len(mesh.triangles), "points": len(path.tips), "feed_length_mm": path.feed_length,
                "marks": marks, "axes": 3 if path.is_upright else 5, "warnings": warnings, "files": [str(f) for f in files],
            }
        )  # fmt: skip
        return Code.DONE
    said = ", ".join(f"{count} {name}" for name, count in marks.items() if count)
    print(
        f"{part.name}: {len(mesh.triangles)} facets; {len(path.tips)} points ({said}), {path.feed_length:.1f} mm at feed"
    )
    for text in warnings:
        note(f"warning: {text}")
    for file in files:
        note(f"wrote {file}")
    return Code.DONE


def _beside(machine: str | None, job: Path) -> str | None:
    """A machine as its job file names it: a name, or a file relative to the job."""
    if machine is None or not machine.endswith(".toml"):
        return machine
    return Path(os.path.relpath(machine, job.parent)).as_posix()


def _check_out(out: Path) -> None:
    if out.suffix.lower() not in WRITERS:
        raise InputError(
            f"--out {out}: want one of {', '.join(WRITERS)}", remedy=".nc iso, .csv poses, .cls apt"
        )
    if taken := [str(path) for path in (out, out.with_suffix(".toml")) if path.exists()]:
        raise InputError(f"{', '.join(taken)} exists", remedy="give another --out; nothing is replaced")


def _path(
    model: Surface,
    radius: float,
    corner: float,
    *,
    scallop: float | None,
    step: float | None,
    chord: float,
    lead: float | None,
    tilt: float | None,
    tilt_limit: float,
    normals: str,
    direction: float,
    waterline: list[float] | None,
    levels: float | None,
    floor: float | None,
    one_way: bool,
) -> CLPath:
    """Waterlines, five axes or three, by what was asked."""
    if waterline or levels is not None:
        if scallop is not None or step is not None or lead is not None or tilt is not None:
            raise InputError("waterlines have heights: no --scallop, --step, --lead or --tilt beside them")
        from vmachining.toolpath.facets.levels import waterline_path

        heights = list(waterline or [])
        if levels is not None:
            if not (np.isfinite(levels) and levels > 0.0):
                raise InputError(f"--levels {levels:g}: want a positive number of mm")
            low, high = model.mesh.bounds[:, 2]
            count = int(np.ceil((high - low) / levels - 1e-9))
            if count > 10_000:
                raise InputError(f"--levels {levels:g}: {count} levels, at most 10000")
            heights += [max(high - levels * k, low) for k in range(1, count + 1)]
        return waterline_path(model, np.array(heights), radius, corner, chord=chord)
    if lead is not None or tilt is not None:
        from vmachining.toolpath.facets.fiveaxis import five_axis_raster

        if normals not in ("facet", "resultant", "area", "angle"):
            raise InputError(f"--normals {normals}: want facet, resultant, area or angle")
        return five_axis_raster(
            model, radius, corner, chord=chord, scallop=scallop, step=step, lead_deg=lead or 0.0, tilt_deg=tilt or 0.0,
            tilt_limit_deg=tilt_limit, direction_deg=direction, normals=normals,  # type: ignore[arg-type]  # just asked
        )  # fmt: skip
    from vmachining.toolpath.facets.passes import raster

    return raster(
        model, radius, corner, chord=chord, scallop=scallop, step=step, direction_deg=direction, floor=floor,
        zigzag=not one_way,
    ).path  # fmt: skip
