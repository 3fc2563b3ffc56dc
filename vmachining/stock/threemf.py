"""3MF packages: a zip file of XML, read with the standard library and within limits.

A package of a few MB may unpack to any size, and XML may name entities that grow as they are replaced. So nothing is
unpacked as a whole: the parser gets one piece after the other, stops where the part exceeds its limit, and refuses
document types, which 3MF forbids anyway.

Source: 3MF Core Specification 1.3 (3MF Consortium): parts and relationships in section 2, units and transforms in 3,
objects in 4; `path` of a component is the Production Extension 1.1, section 3.
"""

from __future__ import annotations

import zipfile
import zlib
from array import array
from pathlib import Path
from typing import Any, NamedTuple
from xml.parsers import expat

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.errors import StockError

UNITS_MM = {
    "micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0,
}  # fmt: skip
CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
MODEL_TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
PIECE = 1 << 16
"""Bytes that the parser gets at once."""

MAX_DEPTH = 32
"""Components in components: a real assembly has two or three levels."""

NOT_PART = ("support", "surface", "other")
"""Types of objects that enclose no material of the part (section 4.1)."""


class _Object(NamedTuple):
    """Triangles of one object and the objects that it places."""

    kind: str
    vertices: array[float]
    triangles: array[int]
    components: list[tuple[str, str, str | None]]  # part, id, transform


class _Part(NamedTuple):
    """One model part of the package."""

    unit: str
    objects: dict[str, _Object]
    items: list[tuple[str, str, str | None]]  # part, id, transform


def read_3mf(path: Path, most: int) -> tuple[Floats, Ints]:
    """vertices (n, 3) mm and triangles (m, 3) of what a 3MF file builds; its own unit is converted.

    most : bytes that the model may unpack to, and that its placed copies may take.
    Raises StockError: No zip file, damaged, no model in it, larger than `most`, or not what the specification allows.
    """
    try:
        with zipfile.ZipFile(path) as package:
            return _Reader(package, str(path), most).build()
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, OSError) as error:
        raise StockError(f"cannot be read as a 3MF package ({error})", file=str(path)) from error


class _Reader:
    """Model parts of one package, each parsed once."""

    def __init__(self, package: zipfile.ZipFile, name: str, most: int) -> None:
        self.package, self.name, self.most = package, name, most
        self.left = most
        self.sizes: dict[tuple[str, str], int] = {}
        self.parts: dict[str, _Part] = {}

    def build(self) -> tuple[Floats, Ints]:
        """The items of the build, placed."""
        root = self.root()
        model = self.part(root)
        total = sum(self.weight(part, key, 0) for part, key, _ in model.items)
        if total > self.most:
            raise self.refusal(f"its copies of objects take {total / 2**20:.0f} MB", size=True)
        vertices: list[Floats] = []
        triangles: list[Ints] = []
        for part, key, transform in model.items:
            self.place(part, key, [self.matrix(transform)], vertices, triangles)
        if not triangles:
            raise self.refusal("holds no triangles")
        shift = np.cumsum([0, *map(len, vertices)])
        moved = [faces + first for faces, first in zip(triangles, shift, strict=False)]
        return UNITS_MM[model.unit] * np.concatenate(vertices), np.concatenate(moved)

    def root(self) -> str:
        """Name of the part that the package starts with."""
        found: list[str] = []

        def start(tag: str, attributes: dict[str, str]) -> None:
            if _local(tag) == "Relationship" and attributes.get("Type") == MODEL_TYPE:
                found.append(attributes.get("Target", ""))

        self.parse("_rels/.rels", start)
        if not found:
            raise self.refusal("names no 3D model in _rels/.rels")
        return found[0].lstrip("/")

    def part(self, name: str) -> _Part:
        if name not in self.parts:
            self.parts[name] = self.read_part(name)
        return self.parts[name]

    def read_part(self, name: str) -> _Part:
        unit, objects = "millimeter", dict[str, _Object]()
        items: list[tuple[str, str, str | None]] = []
        at: _Object | None = None

        def start(tag: str, attributes: dict[str, str]) -> None:
            nonlocal unit, at
            space, _, tag = tag.rpartition(" ")
            if space not in (CORE, ""):  # slices and lattices of extensions have vertices, too
                return
            if tag == "vertex" and at is not None:
                at.vertices.extend((float(attributes["x"]), float(attributes["y"]), float(attributes["z"])))
            elif tag == "triangle" and at is not None:
                at.triangles.extend((int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"])))
            elif tag == "object":
                at = _Object(attributes.get("type", "model"), array("d"), array("q"), [])
                objects[attributes["id"]] = at
            elif tag == "component" and at is not None:
                at.components.append(_reference(attributes, name))
            elif tag == "item":
                items.append(_reference(attributes, name))
            elif tag == "model":
                unit = attributes.get("unit", unit)

        self.parse(name, start)
        if unit not in UNITS_MM:
            raise self.refusal(f"unknown unit {unit!r}", remedy=f"3MF knows {', '.join(UNITS_MM)}")
        return _Part(unit, objects, items)

    def parse(self, name: str, start: Any) -> None:
        """Feed one part to the parser, piece by piece, while the limit lasts."""
        known = {entry.filename.lower(): entry for entry in self.package.infolist()}
        entry = known.get(name.lower())
        if entry is None:
            raise self.refusal(f"has no part {name}")
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise self.refusal(f"{name} is neither stored nor deflated, as 3MF requires")
        if entry.file_size > self.left:
            raise self.refusal(f"{name} unpacks to {entry.file_size / 2**20:.0f} MB", size=True)
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.StartElementHandler = start
        parser.StartDoctypeDeclHandler = self.no_doctype
        try:
            with self.package.open(entry) as stream:
                while piece := stream.read(PIECE):
                    self.left -= len(piece)
                    if self.left < 0:
                        raise self.refusal(f"{name} unpacks to more than its directory says", size=True)
                    parser.Parse(piece, False)
            parser.Parse(b"", True)
        except expat.ExpatError as error:
            raise self.refusal(f"{name} is not XML ({error})") from error
        except (KeyError, ValueError, OverflowError) as error:
            what = f"lacks {error}" if isinstance(error, KeyError) else str(error)
            raise self.refusal(f"{name}, line {parser.CurrentLineNumber}: {what}") from error

    def no_doctype(self, *_: object) -> None:
        raise self.refusal("declares a document type, which 3MF forbids")

    def object(self, part: str, key: str) -> _Object:
        found = self.part(part).objects.get(key)
        if found is None:
            raise self.refusal(f"object {key} is missing in {part}")
        return found

    def weight(self, part: str, key: str, depth: int) -> int:
        """Bytes of an object with all that it places; copies of copies grow fast, so they are counted first."""
        if depth > MAX_DEPTH:
            raise self.refusal(f"components are nested more than {MAX_DEPTH} deep")
        if (part, key) not in self.sizes:
            one = self.object(part, key)
            own = 8 * (len(one.vertices) + len(one.triangles)) + 256  # an empty object costs a call
            self.sizes[part, key] = own + sum(self.weight(p, k, depth + 1) for p, k, _ in one.components)
        return self.sizes[part, key]

    def place(
        self, part: str, key: str, moves: list[Floats], vertices: list[Floats], triangles: list[Ints]
    ) -> None:
        """Append the triangles of an object, moved by `moves`, the innermost last."""
        one = self.object(part, key)
        if one.kind in NOT_PART:
            return
        points = np.array(one.vertices).reshape(-1, 3)
        faces = np.array(one.triangles, dtype=np.int64).reshape(-1, 3)
        if len(faces) and (faces.min() < 0 or faces.max() >= len(points)):
            raise self.refusal(f"object {key} has a triangle with a vertex that is missing")
        if len(faces):
            for move in reversed(moves):
                points = points @ move[:3] + move[3]
            mirrored = np.prod([np.linalg.det(move[:3]) for move in moves]) < 0.0
            vertices.append(points)
            triangles.append(faces[:, ::-1] if mirrored else faces)
        for below, other, transform in one.components:
            self.place(below, other, [*moves, self.matrix(transform)], vertices, triangles)

    def matrix(self, text: str | None) -> Floats:
        """(4, 3), for row vectors (section 3.3)."""
        if text is None:
            return np.eye(4, 3)
        try:
            values = np.array([float(word) for word in text.split()]).reshape(4, 3)
        except ValueError:
            values = np.full((4, 3), np.nan)
        if not np.isfinite(values).all():
            raise self.refusal(f"transform {text[:60]!r} is not twelve finite numbers")
        return values

    def refusal(self, what: str, *, remedy: str | None = None, size: bool = False) -> StockError:
        if size:
            what += f"; the memory available here reads {self.most / 2**20:.0f} MB"
            remedy = "export it with fewer triangles"
        return StockError(what, file=self.name, remedy=remedy)


def _local(tag: str) -> str:
    """Name without its namespace."""
    return tag.rpartition(" ")[2]


def _reference(attributes: dict[str, str], part: str) -> tuple[str, str, str | None]:
    path = next((value for key, value in attributes.items() if _local(key) == "path"), part)
    return path.lstrip("/"), attributes["objectid"], attributes.get("transform")
