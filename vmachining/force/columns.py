"""Tables of forces that somebody measured: CSV files whose columns end in their unit."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.errors import InputError
from vmachining.textfile import read_text


class MeasuredColumns(NamedTuple):
    """names : of the columns found. values : (n, columns). lines : (n,) in the file."""

    names: tuple[str, ...]
    values: Floats
    lines: Ints


def read_columns(path: Path | str, wanted: tuple[str, ...], what: str) -> MeasuredColumns:
    """The wanted columns in their order, others are left alone; "a|b" represents either.

    Raises InputError: No such file, columns that are missing or name another unit, cells that are no numbers, no row;
        names line and column.
    """
    text = read_text(Path(path), what, InputError, wrong="give a CSV file with a header")
    table = csv.DictReader(io.StringIO(text), skipinitialspace=True)
    header = [name.strip() for name in table.fieldnames or []]
    names = []
    for want in wanted:
        either = want.split("|")
        if found := [name for name in either if name in header]:
            names.append(found[0])
            continue
        stems = {name.split("_")[0] for name in either}
        told = " or ".join(map(repr, either))
        if close := [name for name in header if name.lower().split("_")[0] in stems]:
            raise InputError(
                f"column {close[0]!r} has no unit or another one: expected {told}", file=str(path), line=1,
                remedy="names end in their unit: lengths in mm, feed in mm per tooth, time in s, angles in deg, forces in N",
            )  # fmt: skip
        raise InputError(
            f"column {told} is missing (there are {', '.join(header) or 'none'})", file=str(path), line=1,
            remedy=f"give {', '.join(wanted).replace('|', ' or ')}",
        )  # fmt: skip
    values: list[list[float]] = []
    lines: list[int] = []
    for row in table:
        cells = {(key or "").strip(): value for key, value in row.items() if isinstance(value, str)}
        if not any(value.strip() for value in cells.values()):
            continue
        numbers = []
        for name in names:
            try:
                number = float(cells.get(name, ""))
                if not np.isfinite(number):
                    raise ValueError
            except ValueError:
                raise InputError(
                    f"{name} = {cells.get(name, '')!r} is not a number", file=str(path), line=table.line_num
                ) from None
            numbers.append(number)
        values.append(numbers)
        lines.append(table.line_num)
    if not values:
        raise InputError(
            "there are no rows", file=str(path), remedy="a header, and one row for each measurement"
        )
    return MeasuredColumns(tuple(names), np.array(values), np.array(lines))
