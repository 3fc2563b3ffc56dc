"""Text files that a user wrote, or one clear reason why they cannot be read."""

from __future__ import annotations

import csv
import json
import math
import re
import tomllib
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining.errors import InputError

if TYPE_CHECKING:
    from vmachining.arrays import Floats

MAX_TEXT = 64 << 20
"""Bytes of a job, machine, tool or CSV file: a million rows of a table fit in."""

SEPARATORS = ";,\t"
"""Of the cells of a table: the first of them that a line holds, or blanks."""

MAX_DEPTH = 64
"""Tables in tables. Job files have four levels; parsers recurse, and tomllib takes memory with the square of it."""


def read_bytes(path: Path, what: str, error: type[InputError], *, missing: str | None = None) -> bytes:
    """All bytes of a file of at most `MAX_TEXT`; a device that never ends is refused there, too.

    what : names the file in the message. missing : remedy if it cannot be read.

    Raises error: It cannot be read, or is larger.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_TEXT + 1)
    except (OSError, ValueError) as exc:  # ValueError: a zero byte in its name
        reason = getattr(exc, "strerror", None) or exc
        raise error(f"cannot read the {what}: {reason}", file=str(path), remedy=missing) from exc
    if len(data) > MAX_TEXT:
        raise error(
            f"larger than {MAX_TEXT >> 20} MB: not a {what}", file=str(path), remedy="is it the right file?"
        )
    return data


def read_text(
    path: Path, what: str, error: type[InputError], *, missing: str | None = None, wrong: str | None = None
) -> str:
    """The whole text of a UTF-8 file, with or without a byte order mark.

    what : names the file in the message. missing, wrong : remedies if it cannot be read, or is no such text.

    Raises error: It cannot be read, is larger than `MAX_TEXT`, or is not UTF-8.
    """
    try:
        return read_bytes(path, what, error, missing=missing).decode("utf-8-sig")
    except UnicodeDecodeError as exc:
        raise error(f"not a UTF-8 text (byte {exc.start})", file=str(path), remedy=wrong) from exc


def csv_rows(path: Path, what: str, wrong: str) -> Iterator[tuple[int, list[str]]]:
    """(line, cells) of every line of a CSV file that is not empty and does not begin with #. The first one is the header; it
    decides the delimiter. what, wrong : see `read_text`.

    Raises InputError: It cannot be read, or is not a CSV table.
    """
    lines = read_text(path, what, InputError, wrong=wrong).splitlines(keepends=True)
    first = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    reader = csv.reader(lines, delimiter=max(",;\t", key=first.count), skipinitialspace=True)
    try:
        for row in reader:
            if any(cell.strip() for cell in row) and not row[0].startswith("#"):
                yield reader.line_num, row
    except csv.Error as exc:
        raise InputError(f"not a CSV table: {exc}", file=path, line=reader.line_num) from exc


def finite(value: Any) -> float | None:
    """The finite number that a cell holds; None if it holds none."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def number_rows(path: Path, columns: tuple[str, ...], what: str, error: type[InputError]) -> Floats:
    """(n, len(columns)): lines of numbers between commas, semicolons, tabs or blanks; further columns are left out.

    One line of names may come first; empty lines and lines that begin with # are left out.
    Raises error: As `read_text`; a line with fewer numbers, with decimal commas, nan, inf or an empty cell, or with more cells
    than the line of names; names in another order; no line.
    """
    found: list[list[float]] = []
    names: list[str] | None = None
    for number, text in enumerate(read_text(path, what, error).splitlines(), 1):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        said = repr(text.strip()[:40])
        if names is None and not found and _is_header(text):
            names = _names(text)
            labels = [label[0] if (label := re.match(r"[a-z]+\d*", name.lower())) else "" for name in names]
            wrong = [name for k, name in enumerate(columns) if name in labels and labels.index(name) != k]
            if wrong:
                raise error(
                    f"column {labels.index(wrong[0]) + 1} is called {wrong[0]}, in {said}", file=str(path), line=number,
                    remedy=f"give the columns in the order {', '.join(columns)}",
                )  # fmt: skip
            continue
        mark = next((mark for mark in SEPARATORS if mark in text), None)
        cells = [cell.strip() for cell in text.split(mark)]
        if "," in text and (";" in text or any(len(cell.split()) > 1 for cell in cells[: len(columns)])):
            raise error(
                f"a decimal comma, or two kinds of separator: {said}",
                file=str(path),
                line=number,
                remedy="write 12.5 for 12,5",
            )
        try:
            values = [float(cell) for cell in cells[: len(columns)]]
        except ValueError:
            values = []
        if len(values) < len(columns) or not all(map(math.isfinite, values)):
            raise error(
                f"expected {', '.join(columns)}, got {said}", file=str(path), line=number,
                remedy="one line has as many numbers as that; one line of names may come first",
            )  # fmt: skip
        while cells and not cells[-1]:
            cells.pop()
        if names is not None and len(cells) > len(names):
            raise error(
                f"{len(cells)} cells below {len(names)} names: {said}", file=str(path), line=number,
                remedy="are there decimal commas? write 12.5 for 12,5",
            )  # fmt: skip
        found.append(values)
    if not found:
        raise error("no line of numbers", file=str(path), remedy=f"give lines of {', '.join(columns)}")
    import numpy as np  # only tables need it, programs are read without

    return np.array(found)


def _is_header(text: str) -> bool:
    """It begins with a letter, and none of its words is a number, nan or inf."""
    return text.lstrip()[0].isalpha() and not any(map(_is_float, re.split(r"[,;\s]+", text)))


def _is_float(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _names(text: str) -> list[str]:
    """Names of a header: between semicolons, commas or tabs; between blanks without their units in brackets."""
    for mark in SEPARATORS:
        if mark in text:
            return [name.strip() for name in text.rstrip(f"{mark} ").split(mark)]
    return [name for name in text.split() if name[0] not in "[("]


def parse_toml(text: str) -> dict[str, Any]:
    """`tomllib.loads`, which also refuses what exhausts the parser: endless nesting, numbers of thousands of digits.

    Raises tomllib.TOMLDecodeError: Not TOML, or nested deeper than `MAX_DEPTH`.
    """
    for number, line in enumerate(text.splitlines(), 1):
        if line.count(".") > MAX_DEPTH and _longest_key(line) > MAX_DEPTH:
            raise tomllib.TOMLDecodeError(
                f"A key of more than {MAX_DEPTH} parts (at line {number}, column 1)"
            )
    try:
        data = tomllib.loads(text)
    except RecursionError as exc:
        raise tomllib.TOMLDecodeError(f"Nested deeper than {MAX_DEPTH} levels") from exc
    except tomllib.TOMLDecodeError:
        raise
    except ValueError as exc:  # int() and date() refuse more than the grammar does
        raise tomllib.TOMLDecodeError(_digits(exc)) from exc
    if _depth(data) > MAX_DEPTH:
        raise tomllib.TOMLDecodeError(f"Nested deeper than {MAX_DEPTH} levels")
    return data


def parse_json(text: str) -> Any:
    """`json.loads`, where everything refused is a ValueError: nesting and numbers of thousands of digits, too."""
    try:
        return json.loads(text)
    except RecursionError as exc:
        raise json.JSONDecodeError("nested too deep", text[:1], 0) from exc
    except json.JSONDecodeError:
        raise
    except ValueError as exc:
        raise json.JSONDecodeError(_digits(exc), text[:1], 0) from exc


def _digits(exc: ValueError) -> str:
    return "A number of thousands of digits" if "digits" in str(exc) else str(exc)


def _longest_key(line: str) -> int:
    """Parts of the longest dotted key that the line may hold."""
    runs = (run.split(".") for run in re.split(r"[^\w.\s\"'-]+", line))
    words = (
        (word, list(same)) for run in runs for word, same in groupby(run, lambda part: bool(part.strip()))
    )
    return max((len(same) for word, same in words if word), default=0)


def _depth(data: Any) -> int:
    """Levels of tables and arrays, without recursion."""
    depth, level = 0, [data]
    while level := [
        inner
        for outer in level
        if isinstance(outer, dict | list)
        for inner in (outer.values() if isinstance(outer, dict) else outer)
    ]:
        depth += 1
    return depth
