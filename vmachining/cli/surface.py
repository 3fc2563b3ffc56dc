"""toolpath drop, toolpath distance, toolpath surface and toolpath flank."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.cli.main import Code
from vmachining.cli.nc_commands import Distance, Drop, Flank, Passes
from vmachining.cli.options import three
from vmachining.cli.screen import emit, told
from vmachining.errors import InputError
from vmachining.job.files import write_atomic
from vmachining.job.part import read_part
from vmachining.machine import load
from vmachining.stock import MeshStock
from vmachining.textfile import number_rows
from vmachining.tool import FlatEnd
from vmachining.toolpath.clpath import WRITERS, CLPath, Mark, cutter, path_job
from vmachining.toolpath.facets import FacetMesh, Surface, radii
from vmachining.toolpath.rotary import rotary_program


def drop(o: Drop) -> int:
    part = o.part
    mesh = read_part(part, chord_mm=o.chord, scale=o.scale)
    where = _points(o.points, mesh)
    model = Surface(mesh)
    tool = None if o.tool == "none" else o.tool
    if tool is None and o.floor is not None:
        raise InputError("--floor limits a tool, and heights of the part have no tool", remedy="give --tool")
    warnings = list(mesh.notes)
    rows: list[dict[str, Any]] = []
    if tool is None:
        z, which = model.heights(where)
        kinds = ["facet" if k >= 0 else "none" for k in which]
    else:
        found = model.drop(where, *radii(cutter(tool)), floor=-np.inf if o.floor is None else o.floor)
        z, which = found.z, found.triangle
        kinds = [("none", "vertex", "edge", "facet")[k] for k in found.kind]
    for (x, y), height, facet, kind in zip(where.tolist(), z.tolist(), which.tolist(), kinds, strict=True):
        known = bool(np.isfinite(height))
        rows.append(
            {"x_mm": x, "y_mm": y, "z_mm": height if known else None, "contact": kind, "facet": facet + 1 if facet >= 0 else None}
        )  # fmt: skip
    told(warnings)
    if o.as_json:
        emit({"part": str(part), "tool": tool, "points": rows, "warnings": warnings})
        return Code.DONE
    print("x_mm,y_mm,z_mm,contact,facet")
    for row in rows:
        print(
            f"{row['x_mm']:.9g},{row['y_mm']:.9g},{'' if row['z_mm'] is None else format(row['z_mm'], '.9f')},"
            f"{row['contact']},{row['facet'] or ''}"
        )
    return Code.DONE


def distance(o: Distance) -> int:
    facets, solid, chord, as_json = o.facets, o.solid, o.chord, o.as_json
    if facets.suffix.lower() != ".stl" or solid.suffix.lower() not in (".step", ".stp"):
        raise InputError(
            f"{facets.name} and {solid.name}: expected an .stl and the .step that it was made from"
        )
    mesh, exact = read_part(facets, scale=o.scale), read_part(solid, chord_mm=chord)
    corners = mesh.corners
    places = np.concatenate(
        [mesh.vertices, *(0.5 * (corners[:, k] + corners[:, k - 1]) for k in range(3)), corners.mean(axis=1)]
    )
    far = MeshStock(exact.vertices, exact.triangles).signed_distance(places)
    out, deep = int(np.argmax(far)), int(np.argmin(far))
    size = float(np.linalg.norm(np.ptp(exact.bounds, axis=0)))
    notes = list(mesh.notes)
    if max(far[out], -far[deep]) > 0.05 * size:
        notes.append(
            "the facets are far from the solid: check the unit (--scale 25.4 for inches), the position and the part"
        )
    told(notes, quiet=as_json)
    if as_json:
        emit({
            "places": len(places), "outside_mm": max(float(far[out]), 0.0), "outside_at_mm": places[out].tolist(),
            "inside_mm": max(-float(far[deep]), 0.0), "inside_at_mm": places[deep].tolist(),
            "rms_mm": float(np.sqrt((far**2).mean())), "known_to_mm": chord, "warnings": notes,
        })  # fmt: skip
        return Code.DONE
    print(f"{facets.name}: {len(mesh.triangles)} facets, {len(places)} places, each known to {chord:g} mm")
    for name, k in (("outside", out), ("inside", deep)):
        print(f"  {name:<8}  {abs(far[k]):.6g} mm at {', '.join(f'{v:.6g}' for v in places[k])}")
    print(f"  rms       {np.sqrt((far**2).mean()):.6g} mm")
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
        pairs = [pair.split(",") for pair in text.split(";") if pair.strip()]
        out = np.array([[float(x), float(y)] for x, y in pairs])
    except InputError:
        raise
    except (ValueError, OSError, UnicodeDecodeError) as exc:
        raise InputError(
            f"--points {text!r}: expected 1,2;3,4 or grid:MM or a file of lines x,y",
            remedy="coordinates in mm",
        ) from exc
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
    files = []
    if o.out is not None:
        _check_out(o.out, job=False)
        writer = WRITERS[o.out.suffix.lower()][1]
        text = writer(
            found.path, feed_mm_min=o.feed, spindle_rev_min=o.spindle, title=f"FLANK {o.tool.upper()}"
        )
        write_atomic(o.out, text)
        files = [o.out]
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
    print(
        f"{len(low)} rulings, {found.path.feed_length:.1f} mm at feed; normals turn by {record['twist_deg']:.3g} degrees at most"
    )
    told(found.path.notes, files)
    return Code.DONE


def surface(o: Passes) -> int:
    part, out, machine = o.part, o.out, o.machine
    end = cutter(o.tool)
    radius, corner = radii(end)
    chain = None if machine is None else load(machine)
    if out is not None:
        _check_out(out)
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
        title = f"SURFACE {o.tool.upper()}"
        if chain is None:
            text = writer(path, feed_mm_min=o.feed, spindle_rev_min=o.spindle, title=title)
        else:
            text, more = rotary_program(
                path, chain, feed_mm_min=o.feed, spindle_rev_min=o.spindle, title=title, tcp=not o.joint_linear,
                tolerance_mm=0.5 * o.chord,
            )  # fmt: skip
            warnings += more
        job = out.with_suffix(".toml")
        write_atomic(out, text)
        made = path_job(
            path, out.name, dialect, end, low=low, high=high, name=out.stem, chord_mm=o.chord, machine=machine
        )
        write_atomic(job, made)
        files = [out, job]
    marks = {mark.name.lower(): int((path.marks == mark).sum()) for mark in Mark}
    if o.as_json:
        emit(
            {
                "part": str(part), "facets": len(mesh.triangles), "box_mm": mesh.bounds.tolist(),
                "points": len(path.tips), "feed_length_mm": path.feed_length,
                "marks": marks, "axes": 3 if path.is_upright else 5, "warnings": warnings, "files": [str(f) for f in files],
            }
        )  # fmt: skip
        return Code.DONE
    said = ", ".join(f"{count} {name}" for name, count in marks.items() if count)
    print(
        f"{part.name}: {len(mesh.triangles)} facets; {len(path.tips)} points ({said}), {path.feed_length:.1f} mm at feed"
    )
    told(warnings, files)
    return Code.DONE


def _check_out(out: Path, *, job: bool = True) -> None:
    if out.suffix.lower() not in WRITERS:
        raise InputError(
            f"--out {out}: expected one of {', '.join(WRITERS)}", remedy=".nc iso, .csv poses, .cls apt"
        )
    written = (out, out.with_suffix(".toml")) if job else (out,)
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
