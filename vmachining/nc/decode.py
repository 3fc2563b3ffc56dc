"""Bytes of a file -> text of a program."""

from __future__ import annotations

import codecs
from typing import Final

from vmachining.errors import NCError
from vmachining.nc.foreign import binary_kind

MAX_BYTES: Final = 128 * 1024 * 1024
"""Largest program: some four million lines. Its moves take about ten times the memory of its text."""

_PLAIN_TEXT: Final = "save it as plain ASCII or UTF-8"


def decode_program(data: bytes, name: str) -> str:
    """Text of a program: UTF-8 (with or without mark), else one character per byte.

    Raises NCError: UTF-16, UTF-32 or binary, or larger than `MAX_BYTES`.
    """
    if len(data) > MAX_BYTES:
        what = f"the program is larger than {MAX_BYTES // 2**20} MB"
        raise NCError(what, file=name, remedy="split it at a tool change")
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise NCError("the program is UTF-16 text", file=name, line=1, remedy=_PLAIN_TEXT)
    kind, zero = binary_kind(data), data.find(b"\0")
    if zero >= 0 and not kind:
        head = data[:200]
        if (head[::2].count(0) * 3 > len(head)) != (head[1::2].count(0) * 3 > len(head)):
            raise NCError("the program is UTF-16 text", file=name, line=1, remedy=_PLAIN_TEXT)
    if kind is not None:
        what = f"the file is binary ({kind}), not a program" if kind else "the file is binary, not a program"
        line = data.count(b"\n", 0, zero) + 1 if zero >= 0 else 1
        remedy = "give the program itself" if kind else _PLAIN_TEXT
        raise NCError(what, file=name, line=line, remedy=remedy)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
