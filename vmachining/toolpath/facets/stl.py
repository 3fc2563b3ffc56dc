"""STL files, binary and ASCII, read strictly: an error names its facet or line. Source: spec D.1."""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.errors import InputError

HEADER, RECORD = 84, 50
OFF_DEG = 1.0
"""A stored normal that differs by more from that of the corners is reported."""

TOKEN = re.compile(rb"\S+")


class Facets(NamedTuple):
    """corners : (n, 3, 3) mm, counterclockwise seen from outside. notes : flaws that were found and accepted."""

    corners: Floats
    notes: tuple[str, ...]


def read_stl(path: Path | str, *, scale: float = 1.0, recover: bool = False) -> Facets:
    """Facets of an STL file; its size decides whether a file is binary, not its first word.

    scale : mm per unit of the file.
    recover : keep the complete facets of an ASCII file that ends early, and one whose three corners are there.
    Raises InputError: Neither binary nor ASCII STL, no facet, a value that is not a number, or a truncated file; names
        line or facet.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=str(path)) from error
    notes: list[str] = []
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= HEADER else -1
    if count >= 0 and len(data) == HEADER + RECORD * count:
        numbers = _binary(data, count)
    elif re.search(rb"facet", data[:4096], re.IGNORECASE):
        numbers, notes = _ascii(data, path, recover)
    elif re.match(rb"\s*solid\b", data, re.IGNORECASE) and re.search(rb"endsolid", data, re.IGNORECASE):
        numbers = np.empty((0, 4, 3))
    else:
        size = f"{HEADER + RECORD * count} bytes" if count >= 0 else "at least 84 bytes"
        raise InputError(
            f"is not an STL file: {len(data)} bytes; a binary one of {max(count, 0)} facets has {size}",
            file=str(path),
        )
    if not len(numbers):
        raise InputError("has no facets: it is empty", file=str(path))
    bad = np.flatnonzero(~np.isfinite(numbers[:, 1:]).all(axis=(1, 2)))
    if len(bad):
        raise InputError(f"facet {bad[0] + 1} has a coordinate that is not a number", file=str(path))
    corners = numbers[:, 1:] * scale
    return Facets(corners, (*notes, *_normal_notes(numbers[:, 0], corners)))


def _binary(data: bytes, count: int) -> Floats:
    kind = np.dtype([("numbers", "<f4", (4, 3)), ("attribute", "<u2")])
    return np.frombuffer(data, kind, count, HEADER)["numbers"].astype(np.float64)


def _ascii(data: bytes, path: Path, recover: bool) -> tuple[Floats, list[str]]:
    """(n, 4, 3): normal and corners, and notes."""
    words = [(m.group().lower(), m.start()) for m in TOKEN.finditer(data)]
    found: list[list[float]] = []
    facet: list[float] = []
    place = 0

    def line(at: int) -> int:
        return data.count(b"\n", 0, words[min(at, len(words) - 1)][1]) + 1

    def expect(*names: bytes) -> None:
        nonlocal place
        for name in names:
            if place >= len(words):
                raise EOFError
            if words[place][0] != name:
                got = words[place][0].decode("latin-1")
                raise InputError(
                    f"facet {len(found) + 1}: expected {name.decode()!r}, found {got!r}",
                    file=str(path),
                    line=line(place),
                )
            place += 1

    def numbers() -> None:
        nonlocal place
        for _ in range(3):
            if place >= len(words):
                raise EOFError
            try:
                facet.append(float(words[place][0]))
            except ValueError as error:
                got = words[place][0].decode("latin-1")
                raise InputError(
                    f"facet {len(found) + 1}: {got!r} is not a number", file=str(path), line=line(place)
                ) from error
            place += 1

    while place < len(words) and words[place][0] != b"facet":  # solid and a name of any words
        place += 1
    try:
        while place < len(words) and words[place][0] == b"facet":
            facet = []
            expect(b"facet", b"normal")
            numbers()
            expect(b"outer", b"loop")
            for _ in range(3):
                expect(b"vertex")
                numbers()
            expect(b"endloop", b"endfacet")
            found.append(facet)
        expect(b"endsolid")
    except EOFError:
        number = len(found) + 1
        if not recover:
            raise InputError(
                f"unexpected end of file in facet {number}", file=str(path), line=line(len(words)),
                remedy="the file is truncated: export it again; in Python, recover=True keeps its complete facets",
            ) from None  # fmt: skip
        if len(facet) == 12 and (not found or facet is not found[-1]):
            found.append(facet)
        return np.array(found).reshape(-1, 4, 3), [f"the file ends early: {len(found)} facets are kept"]
    return np.array(found).reshape(-1, 4, 3), []


def _normal_notes(stored: Floats, corners: Floats) -> list[str]:
    """How many stored normals do not fit the order of the corners, which is what counts."""
    true = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(true, axis=1) * np.linalg.norm(stored, axis=1)
    known = size > 0.0
    turn = np.degrees(np.arccos(np.clip((true * stored).sum(axis=1)[known] / size[known], -1.0, 1.0)))
    off = np.flatnonzero(turn > OFF_DEG)
    if not len(off):
        return []
    first = np.flatnonzero(known)[off[0]] + 1
    return [
        f"{len(off)} stored normals differ by more than 1 degree from their corners, first in facet {first}"
    ]
