"""What a program does not say of its tools: words of `--tool`, libraries beside it, drafts that nobody has edited yet."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Final
from zlib import crc32

from vmachining.errors import InputError, VMachiningError
from vmachining.nc.toolcomments import INCH, NUMBER, ToolNote, value_of
from vmachining.nc.toollibrary import read_tool_library
from vmachining.textfile import MAX_TEXT

GIVEN: Final = "--tool"
"""Text of a note that the user gave on the command line."""

KINDS: Final = ("flat", "ball", "bull", "drill", "chamfer", "taper")
_FORM: Final = "NUMBER=TYPE:DIAMETER, such as 3=ball:10, 1=flat:1/2in, 2=bull:12:1.5 (corner), 4=drill:8.5:118 (tip angle)"
_WORD: Final = re.compile(
    rf"0*(\d{{1,6}})\s*=\s*(?:({'|'.join(KINDS)})\s*:)?\s*{NUMBER}\s*(mm|inch|in|\")?"
    rf"(?:\s*:\s*{NUMBER}\s*(mm|inch|in|\"|deg)?)?",
    re.IGNORECASE,
)
SECOND: Final = {"bull": "corner", "drill": "angle", "chamfer": "angle", "taper": "angle"}
MOST_MM: Final = 1000.0

_LIBRARY: Final = re.compile(r".*\.(?:tools|fctl|tbl)|tool\.t|.*tool.*\.(?:csv|json)", re.IGNORECASE)
"""Names of files that hold tools and nothing else."""

_SIGNED: Final = re.compile(r"\n# drafted( .*)?; ([0-9a-f]{8})\n?\Z")


def parse_tools(words: Sequence[str]) -> dict[int, ToolNote]:
    """Tools of `--tool` by number; sizes are mm unless a unit follows them.

    Raises InputError: Another form, a size out of range, a tool that is given twice.
    """
    found: dict[int, ToolNote] = {}
    for word in words:
        hit = _WORD.fullmatch(word.strip())
        if hit is None:
            raise InputError(f"--tool {word}: it must be {_FORM}")
        if any(re.search(r"/0+$", text) for text in (hit[3], hit[5]) if text is not None):
            raise InputError(f"--tool {word}: a fraction over 0", remedy=f"it must be {_FORM}")
        number, kind = int(hit[1]), (hit[2] or "").lower() or None
        diameter = _mm(hit[3], hit[4])
        if not 0.0 < diameter <= MOST_MM:
            remedy = f"above 0, at most {MOST_MM:g} mm"
            raise InputError(f"--tool {word}: a diameter of {diameter:g} mm", remedy=remedy)
        corner = angle = None
        if hit[5] is not None:
            role = SECOND.get(kind or "")
            if role is None or (hit[6] and (hit[6].lower() == "deg") != (role == "angle")):
                raise InputError(
                    f"--tool {word}: {kind or 'a tool without a type'} has one size", remedy=_FORM
                )
            if role == "corner":
                corner = _mm(hit[5], hit[6])
            else:
                angle = value_of(hit[5]) / (2.0 if kind == "chamfer" else 1.0)
        if kind == "bull" and not (corner is not None and 0.0 < corner <= diameter / 2.0):
            what = "bull needs its corner radius, at most half of the diameter"
            raise InputError(f"--tool {word}: {what}", remedy=_FORM)
        if kind == "taper" and angle is None:
            raise InputError(
                f"--tool {word}: taper needs its half angle in degrees", remedy="such as 5=taper:1:7"
            )
        if number in found:
            raise InputError(f"--tool {word}: tool {number} is given twice")
        found[number] = ToolNote(0, GIVEN, kind, diameter, 0.0 if kind == "flat" else corner, angle)
    return found


def _mm(text: str, unit: str | None) -> float:
    return round(value_of(text) * (1.0 if (unit or "mm").lower() == "mm" else INCH), 9)


def word_of(number: int, kind: str | None, inch: bool) -> str:
    """The option that gives a tool; what is not known stands there as words to replace."""
    unit = "in" if inch else ""
    more = {"bull": f":CORNER{unit}", "taper": ":HALF_ANGLE"}.get(kind or "", "")
    return f"--tool {number}={kind if kind in KINDS else 'TYPE'}:DIAMETER{unit}{more}"


def libraries_beside(program: Path, scale: float) -> tuple[dict[Path, dict[int, ToolNote]], list[str]]:
    """Tool libraries in the directory of a program, by their names; and of each that cannot be read, why.

    scale : as of `read_tool_library`.
    """
    found: dict[Path, dict[int, ToolNote]] = {}
    refused: list[str] = []
    try:
        entries = sorted(program.absolute().parent.iterdir())
    except OSError:
        return found, refused
    for path in entries:
        if _LIBRARY.fullmatch(path.name) and path.is_file():
            try:
                found[path] = read_tool_library(path, scale)
            except VMachiningError as exc:
                refused.append(f"tool library {path.name} beside the program is left out, {exc.message}")
    return found, refused


def signed(text: str, words: Sequence[str]) -> str:
    """A draft with a last line by which it is known as long as nobody edits it; words : options that it was made with."""
    told = f" with {shlex.join(words)}" if words else ""
    return f"{text}# drafted{told}; {crc32(text.encode()):08x}\n"


def made_with(path: Path) -> list[str] | None:
    """Options of a draft that nobody has edited; None of any other file."""
    try:
        with path.open("rb") as file:
            text = file.read(MAX_TEXT).decode("utf-8")
    except (OSError, UnicodeDecodeError):
        return None
    hit = _SIGNED.search(text)
    if hit is None or f"{crc32(text[: hit.start() + 1].encode()):08x}" != hit[2]:
        return None
    try:
        return shlex.split((hit[1] or "").removeprefix(" with"))
    except ValueError:
        return None
