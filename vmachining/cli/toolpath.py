"""toolpath pocket, drop, distance, surface and flank."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.cli.main import Code
from vmachining.cli.nc_commands import Distance, Drop, Flank, Passes, Pocket
from vmachining.cli.options import three
from vmachining.cli.screen import emit, told
from vmachining.errors import InputError
from vmachining.job.files import write_atomic
from vmachining.job.stock import read_part
from vmachining.machine import load
from vmachining.stock import MeshStock
from vmachining.textfile import number_rows
from vmachining.tool import FlatEnd
from vmachining.toolpath.clpath import WRITERS, CLPath, Mark, cutter, path_job
from vmachining.toolpath.facets import FacetMesh, Surface, radii
from vmachining.toolpath.rotary import rotary_program


def drop(o: Drop) -> int:
    mesh = read_part(o.part, chord_mm=o.chord, scale=o.scale)
    where = _points(o.points, mesh)
    model, tool = Surface(mesh), None if o.tool == "none" else o.tool
    if tool is None and o.floor is not None:
        raise InputError("--floor limits a tool, and heights of the part have no tool", remedy="give --tool")
    if tool is None:
        z, which = model.heights(where)
        kinds = ["facet" if k >= 0 else "none" for k in which]
    else:
        found = model.drop(where, *radii(cutter(tool)), floor=-np.inf if o.floor is None else o.floor)
        z, which = found.z, found.triangle
        kinds = [("none", "vertex", "edge", "facet")[k] for k in found.kind]
    rows = [
        {"x_mm": x, "y_mm": y, "z_mm": height if np.isfinite(height) else None, "contact": kind,
         "facet": facet + 1 if facet >= 0 else None}
        for (x, y), height, facet, kind in zip(where.tolist(), z.tolist(), which.tolist(), kinds, strict=True)
    ]  # fmt: skip
    told(mesh.notes)
    if o.as_json:
        emit({"part": str(o.part), "tool": tool, "points": rows, "warnings": list(mesh.notes)})
        return Code.DONE
    print("x_mm,y_mm,z_mm,contact,facet")
    for row in rows:
        z_mm = "" if row["z_mm"] is None else f"{row['z_mm']:.9f}"
        print(f"{row['x_mm']:.9g},{row['y_mm']:.9g},{z_mm},{row['contact']},{row['facet'] or ''}")
    return Code.DONE


def distance(o: Distance) -> int:
    facets, solid, chord = o.facets, o.solid, o.chord
    if facets.suffix.lower() != ".stl" or solid.suffix.lower() not in (".step", ".stp"):
        raise InputError(
            f"{facets.name} and {solid.name}: expected an .stl and the .step that it was made from"
        )
    mesh, exact = read_part(facets, scale=o.scale), read_part(solid, chord_mm=chord)
    corners = mesh.corners
    middles = (0.5 * (corners[:, k] + corners[:, k - 1]) for k in range(3))
    places = np.concatenate([mesh.vertices, *middles, corners.mean(axis=1)])
    far = MeshStock(exact.vertices, exact.triangles).signed_distance(places)
    out, deep = int(np.argmax(far)), int(np.argmin(far))
    size = float(np.linalg.norm(np.ptp(exact.bounds, axis=0)))
    notes = list(mesh.notes)
    if max(far[out], -far[deep]) > 0.05 * size:
        what = "check the unit (--scale 25.4 for inches), the position and the part"
        notes.append(f"the facets are far from the solid: {what}")
    told(notes, quiet=o.as_json)
    rms = float(np.sqrt((far**2).mean()))
    if o.as_json:
        emit({
            "places": len(places), "outside_mm": max(float(far[out]), 0.0), "outside_at_mm": places[out].tolist(),
            "inside_mm": max(-float(far[deep]), 0.0), "inside_at_mm": places[deep].tolist(),
            "rms_mm": rms, "known_to_mm": chord, "warnings": notes,
        })  # fmt: skip
        return Code.DONE
    print(f"{facets.name}: {len(mesh.triangles)} facets, {len(places)} places, each known to {chord:g} mm")
    for name, k in (("outside", out), ("inside", deep)):
        print(f"  {name:<8}  {abs(far[k]):.6g} mm at {', '.join(f'{v:.6g}' for v in places[k])}")
    print(f"  rms       {rms:.6g} mm")
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
            return number_rows(Path(text), ("x", "y"), "list of points", InputError)
        out = np.array(
            [[float(x), float(y)] for x, y in (pair.split(",") for pair in text.split(";") if pair.strip())]
        )
    except InputError:
        raise
    except (ValueError, OSError) as exc:
        what = f"--points {text!r}: expected 1,2;3,4 or grid:MM or a file of lines x,y"
        raise InputError(what, remedy="coordinates in mm") from exc
    if not len(out) or not np.isfinite(out).all():
        raise InputError(f"--points {text!r}: no points, or one that is not a number")
    return out


def flank(o: Flank) -> int:
    from vmachining.toolpath import flank_path

    end = cutter(o.tool)
    if not isinstance(end, FlatEnd):
        raise InputError(f"--tool {o.tool}: the side of an end mill cuts a ruled face", remedy="give flat:D")
    table = number_rows(o.rulings, ("x1", "y1", "z1", "x2", "y2", "z2"), "table of rulings", InputError)
    low, high = table[:, :3], table[:, 3:]
    found = flank_path(low, high, 0.5 * end.diameter, side=o.side, below_mm=o.below)
    if o.out is not None:
        _check_out(o.out, o.out)
        write = WRITERS[o.out.suffix.lower()][1]
        title = f"FLANK {o.tool.upper()}"
        write_atomic(o.out, write(found.path, feed_mm_min=o.feed, spindle_rev_min=o.spindle, title=title))
    files = [] if o.out is None else [o.out]
    at, after = float(found.overcut.max()), float(found.between.max())
    worst = int(np.argmax((found.between if after > at else found.overcut).round(12)))
    record = {
        "rulings": len(low), "feed_length_mm": found.path.feed_length, "overcut_mm": max(at, after), "overcut_at_ruling": worst,
        "overcut_at_rulings_mm": at, "overcut_between_mm": after, "warnings": list(found.path.notes),
        "twist_deg": float(np.degrees(found.twist.max())), "files": [str(f) for f in files],
    }  # fmt: skip
    if o.as_json:
        emit(record | {"tips_mm": found.path.tips.tolist(), "axes": found.path.axes.tolist()})
        return Code.DONE
    way, twist = f"{found.path.feed_length:.1f} mm at feed", f"{record['twist_deg']:.3g} degrees at most"
    print(f"{len(low)} rulings, {way}; normals turn by {twist}")
    told(found.path.notes, files)
    return Code.DONE


def surface(o: Passes) -> int:
    part, out = o.part, o.out
    radius, corner = radii(cutter(o.tool))
    chain = None if o.machine is None else load(o.machine)
    if out is not None:
        _check_out(out, out, out.with_suffix(".toml"))
    if chain is not None and (out is None or WRITERS[out.suffix.lower()][0] != "iso"):
        raise InputError("--machine writes an NC program", remedy="give --out FILE.nc")
    if o.joint_linear and chain is None:
        raise InputError("--joint-linear belongs to a machine", remedy="name it by --machine")
    turn, move = three(o.turn, "--turn", "A,B,C in degrees"), three(o.move, "--move", "X,Y,Z in mm")
    mesh = read_part(part, chord_mm=0.5 * o.chord, scale=o.scale)
    mesh = mesh.placed(turn_deg=turn, to_origin=o.to_origin, move=move)
    low, high = mesh.bounds
    end = cutter(o.tool, length_mm=float(max(4.0 * radius, high[2] - low[2] + 2.0 * radius)))
    model = Surface(mesh)
    path = _path(model, radius, corner, o)
    warnings = [*mesh.notes, *path.notes]
    files: list[Path] = []
    if out is not None:
        dialect, writer = WRITERS[out.suffix.lower()]
        said: dict[str, Any] = {
            "feed_mm_min": o.feed, "spindle_rev_min": o.spindle, "title": f"SURFACE {o.tool.upper()}",
        }  # fmt: skip
        if chain is None:
            text = writer(path, **said)
        else:
            text, more = rotary_program(
                path, chain, tcp=not o.joint_linear, tolerance_mm=0.5 * o.chord, **said
            )
            warnings += more
        job = path_job(
            out.name, end, low=low, high=high, dialect=dialect, home=path.tips[0] + [0.0, 0.0, 1.0], chord_mm=o.chord,
            machine=o.machine,
        )  # fmt: skip
        files = [out, out.with_suffix(".toml")]
        for file, content in zip(files, (text, job), strict=True):
            write_atomic(file, content)
    marks = {mark.name.lower(): int((path.marks == mark).sum()) for mark in Mark}
    if o.as_json:
        emit({
            "part": str(part), "facets": len(mesh.triangles), "box_mm": mesh.bounds.tolist(), "points": len(path.tips),
            "feed_length_mm": path.feed_length, "marks": marks, "axes": 3 if path.is_upright else 5, "warnings": warnings,
            "files": [str(f) for f in files],
        })  # fmt: skip
        return Code.DONE
    counts = ", ".join(f"{count} {name}" for name, count in marks.items() if count)
    way = f"{len(path.tips)} points ({counts}), {path.feed_length:.1f} mm at feed"
    print(f"{part.name}: {len(mesh.triangles)} facets; {way}")
    told(warnings, files)
    return Code.DONE


def _check_out(out: Path, *written: Path, suffixes: Iterable[str] = WRITERS) -> None:
    """Refuse a name without a writer, and files that are there."""
    if out.suffix.lower() not in suffixes:
        remedy = ".nc iso, .csv poses, .cls apt"
        raise InputError(f"--out {out}: expected one of {', '.join(WRITERS)}", remedy=remedy)
    if taken := [str(path) for path in written if path.exists()]:
        raise InputError(f"{', '.join(taken)} exists", remedy="give another --out; nothing is replaced")


def _path(model: Surface, radius: float, corner: float, o: Passes) -> CLPath:
    """Waterlines, five axes or three, by what was asked."""
    if o.waterline or o.levels is not None:
        if any(given is not None for given in (o.scallop, o.step, o.lead, o.tilt)):
            raise InputError("waterlines have fixed heights: omit --scallop, --step, --lead and --tilt")
        from vmachining.toolpath.facets.levels import waterline_path

        heights = list(o.waterline or [])
        if o.levels is not None:
            low, high = model.mesh.bounds[:, 2]
            count = int(np.ceil((high - low) / o.levels - 1e-9))
            if count > 10_000:
                raise InputError(f"--levels {o.levels:g}: {count} levels, at most 10000")
            heights += [max(high - o.levels * k, low) for k in range(1, count + 1)]
        return waterline_path(model, np.array(heights), radius, corner, chord=o.chord)
    if o.lead is not None or o.tilt is not None:
        from vmachining.toolpath.facets.fiveaxis import five_axis_raster

        return five_axis_raster(
            model, radius, corner, chord=o.chord, scallop=o.scallop, step=o.step, lead_deg=o.lead or 0.0, tilt_deg=o.tilt or 0.0,
            tilt_limit_deg=o.tilt_limit, direction_deg=o.direction, normals=o.normals, sharp_deg=o.sharp,
        )  # fmt: skip
    from vmachining.toolpath.facets.passes import raster

    return raster(
        model, radius, corner, chord=o.chord, scallop=o.scallop, step=o.step, direction_deg=o.direction, floor=o.floor,
        zigzag=not o.one_way,
    ).path  # fmt: skip


def pocket(o: Pocket) -> int:
    from vmachining.toolpath import MODES, STRATEGIES, Triangle, advice, pocket_lengths
    from vmachining.toolpath.pocket import level_program, pocket_job

    sides, radius, out, plot = o.sides, o.radius, o.out, o.plot
    given = None if o.angles is None else three(o.angles, "--angles", "degrees such as 90,53,37")
    best = advice(*sides, radius)
    known = {pocket.strategy: pocket for pocket in best}
    rows: list[dict[str, Any]] = []
    for name in STRATEGIES:
        true = known[name]
        books = {
            f"{mode}_mm": pocket_lengths(*sides, radius, strategy=name, mode=mode, angles=given).length
            for mode in MODES[1:]
        }
        rows.append({
            "strategy": name, "length_mm": true.length, **books, "passes": true.passes, "uncovered_mm2": true.uncovered_area,
            "gouge_mm2": true.gouge_area,
        })  # fmt: skip
    if (chosen := known.get(o.strategy or best[0].strategy)) is None:
        raise InputError(f"unknown strategy {o.strategy!r}", remedy=f"one of {', '.join(STRATEGIES)}")
    triangle = Triangle.of(*sides, radius)
    warnings = [text for text in (Triangle.of(*sides, radius, angles=given).misfit,) if text]
    files: list[Path] = []
    if out is not None:
        if not out.name or out.suffix == ".toml":
            raise InputError(f"--out {str(out)!r} names the program, for instance pocket.nc")
        files = [out, out.with_suffix(".toml")]
        _check_out(out, *files, suffixes=[out.suffix.lower()])
        title = f"TRIANGULAR POCKET {' '.join(f'{v:g}' for v in sides)} R{radius:g} {chosen.strategy.upper()}"
        text = level_program(
            chosen.path, depth_mm=o.depth, step_mm=o.step or o.depth, feed_mm_min=o.feed,
            plunge_mm_min=o.plunge or o.feed / 3.0, title=title,
        )  # fmt: skip
        write_atomic(out, text)
        write_atomic(files[1], pocket_job(triangle, out.name, depth_mm=o.depth))
    if plot is not None:
        from vmachining.report.paper import is_picture, write_figure
        from vmachining.report.pockets import draw_pockets, write_pocket_page

        if is_picture(plot, "--plot"):
            write_figure(draw_pockets(triangle, best), plot)
        else:
            write_pocket_page(triangle, best, plot)
        files.append(plot)
    if o.as_json:
        emit({
            "strategies": rows, "shortest": best[0].strategy, "chosen": chosen.strategy, "path_mm": chosen.path.tolist(),
            "warnings": warnings, "files": [str(path) for path in files],
        })  # fmt: skip
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
