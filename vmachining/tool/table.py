"""`[[tools]]` of a job file -> cutter, with errors that name the key."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from math import radians, tan
from typing import Any

from vmachining.errors import ToolError
from vmachining.tool.apt import AptTool
from vmachining.tool.cutters import BallNose, BullNose, Cutter, FlatEnd, ProfileTool, Taper

COMMON = (
    "number", "name", "type", "length_mm", "flute_length_mm", "flutes", "helix_deg", "shank_diameter_mm", "holder",
)  # fmt: skip
OWN = {
    "flat": ("diameter_mm",),
    "ball": ("diameter_mm",),
    "bull": ("diameter_mm", "corner_radius_mm"),
    "taper": ("diameter_mm", "taper_deg", "corner_radius_mm"),
    "drill": ("diameter_mm", "tip_deg"),
    "apt": ("apt",),
    "profile": ("profile",),
}
MEANINGS = {
    "number": "as the program calls it (T word)",
    "name": "for reports",
    "type": "flat, ball, bull, taper, drill, apt or profile",
    "diameter_mm": "of the cutting part; type taper: at the tip",
    "corner_radius_mm": "radius of the rounded corner; type taper: optional, 0 is flat",
    "taper_deg": "type taper: half angle of the cone",
    "tip_deg": "type drill: whole angle of the tip, 118 where it is not given",
    "apt": "type apt: the seven parameters {d, r, e, f, alpha_deg, beta_deg, h}",
    "profile": "type profile: meridian [[r, z], ...] from the tip up, r >= 0",
    "length_mm": "from the tip to the end of the cutter",
    "flute_length_mm": "cutting edges reach up to here; above it the shank is checked for contact",
    "flutes": "number of teeth",
    "helix_deg": "helix angle of the edges",
    "shank_diameter_mm": "of the shank above the flutes, checked for contact",
    "holder": "meridian [[r_mm, z_mm], ...] from the tip, checked for contact",
}
"""What each key of `[[tools]]` means; the reference pages are made of this."""

TIP_DEG = 118.0
"""Tip angle of a standard twist drill (ISO 5419)."""

APT_LENGTHS = ("d", "r", "e", "f", "h")
APT_ANGLES = ("alpha_deg", "beta_deg")


def tool_from_mapping(mapping: Mapping[str, Any], *, scale: float = 1.0) -> Cutter:
    """Cutter from one `[[tools]]` table.

    mapping : keys `type`, `number`, `name`, `diameter_mm`, `corner_radius_mm`, `length_mm`, ...
    scale : factor on every length, 25.4 where the numbers of the table are inches.
    Raises ToolError: A key that is missing, unknown or of the wrong type, or sizes that make no body. The message names
        the tool's number and the key.
    """
    label = f"tool {mapping['number']}" if "number" in mapping else "tool"
    kind = mapping.get("type")
    if kind not in OWN:
        came = f"type {kind!r} is unknown" if kind is not None else "type is missing"
        raise ToolError(f"{label}: {came}", word="type", remedy=f"one of {', '.join(OWN)}")
    allowed = (*COMMON, *OWN[kind])
    for key in mapping:
        if key not in allowed:
            near = get_close_matches(str(key), allowed, n=1)
            elsewhere = any(key in keys for keys in OWN.values())
            known = f"type {kind!r} takes {', '.join(allowed)}"
            hint = f"did you mean {near[0]}" if near and not elsewhere else known
            raise ToolError(
                f"{label}: key {key} does not belong to type {kind!r}", word=str(key), remedy=hint
            )
    read = _Reader(mapping, label, scale)
    common: dict[str, Any] = {
        "flute_length": read.length("flute_length_mm", None),
        "shank_diameter": read.length("shank_diameter_mm", None),
        "holder": read.meridian("holder", required=False),
        "flutes": read.whole("flutes"),
        "helix_deg": read.number("helix_deg", None),
        "name": str(mapping.get("name", "")),
    }
    try:
        return _build(kind, read, common)
    except ToolError as exc:
        if exc.message.startswith(label):
            raise
        raise ToolError(f"{label}: {exc.message}", word=_key(exc.word, allowed), remedy=exc.remedy) from exc


KINDS = {
    FlatEnd: "flat",
    BallNose: "ball",
    BullNose: "bull",
    Taper: "taper",
    AptTool: "apt",
    ProfileTool: "profile",
}


def mapping_of_tool(tool: Cutter, number: int) -> dict[str, Any]:
    """The `[[tools]]` table of a cutter: what `tool_from_mapping` makes it from."""
    kind = KINDS[type(tool)]
    out: dict[str, Any] = {"number": number, "type": kind}
    for key in (*COMMON[1:2], *OWN[kind], *COMMON[3:]):
        if key == "apt":
            out[key] = {name: getattr(tool, name) for name in (*APT_LENGTHS, *APT_ANGLES)}
        elif key == "profile":
            out[key] = [list(point) for point in tool.points]  # type: ignore[attr-defined]
        elif (value := getattr(tool, key.removesuffix("_mm"))) not in (None, "", ()):
            out[key] = [list(point) for point in value] if key == "holder" else value
    return out


def _build(kind: str, read: _Reader, common: dict[str, Any]) -> Cutter:
    if kind in ("apt", "profile"):
        common["length"] = read.length("length_mm", 0.0)
        if kind == "apt":
            return AptTool(**common, **read.apt())
        return ProfileTool(points=read.meridian("profile"), **common)
    common["length"] = read.length("length_mm")
    diameter = read.length("diameter_mm")
    if kind == "drill":
        tip = read.number("tip_deg", TIP_DEG)
        if not 0.0 < tip <= 180.0:
            raise ToolError(f"tip_deg {tip:g} must lie above 0 and up to 180", word="tip_deg")
        point = 0.5 * diameter / tan(radians(0.5 * tip)) if tip < 180.0 else 0.0
        if not point < common["length"]:
            raise ToolError(f"the tip alone is {point:g} mm long", word="length_mm", remedy="a longer drill")
        cone = [(0.0, 0.0), (0.5 * diameter, point), (0.5 * diameter, common["length"])]
        return ProfileTool(points=cone, **common)
    if kind in ("flat", "ball"):
        return (FlatEnd if kind == "flat" else BallNose)(diameter=diameter, **common)
    if kind == "bull":
        return BullNose(diameter=diameter, corner_radius=read.length("corner_radius_mm"), **common)
    corner = read.length("corner_radius_mm", 0.0)
    return Taper(diameter=diameter, taper_deg=read.number("taper_deg"), corner_radius=corner, **common)


def _key(word: str | None, allowed: Sequence[str]) -> str | None:
    """The table's key for a field of a cutter."""
    return next((key for key in allowed if word and key in (word, f"{word}_mm")), word)


_MISSING: Any = object()


class _Reader:
    """Typed access to one table."""

    def __init__(self, mapping: Mapping[str, Any], label: str, scale: float) -> None:
        self.mapping, self.label, self.scale = mapping, label, scale

    def number(self, key: str, default: Any = _MISSING) -> Any:
        """A float, or the default."""
        value = self.mapping.get(key, default)
        if value is _MISSING:
            raise ToolError(f"{self.label}: {key} is missing", word=key, remedy=f"add {key} = ...")
        return value if value is None or value is default else self._float(key, value)

    def length(self, key: str, default: Any = _MISSING) -> Any:
        value = self.number(key, default)
        return None if value is None else value * self.scale

    def whole(self, key: str) -> int | None:
        value = self.mapping.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int):
            raise ToolError(f"{self.label}: {key} {value!r} is not a whole number", word=key)
        return value

    def meridian(self, key: str, *, required: bool = True) -> tuple[tuple[float, float], ...]:
        rows = self.mapping.get(key)
        if rows is None and not required:
            return ()
        kinds = list, tuple
        if not isinstance(rows, kinds) or not all(isinstance(r, kinds) and len(r) == 2 for r in rows):
            raise ToolError(
                f"{self.label}: {key} must be rows [r_mm, z_mm]", word=key, remedy="from the tip up"
            )
        return tuple((self._float(key, r) * self.scale, self._float(key, z) * self.scale) for r, z in rows)

    def apt(self) -> dict[str, Any]:
        table = self.mapping.get("apt")
        required = (*APT_LENGTHS, *APT_ANGLES)
        if not isinstance(table, Mapping):
            raise ToolError(
                f"{self.label}: apt is missing",
                word="apt",
                remedy=f"add apt = {{ {' = .., '.join(required)} = .. }}",
            )
        for key in table:
            if key not in required:
                raise ToolError(
                    f"{self.label}: apt has no parameter {key}", word=str(key), remedy=", ".join(required)
                )
        for key in required:
            if key not in table:
                raise ToolError(
                    f"{self.label}: apt: {key} is missing", word=key, remedy=f"it needs {', '.join(required)}"
                )
        return {k: self._float(k, table[k]) * (self.scale if k in APT_LENGTHS else 1.0) for k in required}

    def _float(self, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ToolError(f"{self.label}: {key} {value!r} is not a number", word=key)
        return float(value)
