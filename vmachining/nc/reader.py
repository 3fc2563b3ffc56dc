"""Reads a program: from a file or from bytes, in any dialect."""

from __future__ import annotations

import codecs
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from vmachining.errors import NCError
from vmachining.nc.apt import read_apt
from vmachining.nc.blocks import Reader
from vmachining.nc.checks import check_moves, finding
from vmachining.nc.foreign import binary_kind, recognised
from vmachining.nc.lexer import split_lines
from vmachining.nc.model import Finding, Point, Program
from vmachining.nc.poses import read_poses
from vmachining.nc.run import DWELL_UNITS
from vmachining.nc.settings import Settings
from vmachining.nc.state import work_offset_codes
from vmachining.nc.tooltable import ToolEntry

__all__ = ["DIALECTS", "MAX_BYTES", "decode_program", "parse_program", "read_program"]

DIALECTS: Final = ("iso", "mts", "apt", "poses")

MAX_BYTES: Final = 128 * 1024 * 1024
"""Largest program: some four million lines. Its moves take about ten times the memory of its text."""

_PLAIN_TEXT: Final = "save it as plain ASCII or UTF-8"


def read_program(
    path: Path | str,
    *,
    dialect: str = "iso",
    tools: Mapping[int, ToolEntry] | None = None,
    home: Point = (0.0, 0.0, 100.0),
    block_delete: bool = False,
    work_offsets: Mapping[str, Point] | None = None,
    rotary: str = "",
    crc_entry: str = "prev",
    crc_corner: str = "arc",
    peck_clearance_mm: float = 0.254,
    taps: str = "reference",
    dwell: str = "s",
    subroutines: Sequence[Path | str] = (),
    start_line: int = 1,
    max_steps: int = 1_000_000,
    stock_top_mm: float | None = None,
    travel_mm: tuple[Point, Point] | None = None,
    blu_mm: float | None = None,
) -> Program:
    """Read a program from a file; parameters as `parse_program`.

    Raises
    ------
    NCError
        The file cannot be read, is binary, UTF-16 or larger than `MAX_BYTES`, or the dialect is unknown.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as exc:
        reason = getattr(exc, "strerror", None) or str(exc)
        raise NCError(f"cannot read the program: {reason}", file=str(path)) from exc
    return parse_program(
        data,
        str(path),
        dialect=dialect,
        tools=tools,
        home=home,
        block_delete=block_delete,
        work_offsets=work_offsets,
        rotary=rotary,
        crc_entry=crc_entry,
        crc_corner=crc_corner,
        peck_clearance_mm=peck_clearance_mm,
        taps=taps,
        dwell=dwell,
        subroutines=(Path(path).parent, *subroutines),
        start_line=start_line,
        max_steps=max_steps,
        stock_top_mm=stock_top_mm,
        travel_mm=travel_mm,
        blu_mm=blu_mm,
    )


def parse_program(
    data: bytes,
    name: str,
    *,
    dialect: str = "iso",
    tools: Mapping[int, ToolEntry] | None = None,
    home: Point = (0.0, 0.0, 100.0),
    block_delete: bool = False,
    work_offsets: Mapping[str, Point] | None = None,
    rotary: str = "",
    crc_entry: str = "prev",
    crc_corner: str = "arc",
    peck_clearance_mm: float = 0.254,
    taps: str = "reference",
    dwell: str = "s",
    subroutines: Sequence[Path | str] = (),
    start_line: int = 1,
    max_steps: int = 1_000_000,
    stock_top_mm: float | None = None,
    travel_mm: tuple[Point, Point] | None = None,
    blu_mm: float | None = None,
) -> Program:
    """Read a program.

    Parameters
    ----------
    data : the bytes of the file; UTF-8 or a one-byte encoding.
    name : used in messages.
    dialect : "iso", "mts", "apt" or "poses"; from `rotary` to `max_steps` the options are those of the first two.
    tools : tool table; None: unknown, tool numbers are not checked and lengths are zero.
    home : mm, simulation frame: where the tool tip starts, and where G28 and G30 go.
    block_delete : skip lines that open with a slash.
    work_offsets : mm, "G54" to "G59.3"; those not named are zero.
    rotary : letters of the rotary axes of the machine, of "ABC".
    crc_entry : "prev": the entry move of cutter compensation is a segment like any other; "next": it goes
        straight to the offset start of the next one.
    crc_corner : "arc" about outer corners, corners that turn by less than 0.05 rad passed over as the reference
        control does; "exact": those are trimmed or rounded too; "miter": points instead of arcs.
    peck_clearance_mm : how far G73 lifts, and G83 stays away, from the last depth.
    taps : in G18 and G19, "reference": beside their holes, as the reference control feeds them; "axis": along it.
    dwell : unit of the P of G4 and of canned cycles (B in mts), "s" or "ms".
    subroutines : folders with subprograms in files of their own, NAME.ngc; `read_program` looks beside the program
        first.
    start_line : restart there: everything before is executed for its modes, offsets and position, but makes
        no moves.
    max_steps : lines that loops and subprograms may repeat.
    stock_top_mm : z of the stock in the simulation frame, for W520. travel_mm : machine coordinates (low,
        high), for E373. blu_mm : smallest step of the machine, for I374.

    Returns
    -------
    Program
        Always, however wrong its blocks are: see `findings`.

    Raises
    ------
    NCError
        Binary or UTF-16 data, a program too large, unknown dialect, option or work offset.
    """
    if dialect not in DIALECTS:
        raise NCError(
            f"dialect '{dialect}' is not supported", file=name, remedy=f"one of {', '.join(DIALECTS)}"
        )
    codes = work_offset_codes()
    for key in work_offsets or {}:
        if key not in codes:
            raise NCError(f"no work offset is called '{key}'", file=name, remedy="G54 to G59, G59.1 to G59.3")
    if crc_entry not in ("prev", "next") or crc_corner not in ("arc", "exact", "miter"):
        raise NCError(
            f"crc_entry '{crc_entry}', crc_corner '{crc_corner}'", remedy="prev or next, arc, exact or miter"
        )
    if taps not in ("reference", "axis"):
        raise NCError(f"taps '{taps}'", file=name, remedy="reference or axis")
    if dwell not in DWELL_UNITS:
        raise NCError(f"dwell '{dwell}'", file=name, remedy="s or ms")
    if not set(rotary) <= set("ABC"):
        raise NCError(f"rotary axes '{rotary}'", file=name, remedy="letters of ABC")
    text = decode_program(data, name)
    files: tuple[str, ...] = ()
    settings = Settings(
        dialect=dialect,
        tools=tools,
        home=(float(home[0]), float(home[1]), float(home[2])),
        block_delete=block_delete,
        work_offsets={codes[key]: value for key, value in (work_offsets or {}).items()},
        rotary=rotary,
        crc_entry=crc_entry,
        crc_corner=crc_corner,
        peck_clearance_mm=peck_clearance_mm,
        taps=taps,
        dwell=dwell,
        subroutines=tuple(Path(folder) for folder in subroutines),
        start_line=start_line,
        max_steps=max_steps,
    )
    if dialect == "apt":
        moves, found, ended = read_apt(text, settings)
    elif dialect == "poses":
        moves, found, ended = read_poses(text, settings)
    else:
        reader = Reader(split_lines(text), settings, decode_program)
        reader.run()
        moves, found, ended = reader.moves, reader.findings, reader.ended
        files = tuple(str(file) for file in reader.files.paths)
    wrong = [item.line for item in found if item.code.startswith(("E1", "E2"))]
    if wrong and (other := recognised(split_lines(text), wrong, dialect)) is not None:
        # one cause instead of a finding for every letter
        what = f"this is {other.what}"
        moves, found = [], [finding("E211", other.line, None, what, other.word, other.col)]
        if other.remedy:
            found = [found[0]._replace(hint=other.remedy)]
    found += check_moves(moves, stock_top_mm, travel_mm, blu_mm)
    findings: tuple[Finding, ...] = tuple(sorted(found, key=lambda f: (f.line, f.col, f.code)))
    return Program(name, data, dialect, tuple(moves), findings, ended, files)


def decode_program(data: bytes, name: str) -> str:
    """Text of a program: UTF-8 (with or without mark), else one character per byte.

    Raises
    ------
    NCError
        UTF-16, UTF-32 or binary, or larger than `MAX_BYTES`.
    """
    if len(data) > MAX_BYTES:
        what = f"the program is larger than {MAX_BYTES // 2**20} MB"
        raise NCError(what, file=name, remedy="split it at a tool change")
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise NCError("the program is UTF-16 text", file=name, line=1, remedy=_PLAIN_TEXT)
    if (zero := data.find(b"\0")) >= 0:
        head = data[:200]
        if (head[::2].count(0) * 3 > len(head)) != (head[1::2].count(0) * 3 > len(head)):
            raise NCError("the program is UTF-16 text", file=name, line=1, remedy=_PLAIN_TEXT)
    if (kind := binary_kind(data)) is not None:
        what = f"the file is binary ({kind}), not a program" if kind else "the file is binary, not a program"
        line = data.count(b"\n", 0, zero) + 1 if zero >= 0 else 1
        remedy = "give the program itself" if kind else _PLAIN_TEXT
        raise NCError(what, file=name, line=line, remedy=remedy)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
