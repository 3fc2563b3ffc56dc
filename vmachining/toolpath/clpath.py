"""A path of the tool as rows of poses, and the three files it is written to: NC program, table of poses, APT."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints, rows
from vmachining.errors import InputError
from vmachining.tool import BallNose, BullNose, FlatEnd

DECIMALS = 5
"""Of millimetres: a point moves by at most 9e-6 mm."""

UPRIGHT = 1e-9
"""An axis that leaves +z by less is upright."""

TILTED = (
    "a program of dialect iso holds no tool axis: it would need the angles of one machine",
    "name one (--machine ac-table), or write .csv (dialect poses) or .cls (dialect apt)",
)


class Mark(IntEnum):
    """Why a point of a path is there."""

    CONTACT = 0
    """The tool touches the part."""
    FREE = 1
    """The tool touches nothing: it is next to the part, or at the floor."""
    LINK = 2
    """On the way from one pass to the next."""
    RAISED = 3
    """Lifted along its axis, because it would have cut into the part elsewhere."""
    TURNED = 4
    """Tilted otherwise than requested, for the same reason."""


@dataclass(frozen=True, slots=True, eq=False)
class CLPath:
    """Poses in order.

    tips : (n, 3) mm. axes : (n, 3), unit. rapid : (n,), of the motion that ends here. marks : (n,) `Mark`.
    notes : what was found.
    """

    tips: Floats
    axes: Floats
    rapid: Bools
    marks: Ints
    notes: tuple[str, ...] = ()

    @classmethod
    def joined(cls, pieces: Iterable[CLPath], *, clear_mm: float, notes: tuple[str, ...] = ()) -> CLPath:
        """Pieces one after the other: the tool retracts from each along its axis to z = `clear_mm` and comes down on the next."""
        parts: list[CLPath] = []
        for piece in pieces:
            down, up = (_above(piece, k, clear_mm) for k in (0, -1))
            parts += [down, piece, up]
        if not parts:
            raise InputError("the path is empty: the tool touches nothing")
        return _in_a_row(parts, notes)

    def followed_by(self, other: CLPath) -> CLPath:
        """Both, with a motion at feed between them."""
        return _in_a_row([self, other], self.notes + other.notes)

    @classmethod
    def upright(cls, tips: ArrayLike, marks: ArrayLike) -> CLPath:
        """One piece at feed, axis +z."""
        points = rows(tips, -1, 3, name="tips")
        up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
        return cls(points, up, np.zeros(len(points), np.bool_), np.asarray(marks, dtype=np.int64))

    @property
    def is_upright(self) -> bool:
        """Three axes are enough."""
        return bool((np.linalg.norm(self.axes[:, :2], axis=1) <= UPRIGHT).all())

    @property
    def feed_length(self) -> float:
        """mm of the tip at feed."""
        return float(np.linalg.norm(np.diff(self.tips, axis=0), axis=1)[~self.rapid[1:]].sum())


def _in_a_row(parts: Sequence[CLPath], notes: tuple[str, ...]) -> CLPath:
    columns = zip(*((p.tips, p.axes, p.rapid, p.marks) for p in parts), strict=True)
    tips, axes, rapid, marks = map(np.concatenate, columns)
    return CLPath(tips, axes, rapid, marks, notes)


def _above(piece: CLPath, k: int, z: float) -> CLPath:
    """The pose over an end of a piece, reached by a rapid."""
    tip, axis = piece.tips[k], piece.axes[k]
    if axis[2] < 0.05:
        raise InputError(
            f"the tool lies on its side at ({tip[0]:.4g}, {tip[1]:.4g}, {tip[2]:.4g}): it cannot be retracted upwards",
            remedy="less lead or tilt, or turn the part",
        )
    over = tip + max(z - tip[2], 0.0) / axis[2] * axis
    return CLPath(over[None], axis[None], np.ones(1, np.bool_), np.full(1, int(Mark.LINK), np.int64))


def cutter(text: str, length_mm: float = 60.0) -> FlatEnd | BallNose | BullNose:
    """Cutter of `flat:10`, `ball:10` or `bull:10:1`: diameter and corner radius, mm.

    Raises InputError, ToolError: No such cutter.
    """
    kind, *sizes = text.replace(",", ":").split(":")
    try:
        numbers = [float(size) for size in sizes]
    except ValueError as exc:
        raise InputError(f"{text!r} is not a cutter", remedy="flat:D, ball:D or bull:D:CORNER, mm") from exc
    if kind == "flat" and len(numbers) == 1:
        return FlatEnd(diameter=numbers[0], length=length_mm)
    if kind == "ball" and len(numbers) == 1:
        return BallNose(diameter=numbers[0], length=length_mm)
    if kind == "bull" and len(numbers) == 2:
        return BullNose(diameter=numbers[0], corner_radius=numbers[1], length=length_mm)
    raise InputError(f"{text!r} is not a cutter", remedy="flat:D, ball:D or bull:D:CORNER, mm")


def words_of(letters: str, values: Iterable[float]) -> list[str]:
    """NC words, one per letter."""
    return [f"{c}{_number(v)}" for c, v in zip(letters, values, strict=True)]


def _number(value: float, decimals: int = DECIMALS) -> str:
    return f"{round(value, decimals) + 0.0:.{decimals}f}".rstrip("0").rstrip(".")


def iso_program(
    path: CLPath, *, feed_mm_min: float, spindle_rev_min: float = 6000.0, tool: int = 1, title: str = ""
) -> str:
    """Program of dialect `iso` for an upright tool: lines only, five decimals, each word only where it changes.

    Raises InputError: A tilted tool, or a feed that is not positive.
    """
    positive(" of mm/min", feed=feed_mm_min)
    if not path.is_upright:
        raise InputError(TILTED[0], remedy=TILTED[1])
    lines = iso_head(title, tool, spindle_rev_min)
    rows = [words_of("XYZ", tip) for tip in path.tips]
    mode = "G0" if path.rapid[0] else "G1"
    lines += [f"{mode} {rows[0][0]} {rows[0][1]}", rows[0][2]]  # sideways first, high above
    lines += changed_lines(rows[1:], path.rapid[1:], feed_mm_min, mode, rows[0])
    return "\n".join([*lines, "M5", "M2"]) + "\n"


def iso_head(title: str, tool: int, spindle_rev_min: float, *more: str) -> list[str]:
    """First lines of a program: its title and `more`, modes, tool and spindle."""
    comments = [f"({title})"] if title else []
    return [*comments, *more, "G21 G17 G90 G94 G40", f"T{tool} M6", f"S{spindle_rev_min:g} M3"]


def changed_lines(
    rows: Sequence[list[str]], rapid: Bools, feed_mm_min: float, mode: str = "", last: Sequence[str] = ()
) -> list[str]:
    """Lines G0 and G1 of rows of words, each word only where it changes; the feed once."""
    lines: list[str] = []
    feed = False
    for words, quick in zip(rows, rapid, strict=True):
        moved = [word for n, word in enumerate(words) if not last or word != last[n]]
        if not moved:
            continue
        new = "G0" if quick else "G1"
        head = [new] if new != mode else []
        tail = [f"F{feed_mm_min:g}"] if new == "G1" and not feed else []
        lines.append(" ".join(head + moved + tail))
        mode, last, feed = new, words, feed or bool(tail)
    return lines


def pose_table(path: CLPath, *, feed_mm_min: float, tool: int = 1, **_: object) -> str:
    """Table of dialect `poses`: tip, axis, feed, rapid, tool."""
    positive(" of mm/min", feed=feed_mm_min)
    lines = ["x_mm,y_mm,z_mm,i,j,k,feed_mm_min,rapid,tool"]
    for tip, axis, rapid in zip(path.tips, path.axes, path.rapid, strict=True):
        cells = [_number(v) for v in tip] + [_number(v, 9) for v in axis]
        lines.append(",".join([*cells, f"{feed_mm_min:g}", "1" if rapid else "0", str(tool)]))
    return "\n".join(lines) + "\n"


def apt_file(
    path: CLPath, *, feed_mm_min: float, spindle_rev_min: float = 6000.0, tool: int = 1, title: str = ""
) -> str:
    """CL file of dialect `apt`: GOTO records with the axis where the tool is tilted (MULTAX)."""
    positive(" of mm/min", feed=feed_mm_min)
    tilted = not path.is_upright
    lines = [f"PARTNO {title or 'VMACHINING'}", "UNITS/MM", *(["MULTAX"] if tilted else [])]
    lines += [f"LOADTL/{tool}", f"SPINDL/{spindle_rev_min:g},CLW", f"FEDRAT/{feed_mm_min:g},MMPM"]
    for tip, axis, rapid in zip(path.tips, path.axes, path.rapid, strict=True):
        numbers = [_number(v) for v in tip] + ([_number(v, 9) for v in axis] if tilted else [])
        lines += (["RAPID"] if rapid else []) + ["GOTO/" + ",".join(numbers)]
    return "\n".join([*lines, "FINI"]) + "\n"


def positive(unit: str = " of mm", **values: float | None) -> None:
    """Raises InputError for the first of the given values that is not positive."""
    for name, value in values.items():
        if value is not None and not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name} {value:g}: give a positive number{unit}")


WRITERS: dict[str, tuple[str, Callable[..., str]]] = {
    ".nc": ("iso", iso_program),
    ".csv": ("poses", pose_table),
    ".cls": ("apt", apt_file),
    ".apt": ("apt", apt_file),
}
"""Suffix of a file -> its dialect, and what writes it."""


def path_job(
    program: str, tool: FlatEnd | BallNose | BullNose, *, low: ArrayLike, high: ArrayLike, dialect: str = "iso",
    home: Floats | None = None, chord_mm: float | None = None, machine: str | None = None,
) -> str:  # fmt: skip
    """Text of a job file, named after its program, that cuts the block between two corners, mm. home : of the tip, mm.
    machine : a chain or its file."""
    kind = {FlatEnd: "flat", BallNose: "ball", BullNose: "bull"}[type(tool)]
    points = (np.asarray(p, dtype=np.float64) for p in (low, high, [0.0] * 3 if home is None else home))
    least, most, begin = (f"[{', '.join(map(_number, point))}]" for point in points)
    key = "file" if machine is not None and machine.endswith(".toml") else "chain"
    name, file, chain = (
        json.dumps(text, ensure_ascii=False) for text in (Path(program).stem, program, machine or "")
    )
    lines = [
        f"name = {name}", "", "[program]", f"file = {file}", f'dialect = "{dialect}"',
        *([] if home is None else [f"home = {begin}"]),
        *([] if machine is None else ["", "[machine]", f"{key} = {chain}"]),
        "", "[[tools]]", "number = 1", f'type = "{kind}"', f"diameter_mm = {tool.diameter:.9g}",
        *([f"corner_radius_mm = {tool.corner_radius:.9g}"] if isinstance(tool, BullNose) else []),
        f"length_mm = {tool.length:.9g}", "", "[stock]", f"box = {{ min = {least}, max = {most} }}",
        *([] if chord_mm is None else ["", "[accuracy]", f"chord_mm = {chord_mm:g}"]),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"
