"""Logs of machines to columns: item by item (time|item|value, also several pairs per line), MTConnect XML, or a CSV table.

Items and columns are known by many names (`NAMES`); case, blanks and punctuation do not count. A line that cannot be read is
counted and left out; a clock that runs back ends a stretch, so nothing is measured across it.
"""

from __future__ import annotations

import csv
import gzip
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.errors import InputError

NAMES = {
    "line": ("blocknumber", "linenumber", "line", "programline", "currentline", "seqline", "block"),
    "feed": ("feedoverride", "pathfeedrateoverride", "pathfeedrateoverrideprogrammed", "fovr", "feedovr"),
    "rapid": ("rapidoverride", "pathfeedrateoverriderapid", "rovr", "rapidovr"),
    "status": ("programstatus", "execution", "status", "executionstate"),
    "program": ("programnamerunning", "program", "programname"),
    "time": ("time", "timestamp", "times", "seconds", "ts", "t"),
    "speed": ("feedrate", "pathfeedrate", "pathfeedrateactual", "fact"),
    "load": ("spindleload", "load", "sload"),
    "tool": ("currenttool", "toolnumber", "toolnumberrunning", "tool"),
}
KNOWN = {name: key for key, names in NAMES.items() for name in names}
RUNNING = ("ACTIVE", "PROGRAM_COMPLETED", "READY", "")
"""States in which the time of a block counts; every other one (FEED_HOLD, INTERRUPTED, PROGRAM_STOPPED) is a pause."""

MAX_BYTES = 512 * 2**20


class Series(NamedTuple):
    """Values (k,) that hold from times (k,) s on."""

    time: Floats
    value: Floats

    def _between(self, begin: float, end: float, default: float) -> tuple[Floats, Floats]:
        """Times at which values begin to hold within [begin, end], and these; `default` before the first one."""
        first = int(np.searchsorted(self.time, begin, side="right"))
        last = int(np.searchsorted(self.time, end, side="left"))
        before = default if first == 0 else float(self.value[first - 1])
        return np.append(begin, self.time[first:last]), np.append(before, self.value[first:last])

    def mean(self, begin: float, end: float, default: float) -> float:
        """Mean over [begin, end]; `default` before the first value."""
        at, held = self._between(begin, end, default)
        return (
            float((np.diff(at, append=end) * held).sum() / (end - begin)) if end > begin else float(held[0])
        )

    def least(self, begin: float, end: float, default: float) -> float:
        """Smallest value that holds anywhere in [begin, end]."""
        return float(self._between(begin, end, default)[1].min())

    def median(self, begin: float, end: float) -> float:
        """Of the values that begin in [begin, end), NaN without."""
        a, b = np.searchsorted(self.time, [begin, end])
        return float(np.median(self.value[a:b])) if b > a else float("nan")


@dataclass(frozen=True, slots=True, eq=False)
class Log:
    """time : (n,) s from the first entry, at which line (n,) began. feed, rapid : overrides, 1 is 100 %. running : 1 or 0.

    speed : mm/min or the unit of the log. tool : number in the spindle. skipped : entries that could not be read.
    """

    name: str
    time: Floats
    line: Ints
    feed: Series
    rapid: Series
    running: Series
    speed: Series
    load: Series
    tool: Series
    skipped: int


def read_log(path: Path | str) -> Log:
    """A log in any of the formats, also gzipped.

    Raises InputError: No file, too large, an XML file with a document type, another format, no block
        numbers.
    """
    path = Path(path)
    text = _text(path)
    head, skipped = [*text.lstrip()[:2000].splitlines(), ""][0], [0]
    if head.startswith("<"):
        entries = _xml(path, text)
    elif "|" in head:
        entries = _piped(text, skipped)
    elif re.search(r"[,;\t]", head):
        entries = _table(path, text, skipped)
    else:
        what = "lines of time|item|value, MTConnect XML, or a table with columns time and line are read"
        raise InputError(f"is not a log: {what}", file=path)
    return _columns(path, list(entries), skipped)


def _text(path: Path) -> str:
    try:
        data = path.read_bytes()
        if data[:2] == b"\x1f\x8b":
            with gzip.open(path) as file:
                data = file.read(MAX_BYTES + 1)
    except (OSError, EOFError) as exc:
        raise InputError(f"cannot be read: {exc}", file=path) from exc
    if len(data) > MAX_BYTES:
        raise InputError(f"has more than {MAX_BYTES // 2**20} MB", file=path, remedy="cut the log")
    return data.decode("utf-8", errors="replace").lstrip("\ufeff")


Entry = tuple[float, str, str]


def _key(name: str) -> str | None:
    return KNOWN.get(re.sub(r"[^a-z]", "", name.lower()))


def _seconds(text: str) -> float | None:
    text = text.strip()
    try:
        return value if math.isfinite(value := float(text)) else None
    except ValueError:
        pass
    found = re.fullmatch(r"(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d:\d\d)(\.\d+)?(Z|[+-]\d\d:?\d\d)?", text)
    if not found:
        return None
    try:
        whole = datetime.fromisoformat(f"{found[1]}T{found[2]}{(found[4] or '').replace('Z', '+00:00')}")
    except ValueError:
        return None
    stamp = whole.replace(tzinfo=whole.tzinfo or UTC)
    return stamp.timestamp() + float(found[3] or 0.0)


def _piped(text: str, skipped: list[int]) -> Iterator[Entry]:
    for line in text.splitlines():
        cells = line.split("|")
        time = _seconds(cells[0])
        if time is None or len(cells) < 3:
            skipped[0] += bool(line.strip())
            continue
        for name, value in zip(cells[1::2], cells[2::2], strict=False):
            if (key := _key(name)) is not None:
                yield time, key, value.strip()


def _xml(path: Path, text: str) -> Iterator[Entry]:
    if re.search(r"<!(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise InputError("declares a document type, which logs do not have", file=path)
    try:
        root = ElementTree.fromstring(text.encode("utf-8"))
    except ElementTree.ParseError as exc:
        raise InputError(f"is not XML: {exc}", file=path) from exc
    for element in root.iter():
        time = _seconds(element.get("timestamp", ""))
        if time is None:
            continue
        tag = str(element.tag).rsplit("}", 1)[-1]
        sub = element.get("subType", "")
        names = (tag + sub, tag, element.get("name", ""), element.get("dataItemId", ""))
        if (key := next(filter(None, map(_key, names)), None)) is not None:
            yield time, key, (element.text or "").strip()


def _table(path: Path, text: str, skipped: list[int]) -> Iterator[Entry]:
    first = text.splitlines()[0]
    mark = max(",;\t", key=first.count)
    reader = csv.reader(text.splitlines(), delimiter=mark)
    keys = [_key(cell) for cell in next(reader)]
    if "time" not in keys or "line" not in keys:
        remedy = "name them, e.g. time,line,feed_override,rapid_override"
        raise InputError(
            f"its first line lacks the columns time and line: {first[:80]!r}", file=path, remedy=remedy
        )
    at = keys.index("time")
    for cells in reader:
        time = _seconds(cells[at]) if len(cells) == len(keys) else None
        if time is None:
            skipped[0] += bool(cells)
            continue
        for key, value in zip(keys, cells, strict=True):
            if key is not None and key != "time":
                yield time, key, value.strip()


def _columns(path: Path, entries: list[Entry], skipped: list[int]) -> Log:
    found: dict[str, list[tuple[float, float]]] = {key: [] for key in NAMES}
    states: list[tuple[float, float]] = []
    for time, key, value in entries:
        if key == "status":
            states.append((time, 1.0 if value.upper() in RUNNING else 0.0))
        elif key not in ("program", "time"):
            number = _seconds(value) if re.fullmatch(r"[-+.\deE]+", value) else None
            if number is None:
                skipped[0] += value.upper() not in ("", "UNAVAILABLE")
            else:
                found[key].append((time, number))
    lines = [(t, v) for t, v in found["line"] if v >= 0 and v == int(v)]
    if len(lines) < 2:
        remedy = "expected an item Block_Number, Line or LineNumber"
        raise InputError("has no block numbers", file=path, remedy=remedy)
    begin = lines[0][0]

    def series(values: list[tuple[float, float]], scale: float = 1.0) -> Series:
        columns = np.array(values, dtype=np.float64).reshape(-1, 2)
        order = np.argsort(columns[:, 0], kind="stable")
        return Series(columns[order, 0] - begin, columns[order, 1] * scale)

    def share(values: list[tuple[float, float]]) -> Series:
        """Overrides are percent, unless none is above 2."""
        return series(values, 1.0 if 0.0 < max((v for _, v in values), default=100.0) <= 2.0 else 0.01)

    table = np.array(lines)
    return Log(
        path.name, table[:, 0] - begin, table[:, 1].astype(np.int64), share(found["feed"]),
        share(found["rapid"]), series(states), series(found["speed"]), series(found["load"]), series(found["tool"]),
        skipped[0],
    )  # fmt: skip
