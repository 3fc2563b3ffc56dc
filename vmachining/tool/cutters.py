"""The cutters a job can name. Each is checked once at birth and carries its meridian.

Tip at the origin, axis +z towards the spindle, lengths in mm, angles in degrees where the name says so.
"""

from __future__ import annotations

import dataclasses
from abc import ABCMeta, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from vmachining.arrays import Floats
from vmachining.errors import ToolError
from vmachining.tool.profile import Profile


class Named(ABCMeta):
    """Metaclass of dataclasses whose fields are given by name."""

    if not TYPE_CHECKING:  # the signature of the dataclass is the one to check calls against

        def __call__(cls, *args: Any, **given: Any) -> Any:
            _refuse(cls, args, given)
            return super().__call__(**given)


def _refuse(cls: Any, args: tuple[Any, ...], given: dict[str, Any]) -> None:
    """ToolError for values without names, unknown names, missing sizes, and values that are not numbers."""
    fields = {field.name: field for field in dataclasses.fields(cls) if field.init}
    required = [name for name, field in fields.items() if field.default is dataclasses.MISSING]
    required.sort(key=lambda name: name == "length")  # the sizes of the tip first
    name = cls.__name__
    if args:
        said = [f"{key}={value!r}" for key, value in zip(required, args, strict=False)]
        left = [f"{key}=..." for key in required[len(args) :] if key not in given]
        kept = [f"{key}={value!r}" for key, value in given.items()]
        raise ToolError(
            f"{name} takes its sizes by name", remedy=f"{name}({', '.join([*said, *kept, *left])}), in mm"
        )
    for key in given:
        if key not in fields:
            close = get_close_matches(key, fields, n=1, cutoff=0.4)
            remedy = f"did you mean {close[0]}?" if close else f"it has {', '.join(fields)}"
            raise ToolError(f"{name} has no {key}", word=key, remedy=remedy)
    if missing := [key for key in required if key not in given]:
        example = ", ".join(f"{key}={given[key]!r}" if key in given else f"{key}=..." for key in required)
        raise ToolError(
            f"{name} lacks {' and '.join(missing)}", word=missing[0], remedy=f"{name}({example}), in mm"
        )
    for key, value in given.items():
        number = "float" in str(fields[key].type)
        if value is None and "None" in str(fields[key].type):
            continue
        if number and (isinstance(value, str | bytes | bool) or not hasattr(value, "__float__")):
            raise ToolError(
                f"{name}: {key} = {value!r} is not a number", word=key, remedy="give it in mm or degrees"
            )


__all__ = ["BallNose", "BullNose", "Cutter", "FlatEnd", "ProfileTool", "Taper", "Tool"]

Meridian: TypeAlias = Sequence[Sequence[float]]


def positive(name: str, value: float) -> None:
    """Refuse a size that is not a finite number above zero."""
    if not (np.isfinite(value) and value > 0):
        need = "finite" if value > 0 else "above zero"
        raise ToolError(
            f"{name} {value:g} mm must be {need}", word=name, remedy="give the size of the real tool"
        )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Cutter(metaclass=Named):
    """What every cutter has.

    length : mm from the tip to the flat disc where the tool ends.
    flute_length : mm from the tip that cut; None: all of it.
    shank_diameter : mm above the flutes; None: the shank cannot collide.
    holder : meridian ((r, z), ...) above the flutes, z in mm from the tool tip; empty: none.
    flutes, helix_deg : number of teeth and helix angle, for the feed side; they do not change the shape.
    """

    length: float
    flute_length: float | None = None
    shank_diameter: float | None = None
    holder: Meridian = ()
    flutes: int | None = None
    helix_deg: float | None = None
    name: str = ""
    profile: Profile = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        positive("length", self.length)
        if self.flute_length is not None:
            positive("flute_length", self.flute_length)
            if self.flute_length > self.length:
                raise ToolError(
                    f"flute_length {self.flute_length:g} mm is longer than length {self.length:g} mm",
                    word="flute_length",
                    remedy="length is the whole tool, from the tip to the holder",
                )
        if self.shank_diameter is not None:
            positive("shank_diameter", self.shank_diameter)
        if self.flutes is not None and self.flutes < 1:
            raise ToolError(f"flutes {self.flutes} must be at least 1", word="flutes")
        if self.helix_deg is not None and not -90 < self.helix_deg < 90:
            raise ToolError(f"helix_deg {self.helix_deg:g} must lie between -90 and 90", word="helix_deg")
        self._check()
        object.__setattr__(self, "profile", self._meridian())
        if not self.name:
            object.__setattr__(self, "name", self._label())
        if len(self.holder):
            _ = self.holder_profile

    def __repr__(self) -> str:
        """As it was made: the sizes given, those of the tip first."""
        own = {f.name: self._label() if f.name == "name" else f.default for f in fields(self) if f.init}
        given = {
            name: getattr(self, name) for name in sorted(own, key=Cutter.__dataclass_fields__.__contains__)
        }
        sizes = [
            f"{name}={value:.9g}" if isinstance(value, float) else f"{name}={value!r}"
            for name, value in given.items()
            if value != own[name]
        ]
        return f"{type(self).__name__}({', '.join(sizes)})"

    @abstractmethod
    def _check(self) -> None:
        """Refuse sizes that do not make a body."""

    @abstractmethod
    def _meridian(self) -> Profile:
        """From the tip to `length`."""

    @abstractmethod
    def _label(self) -> str:
        """A short name made of the sizes."""

    @property
    def cutter(self) -> Profile:
        """The part that cuts: tip to `flute_length`."""
        if self.flute_length is None or self.flute_length >= self.length:
            return self.profile
        return self.profile.clip(0.0, self.flute_length)

    @property
    def shank(self) -> Profile | None:
        """Cylinder above the flutes; None unless `flute_length` and `shank_diameter` are set."""
        if self.flute_length is None or self.shank_diameter is None or self.flute_length >= self.length:
            return None
        r = self.shank_diameter / 2
        return Profile([(r, self.flute_length), (r, self.length)])

    @property
    def holder_profile(self) -> Profile | None:
        """Meridian of the holder, heights from the tool tip."""
        if not len(self.holder):
            return None
        try:
            return Profile([tuple(row) for row in self.holder])
        except (ToolError, ValueError, TypeError) as exc:
            raise ToolError(f"holder: {exc}", word="holder", remedy="give rows (r, z) with rising z") from exc


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class FlatEnd(Cutter):
    """Cylinder with a flat bottom."""

    diameter: float

    def _check(self) -> None:
        positive("diameter", self.diameter)

    def _meridian(self) -> Profile:
        r = self.diameter / 2
        return Profile([(r, 0.0), (r, self.length)])

    def _label(self) -> str:
        return f"flat D{self.diameter:g}"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class BallNose(Cutter):
    """Cylinder with a half ball at the tip."""

    diameter: float

    def _check(self) -> None:
        positive("diameter", self.diameter)
        _corner_fits(self.length, self.diameter / 2)

    def _meridian(self) -> Profile:
        return corner_profile(self.diameter / 2, self.diameter / 2, 0.0, self.length)

    def _label(self) -> str:
        return f"ball D{self.diameter:g}"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class BullNose(Cutter):
    """Toroidal end mill: a cylinder whose bottom edge is rounded by `corner_radius` (0 flat, D/2 ball)."""

    diameter: float
    corner_radius: float

    def _check(self) -> None:
        positive("diameter", self.diameter)
        check_corner(self.corner_radius, self.diameter)
        _corner_fits(self.length, self.corner_radius)

    def _meridian(self) -> Profile:
        return corner_profile(self.diameter / 2, self.corner_radius, 0.0, self.length)

    def _label(self) -> str:
        return f"bull D{self.diameter:g} r{self.corner_radius:g}"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Taper(Cutter):
    """Cone that widens from the tip by `taper_deg` (half angle); negative narrows it, as on a dovetail.

    `diameter` is that of the tip: of the flat end when `corner_radius` is 0, of the corner torus or of the
    ball (corner_radius = diameter / 2) before the cone continues it tangentially.
    """

    diameter: float
    taper_deg: float
    corner_radius: float = 0.0

    def _check(self) -> None:
        positive("diameter", self.diameter)
        check_corner(self.corner_radius, self.diameter)
        if not -90 < self.taper_deg < 90:
            raise ToolError(
                f"taper_deg {self.taper_deg:g} must lie between -90 and 90", word="taper_deg",
                remedy="it is the half angle between axis and flank",
            )  # fmt: skip
        joint = self.corner_radius * (1.0 - np.sin(np.radians(self.taper_deg)))
        _corner_fits(self.length, joint)

    def _meridian(self) -> Profile:
        return corner_profile(self.diameter / 2, self.corner_radius, np.radians(self.taper_deg), self.length)

    def _label(self) -> str:
        corner = f" r{self.corner_radius:g}" if self.corner_radius else ""
        return f"taper D{self.diameter:g}{corner} {self.taper_deg:g}°"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ProfileTool(Cutter):
    """Free meridian: straight lines through `points` (r, z) from the tip up, tip at z = 0.

    `length` defaults to the last height; a longer tool continues as a cylinder.
    """

    points: Meridian
    length: float = 0.0

    def __post_init__(self) -> None:
        if not self.length:
            object.__setattr__(self, "length", float(self._points()[-1, 1]))
        super(ProfileTool, self).__post_init__()

    def _points(self) -> Floats:
        rows = np.array(self.points, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != 2 or len(rows) < 2:
            raise ToolError("profile: give at least two rows [r, z]", word="profile")
        return rows

    def _check(self) -> None:
        rows = self._points()
        if rows[0, 1] != 0.0:
            raise ToolError(
                f"profile: starts at z {rows[0, 1]:g} mm", word="profile", remedy="the tip is z = 0"
            )
        if rows[-1, 1] > self.length:
            raise ToolError(
                f"length {self.length:g} mm is shorter than the profile, {rows[-1, 1]:g} mm", word="length",
                remedy="give a length that reaches the last height, or leave it out",
            )  # fmt: skip

    def _meridian(self) -> Profile:
        rows = [(float(r), float(z)) for r, z in self.points]
        if self.length > rows[-1][1]:
            rows.append((rows[-1][0], self.length))
        return Profile(rows)

    def _label(self) -> str:
        return f"profile D{2 * self.profile.max_radius:g}"

    @property
    def diameter(self) -> float:
        """mm, the largest one."""
        return 2 * self.profile.max_radius


def check_corner(corner_radius: float, diameter: float) -> None:
    """Refuse a corner that does not fit under the tool."""
    if not 0 <= corner_radius <= diameter / 2:
        raise ToolError(
            f"corner_radius {corner_radius:g} mm outside [0, {diameter / 2:g}] mm", word="corner_radius",
            remedy="at most half the diameter; equal to it is a ball",
        )  # fmt: skip


def _corner_fits(length: float, corner: float) -> None:
    if corner > length:
        raise ToolError(
            f"length {length:g} mm ends inside the corner, which is {corner:g} mm high", word="length",
            remedy="make the tool at least as long as its corner",
        )  # fmt: skip


def corner_profile(radius: float, corner: float, half_angle: float, length: float) -> Profile:
    """Flat bottom, tangent corner arc, tangent flank.

    radius : mm, outer radius of the corner torus (of the flat end if corner is 0).
    corner : mm. half_angle : rad between axis and flank. length : mm.

    The corner turns from the bottom (normal -90 degrees) to the flank (normal -half_angle), so it ends at
    (c + R cos(half_angle), R - R sin(half_angle)) with c = radius - R.
    """
    tan, nan = float(np.tan(half_angle)), float("nan")
    start = radius - corner
    joint_r = start + corner * float(np.cos(half_angle)) if half_angle else radius
    joint_z = corner * (1.0 - float(np.sin(half_angle)))
    top = joint_r + (length - joint_z) * tan
    if top < 0:
        raise ToolError(
            f"taper_deg {np.degrees(half_angle):g} closes the tool at z {joint_z - joint_r / tan:g} mm, "
            f"below its length {length:g} mm", word="taper_deg", remedy="shorten the tool or open the angle",
        )  # fmt: skip
    if corner == 0:
        return Profile([(radius, 0.0), (top, length)])
    points = [(start, 0.0), (joint_r, joint_z), (top, length)]
    return Profile(points, [(start, corner), (nan, nan)], [corner, 0.0])


Tool: TypeAlias = Cutter
