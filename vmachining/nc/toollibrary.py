"""Tool libraries of CAM systems and controls -> what they say of each tool.

    .tools .json     Fusion and HSMWorks (the first is a ZIP archive with the second)
    .fctl .fctb      FreeCAD: a library, or one tool (number 1)
    .tbl             LinuxCNC, shapes by its comments; it names no unit
    .t               Heidenhain TOOL.T, columns by its header
    .csv             columns number, type, diameter_mm, corner_radius_mm, tip_deg, flutes (commas or semicolons)

Nothing is invented: what a library does not say is None, a tool whose shape has no counterpart here keeps its diameter
and no kind.
"""

from __future__ import annotations

import csv
import io
import json
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from vmachining.errors import ToolError
from vmachining.nc.settings import read_tool_table
from vmachining.nc.toolcomments import INCH, ToolNote, tool_notes

_TBL: Final = re.compile(r"^[ \t]*T[ \t]*(\d+)[^;\n]*;([^\n()]*)", re.MULTILINE | re.IGNORECASE)
LARGEST: Final = 64 * 2**20
"""Bytes of a library, packed or not; a shop has some thousand tools of a kilobyte."""

_KINDS: Final = (
    ("lollipop", None), ("dovetail", None), ("form", None), ("thread", None), ("radius mill", None), ("probe", None),
    ("ball", "ball"), ("bull", "bull"), ("torus", "bull"), ("chamfer", "chamfer"), ("counter sink", "chamfer"),
    ("countersink", "chamfer"), ("v-bit", "chamfer"), ("vbit", "chamfer"), ("engrav", "chamfer"), ("spot", "drill"),
    ("drill", "drill"), ("tap", "tap"), ("ream", "bore"), ("bor", "bore"), ("taper", "taper"), ("end", "flat"), ("flat", "flat"),
    ("face", "flat"), ("slot", "flat"),
)  # fmt: skip
"""Parts of the names of types, the first that is found; None: a shape that has no counterpart."""


def read_tool_library(path: Path, scale: float = 1.0) -> dict[int, ToolNote]:
    """What the library says, by tool number; later entries of a number are left out. scale : mm per unit of a .tbl.

    Raises ToolError: Unreadable, too large, or in no format that is known.
    """
    kind = path.suffix.lower()
    try:
        if path.stat().st_size > LARGEST:
            raise ToolError("the tool library is too large", file=str(path))
        if kind == ".tools":
            return _fusion(json.loads(_unpacked(path)))
        if kind == ".json":
            return _fusion(json.loads(path.read_text(encoding="utf-8-sig")))
        if kind == ".fctl":
            return _freecad(path)
        if kind == ".fctb":
            return {1: _bit(json.loads(path.read_text(encoding="utf-8")), path.name)}
        if kind == ".t":
            return _heidenhain(path.read_text(encoding="latin-1"), path.name)
        if kind == ".csv":
            return _table(path.read_text(encoding="utf-8-sig"), path.name)
    except ToolError:
        raise
    except (OSError, UnicodeDecodeError, zipfile.BadZipFile, KeyError, AttributeError, TypeError) as exc:
        raise ToolError(f"cannot read the tool library: {exc}", file=str(path)) from exc
    except ValueError as exc:
        raise ToolError(f"the tool library is damaged: {exc}", file=str(path)) from exc
    if kind in (".tbl", ".toml"):
        table = read_tool_table(path, "inch" if scale == INCH else "mm")
        entries = [e for e in table.values() if e.diameter_mm > 0.0]
        text = path.read_text(encoding="utf-8", errors="replace")
        said = [f"(T{hit[1]} {hit[2]})" for hit in _TBL.finditer(text)]
        named = tool_notes(said, [e.number for e in entries], scale) if kind == ".tbl" else {}
        notes = ((e, named.get(e.number, ToolNote(0, ""))) for e in entries)
        return {e.number: n._replace(line=0, text=path.name, diameter_mm=e.diameter_mm) for e, n in notes}
    what = f"a tool library '{kind}' is not known"
    raise ToolError(what, file=str(path), remedy="tools, json, fctl, fctb, tbl, t, csv")


def _unpacked(path: Path) -> str:
    with zipfile.ZipFile(path) as archive:
        inside = next((item for item in archive.infolist() if item.filename.endswith(".json")), None)
        if inside is None or inside.file_size > LARGEST:
            raise ToolError("the archive holds no tools.json of a sensible size", file=str(path))
        with archive.open(inside) as file:
            return file.read(LARGEST).decode("utf-8-sig")


def _kind(name: str) -> str | None:
    low = name.lower()
    return next((kind for part, kind in _KINDS if part in low), None)


def _number(value: object) -> float | None:
    """A number, also out of "5.0000 mm"; inches become mm."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, int | float):
        return float(value)
    found = re.match(r"\s*(-?\d+(?:[.,]\d*)?|-?[.,]\d+)\s*(in|\")?", str(value))
    return float(found[1].replace(",", ".")) * (INCH if found[2] else 1.0) if found else None


def _fusion(data: Mapping[str, Any]) -> dict[int, ToolNote]:
    out: dict[int, ToolNote] = {}
    for tool in data["data"]:
        name, geometry = str(tool.get("type", "")), tool.get("geometry") or {}
        number = _number((tool.get("post-process") or {}).get("number"))
        if number is None or "holder" in name.lower() or int(number) in out:
            continue
        scale = INCH if str(tool.get("unit", "")).lower().startswith("in") else 1.0
        diameter, corner, flutes = (_number(geometry.get(key)) for key in ("DC", "RE", "NOF"))
        kind = _kind(name)
        angle = _number(geometry.get("SIG" if kind == "drill" else "TA"))
        label = " ".join(str(tool.get("description") or "").split()) + (f" ({name})" if kind is None else "")
        out[int(number)] = ToolNote(
            0, label or name, kind, None if diameter is None else diameter * scale,
            None if corner is None or kind in ("drill", "chamfer") else corner * scale, angle or None,
            int(flutes) if flutes else None,
        )  # fmt: skip
    return out


def _bit(data: Mapping[str, Any], name: str) -> ToolNote:
    sizes = data.get("parameter") or {}

    def size(*keys: str) -> float | None:
        return _number(next((sizes[key] for key in keys if key in sizes), None))

    diameter, corner = (
        size("Diameter", "CuttingEdgeDiameter"),
        size("TorusRadius", "FlatRadius", "CornerRadius"),
    )
    angle = size("TipAngle", "CuttingEdgeAngle")
    return _note(
        str(data.get("name") or name), str(data.get("shape", "")), diameter, corner, angle, size("Flutes")
    )


def _note(label: str, kind: str, diameter: float | None, corner: float | None, angle: float | None,
          flutes: float | None) -> ToolNote:  # fmt: skip
    """angle : of the whole tip, degrees."""
    found = _kind(kind)
    angle = angle / 2.0 if found == "chamfer" and angle is not None else angle
    return ToolNote(0, label, found, diameter, corner, angle, int(flutes) if flutes else None)


def _freecad(path: Path) -> dict[int, ToolNote]:
    out: dict[int, ToolNote] = {}
    for item in json.loads(path.read_text(encoding="utf-8"))["tools"]:
        own = Path(str(item["path"])).name
        place = next((p for p in (path.parent / own, path.parent.parent / "Bit" / own) if p.is_file()), None)
        if place is None:
            raise ToolError(f"the tool {own} of the library is missing", file=str(path))
        out.setdefault(int(item["nr"]), _bit(json.loads(place.read_text(encoding="utf-8")), own))
    return out


def _heidenhain(text: str, name: str) -> dict[int, ToolNote]:
    """TOOL.T: the columns begin where the header names them."""
    lines = text.splitlines()
    head = next((k for k, line in enumerate(lines) if re.match(r"\s*T\s+NAME\b", line)), None)
    if head is None:
        raise ToolError("the header T NAME L R ... of TOOL.T is missing", file=name)
    scale = INCH if "INCH" in "".join(lines[:head]).upper() else 1.0
    starts = [(hit.start(), hit[0]) for hit in re.finditer(r"\S+", lines[head])]
    ends = [start for start, _ in starts[1:]] + [10**6]
    out: dict[int, ToolNote] = {}
    for line in lines[head + 1 :]:
        cells = {title: line[start:end].strip() for (start, title), end in zip(starts, ends, strict=True)}
        number, radius = _number(cells.get("T")), _number(cells.get("R"))
        if number is None or not radius:
            continue
        corner, angle, cuts = (_number(cells.get(key)) for key in ("R2", "T-ANGLE", "CUT"))
        kind = "drill" if angle else None
        out.setdefault(
            int(number),
            ToolNote(0, cells.get("NAME") or name, kind, 2.0 * radius * scale, None if kind else (corner or 0.0) * scale,
                     angle or None, int(cuts) if cuts else None),
        )  # fmt: skip
    return out


def _table(text: str, name: str) -> dict[int, ToolNote]:
    head = text.partition("\n")[0]
    rows = csv.DictReader(io.StringIO(text), delimiter=";" if head.count(";") > head.count(",") else ",")
    out: dict[int, ToolNote] = {}
    for row in rows:
        cells = {str(key).strip().lower(): value for key, value in row.items() if key is not None}
        number = _number(next((cells[key] for key in ("number", "t", "tool") if key in cells), None))
        if number is None:
            what = "a row without its number"
            raise ToolError(what, file=name, remedy="columns number, type, diameter_mm, ...")
        sizes = (_number(cells.get(key)) for key in ("diameter_mm", "corner_radius_mm", "tip_deg", "flutes"))
        label = str(cells.get("name") or cells.get("type") or name)
        out.setdefault(int(number), _note(label, str(cells.get("type") or ""), *sizes))
    return out
