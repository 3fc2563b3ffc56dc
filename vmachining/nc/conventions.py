"""What a program tells of its control: its unit, how I J K of arcs count, and lengths without a decimal point."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from statistics import median
from typing import Final, NamedTuple

from vmachining.nc.fanuc_lines import REMARK
from vmachining.nc.findings import finding
from vmachining.nc.model import Finding
from vmachining.nc.settings import ArcCentres, Settings, UnitName

_NAMED: Final = re.compile(
    r"(?<![A-Z#\[])G[ \t]*0*(?:2[01]|7[01](?![ \t]*[IJLPQRUWZ]))(?![0-9.])|\bG7[01]0\b", re.IGNORECASE
)
"""G70 I, G71 P or G71 Z are holes on a circle, a cycle of a lathe, or the level that cycles of an OSP return to."""
_COMMENT: Final = re.compile(r"\(([^()]*)\)|;(.*)")
_INCH: Final = re.compile(r"\b(?:INCH|INCHES|IPM|IN/MIN)\b|\bUNITS?[ :=]+IN\b|[0-9]\"", re.IGNORECASE)
_MM: Final = re.compile(r"\b(?:MM|MILLIMET(?:ER|RE)S?|METRIC|MM/MIN)\b|[0-9]MM\b", re.IGNORECASE)
_FRACTION: Final = re.compile(
    r"(?<![\d./])\d+/(?:2|4|8|16|32|64)(?![\d/])[- A-Z0-9.]{0,16}?(?:MILL|DRILL|BALL|CUTTER|BIT|REAM|TAP|EM)\b",
    re.IGNORECASE,
)
"""A size of a tool, 1/2 END MILL."""
_PLACE: Final = re.compile(r"[XYZ][ \t]*(-?[0-9]*\.[0-9]*|-?[0-9]+)", re.IGNORECASE)
_FEED: Final = re.compile(r"F[ \t]*([0-9]*\.?[0-9]+)", re.IGNORECASE)

SAMPLE: Final = 5000
FEW: Final = 5
"""Numbers with a fraction from which their decimals say something."""

SLOW, FAST = 60.0, 120.0
"""Feeds per minute that are usual in inches and unusual in mm, and the reverse."""

SMALL, LARGE = 30.0, 60.0
"""Extents that are usual in inches and unusual in mm, and the reverse."""


class Unit(NamedTuple):
    """name : "mm", "inch", or "" where nothing decides. why : the evidence. sure : a comment, or all there is."""

    name: UnitName
    why: str
    sure: bool = False


def names_unit(lines: Sequence[str]) -> bool:
    """Whether some line holds G20, G21, G70, G71, G700 or G710."""
    return any(_NAMED.search(_COMMENT.sub(" ", line)) for line in lines if "G" in line or "g" in line)


def unit_of(lines: Sequence[str]) -> Unit:
    """What the program speaks for: comments first, else two of tools, decimals, feeds and extent without one against."""
    said: list[str] = []
    places, feeds, decimals = list[float](), list[float](), list[int]()
    for line in lines[:SAMPLE]:
        said += [hit[1] or hit[2] or "" for hit in _COMMENT.finditer(line)]
        code = _COMMENT.sub(" ", line)
        for number in _PLACE.findall(code):
            places.append(abs(float(number)) if number.strip("-.") else 0.0)
            if "." in number and number.rstrip(".")[-1:].isdigit() and not number.endswith("."):
                decimals.append(len(number.partition(".")[2]))
        feeds += [float(number) for number in _FEED.findall(code)]
    comment = " ".join(said)
    inch, metric = bool(_INCH.search(comment)), bool(_MM.search(comment))
    if inch != metric:
        return Unit("inch" if inch else "mm", "a comment that names them", True)
    votes = list[tuple[UnitName, str]]()
    if (tool := _FRACTION.search(comment)) is not None:
        votes.append(("inch", f"a tool of {tool[0]}"))
    if len(decimals) >= FEW:
        deepest = max(decimals)
        if deepest in (3, 4):
            votes.append(("inch" if deepest == 4 else "mm", f"{deepest} decimals"))
    if feeds and (middle := median(feeds)) > 0.0 and not SLOW <= middle <= FAST:
        votes.append(("inch" if middle < SLOW else "mm", f"feeds of {middle:g}"))
    if places and (far := max(places)) > 0.0 and (far < SMALL or far > LARGE):
        votes.append(("inch" if far < SMALL else "mm", f"coordinates up to {far:g}"))
    names = {name for name, _ in votes}
    if len(names) == 1 and len(votes) >= 2:
        return Unit(votes[0][0], " and ".join(why for _, why in votes), len(votes) >= 3)
    return Unit("", "nothing in it decides")


ARC_CODES: Final = frozenset({"E302", "E304", "E308"})
"""Findings of arcs whose centre is missing or does not fit their ends."""

CENTRES: Final[tuple[tuple[ArcCentres, bool, str], ...]] = (
    ("start", True, "I J K or R that a block leaves out stay as they were"),
    ("reversed", False, "I J K lead from the centre to the start of their arc"),
    (
        "reversed",
        True,
        "I J K lead from the centre to the start of their arc, and stay where a block leaves them out",
    ),
    ("absolute", False, "I J K are the coordinates of the centre"),
    ("absolute", True, "I J K are the coordinates of the centre, and stay where a block leaves them out"),
)
"""Other ways to count centres than from the start, as controls are set or built to."""

ABSURD: Final = 10_000.0
"""Ten metres, or ten thousand inches: no mill is programmed so far without a decimal point."""

_LENGTH: Final = re.compile(r"(?<![A-Z#\[])[XYZIJR][ \t]*([-+]?[0-9]*\.?[0-9]*)(?![0-9.\[#])", re.IGNORECASE)
_NO_LENGTHS: Final = re.compile(
    r"\bG(?:0?5(?:\.[0-9])?|332|187)(?![0-9.]).*|G8[0-9].*(?=\bJ[0-9]\b)J[0-9]", re.IGNORECASE
)
"""Levels of look-ahead, and how a tap retracts."""

_WEAR: Final = re.compile(r"\(.*\bWEAR COMP\b", re.IGNORECASE)
_OTHER_COMP: Final = re.compile(r"\(.*\b(?:CONTROL|REVERSE WEAR|REV WEAR) COMP\b", re.IGNORECASE)
_BARE: Final = re.compile(r"[XYZIJRxyzijr][ \t]*[-+]?[0-9]+(?![0-9.])")


def arcs_open(findings: Sequence[Finding], codes: Collection[str] = ARC_CODES) -> int:
    return sum(times(item) for item in findings if item.code in codes)


def times(item: Finding) -> int:
    """How many lines say it."""
    more = re.search(r"; ([0-9]+) more lines", item.message)
    return 1 + (int(more[1]) if more else 0)


def closing(
    settings: Settings, findings: Sequence[Finding], read: Callable[[Settings], Sequence[Finding]]
) -> tuple[Settings, list[Finding]]:
    """Settings under which every arc of a program closes, where they do not as Fanuc counts; what is said of it.

    Nothing is taken where one arc stays open: then it is the arc that is wrong.
    """
    control, count = settings.control, arcs_open(findings)
    if not count or control.arc_centres or control.modal_centres or not settings.family:
        return settings, []
    first = next(item for item in findings if item.code in ARC_CODES)
    for centres, modal, what in CENTRES:
        other = replace(settings, control=replace(control, arc_centres=centres, modal_centres=modal))
        now = read(other)
        if arcs_open(now) or arcs_open(now, {"E305"}) > arcs_open(
            findings, {"E305"}
        ):  # radii too small for their arcs
            continue
        text = f"{what}: so all arcs of the program fit, {count} do not as Fanuc counts"
        keys = [f'arc_centres = "{centres}"'] * (centres != "start") + ["modal_centres = true"] * modal
        hint = f"confirm it: {', '.join(keys)} under [program.control], or --control"
        return other, [finding("I213", first.line, None, text, first.word, first.col, hint=hint)]
    return settings, []


LONGEST: Final = 400
"""Characters of a line that comments are looked for in: the cost of a pattern with brackets is the square of a length."""


def worn(lines: Sequence[str], settings: Settings) -> tuple[Settings, list[Finding]]:
    """Comments of Mastercam say of each tool whether its D register holds wear beside a programmed path of the centre."""
    control = settings.control
    if control.compensation or not settings.family:
        return settings, []
    head = {number: line[:LONGEST] for number, line in enumerate(lines[:2000], 1) if "(" in line}
    at = next((number for number, line in head.items() if _WEAR.search(line)), 0)
    if not at or any(map(_OTHER_COMP.search, head.values())):
        return settings, []
    what = "WEAR COMP: the program is the path of the tool centre, and D registers hold wear, taken as zero"
    hint = 'confirm it: compensation = "wear" under [program.control], or "radius"'
    said = finding("I213", at, None, what, "WEAR COMP", hint=hint)
    return replace(settings, control=replace(control, compensation="wear")), [said]


_W: Final = re.compile(r"(?<![A-Z#])W[ \t]*[-+]?[0-9.]", re.IGNORECASE)
_Y: Final = re.compile(r"(?<![A-Z#])Y[ \t]*[-+]?[0-9.]", re.IGNORECASE)
_NO_QUILL: Final = re.compile(r"(?<![A-Z#])(?:U[ \t]*[-+]?[0-9.]|G[ \t]*9[26][ \t]*S)", re.IGNORECASE)
_OWN_W: Final = re.compile(r"(?<![A-Z#])G[ \t]*(?:6[56]|150)(?![0-9]).*", re.IGNORECASE)
"""Marks of lathes, where W is a step along Z; calls of macros and cycles that have their own W."""


def quill(lines: Sequence[str], settings: Settings) -> tuple[Settings, list[Finding]]:
    """A program with W beside Y, and without U: W is the second axis along Z (ISO 841), a quill or a table."""
    control = settings.control
    if control.w or not settings.family:
        return settings, []
    having = ((n, line) for n, line in enumerate(lines, 1) if "W" in line or "w" in line)
    words = ((n, _W.search(_OWN_W.sub(" ", REMARK.sub(" ", line)))) for n, line in having)
    at, word = next(((n, found[0]) for n, found in words if found), (0, ""))
    if not at:  # nearly every program: not a line more is looked at
        return settings, []
    bare = [_OWN_W.sub(" ", REMARK.sub(" ", line)) for line in lines]
    if any(map(_NO_QUILL.search, bare)) or not any(map(_Y.search, bare)):
        return settings, []
    what = "W moves the tool along Z, in addition to Z: the depth is the sum of both, and W starts at 0"
    hint = 'confirm it: w = "z" under [program.control], or --control w=z'
    said = finding("I213", at, None, what, word, hint=hint)
    return replace(settings, control=replace(control, w="z")), [said]


def lengths(lines: Sequence[str], settings: Settings) -> tuple[Settings, list[Finding]]:
    """Whether lengths without a point count increments; W214 where a program has both kinds, and nobody says it."""
    control = settings.control
    if control.increments or not settings.family:
        return settings, []
    bare: tuple[int, str] | None = None
    far, pointed = 0.0, False
    for number, line in enumerate(lines, 1):
        if pointed and not _BARE.search(line):
            continue
        for hit in _LENGTH.finditer(_NO_LENGTHS.sub(" ", REMARK.sub(" ", line))):
            text = hit[1]
            if "." in text:
                pointed = True
            elif text.strip("+-") and float(text):
                bare = bare or (number, hit[0])
                far = max(far, abs(float(text)))
        if pointed and bare:
            break
    if bare is None:
        return settings, []
    at, word = bare
    if pointed:
        what = f"lengths with and without a decimal point: {word} is read as {word}., not as increments of 0.001 mm"
        return settings, [finding("W214", at, None, what, word)]
    if far < ABSURD:
        return settings, []
    what = f"no length has a decimal point, and they reach {far:g}: they count increments of 0.001 mm or 0.0001 inch"
    hint = 'confirm it: increments = "IS-B" under [program.control], or "points"'
    said = finding("I213", at, None, what, word, hint=hint)
    return replace(settings, control=replace(control, increments="IS-B")), [said]
