"""Records of a cutter location file: WORD/value, value, ... ; `$$` opens a comment, a single `$` continues a record."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, NamedTuple

from vmachining.nc.refusal import RecordError

MAX_RECORD: Final = 4096

COMMENTS: Final = frozenset(
    {"PARTNO", "PPRINT", "REMARK", "TOOL PATH", "MACHIN", "LEADER", "PAINT", "INSERT", "TPRINT", "TDATA", "PRINT", "LETTER",
     "NOTE", "OP NAME", "OPNAME", "$$", "LOAD TOOL NAME"}
)  # fmt: skip
"""Words whose rest is text; `TOOL PATH` and `INSERT` are looked at for what they say of tools."""

_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][+-]?\d{1,3})?")
_WORD: Final = re.compile(r"[A-Z][A-Z0-9_.-]*(?: [A-Z0-9][A-Z0-9_.-]*)*")
_NAME: Final = re.compile(r"(?:[A-Z_]|[0-9]+[A-Z]{2})[A-Z0-9_.+-]*")


class Record(NamedTuple):
    """line : 1-based. word : upper case. numbers, names : what follows the slash, each in order; values : both.

    text : what follows the slash, as it stands there.
    """

    line: int
    word: str
    numbers: list[float]
    names: list[str]
    values: list[float | str]
    text: str = ""

    def after(self, *names: str) -> float | None:
        """The number behind one of these names, None where none exists."""
        for name, value in zip(self.values, self.values[1:], strict=False):
            if name in names and isinstance(value, float):
                return value
        return None


def records(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Records with the line they start on: comments gone, continuations joined."""
    begin, held = 0, list[str]()
    size = 0
    for line, raw in enumerate(lines, 1):
        text = raw.split("$$", 1)[0].rstrip()
        more = text.endswith("$")
        held.append(text.removesuffix("$"))
        size += len(text)
        begin = begin or line
        if more and size <= MAX_RECORD:
            continue
        if joined := "".join(held).strip():
            yield begin, joined
        begin, held, size = 0, [], 0
    if joined := "".join(held).strip():
        yield begin, joined


def parse_record(line: int, record: str) -> Record:
    """Word and values of a record.

    Raises RecordError: E102, E105, E106, E109.
    """
    if len(record) > MAX_RECORD:
        raise RecordError("E105", f"the record has {len(record)} characters, at most {MAX_RECORD} are read")
    head, slash, tail = record.partition("/")
    word = " ".join(head.upper().split())
    if word.startswith("TLON,"):  # the only word with a modifier before its slash
        word = "TLON"
    for name in COMMENTS:
        if word == name or (word.startswith(name + " ") and name != "TOOL PATH"):
            return Record(line, name, [], [], [], tail.strip() if slash else word.removeprefix(name).strip())
    if not record.isascii():
        raise RecordError("E106", "only ASCII characters are allowed outside a comment")
    if not _WORD.fullmatch(word):
        raise RecordError("E109", f"'{word[:40]}' is not a word of a cutter location file")
    numbers, names, values = list[float](), list[str](), list[float | str]()
    for part in tail.replace("(", ",(,").replace(")", ",),").split(",") if tail.strip() else []:
        part = part.strip().upper()
        if _NUMBER.fullmatch(part):
            value = float(part.replace("D", "E"))
            if not abs(value) < 1e9:
                raise RecordError("E102", f"{part} is out of range")
            numbers.append(value)
            values.append(value)
        elif _NAME.fullmatch(part) or part in ("(", ")") or _WORD.fullmatch(part) or "/" in part:
            names.append(part)
            values.append(part)
        elif part or ("(" not in tail and tail.strip()):
            raise RecordError("E102", f"'{part[:40]}' is neither a number nor a word")
    return Record(line, word, numbers, names, values, tail.strip())
