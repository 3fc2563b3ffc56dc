"""Cutting and edge coefficients over the height of a point of the edge, in files and as shipped sets.

F_q = (K_qc h + K_qe) dL for q = t (tangential), r (radial, along the normal), a (axial, along the edge): K_qc in N/mm^2,
K_qe in N/mm, h chip thickness and dL length of the segment, mm. Each coefficient is a polynomial of the height D of the
segment above the tip, mm, highest power first.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.textfile import parse_toml, read_text

NAMES = ("Ktc", "Krc", "Kac", "Kte", "Kre", "Kae")
"""Order of the rows."""

PLACES = (("cutting_n_mm2", 0), ("edge_n_mm", 3))
DIRECTIONS = ("tangential", "radial", "axial")


@dataclass(frozen=True, slots=True, eq=False)
class Coefficients:
    """A set of coefficients.

    name : for reports. powers : (6, d + 1) Ktc, Krc, Kac, Kte, Kre, Kae; highest power of the height first.
    height_mm : lowest and highest height they were calibrated for. notes : what a user must know of them.

    Raises InputError: Not six polynomials, values that are not finite, an empty range.
    """

    name: str
    powers: Floats
    height_mm: tuple[float, float] = (0.0, math.inf)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        powers = np.atleast_2d(np.array(self.powers, dtype=np.float64))
        if powers.shape[0] == 1 and powers.shape[1] == 6:  # six constants
            powers = powers.T.copy()
        if powers.shape[0] != 6 or not powers.shape[1] or not np.isfinite(powers).all():
            raise InputError(f"{self.name}: expected six finite polynomials, got shape {powers.shape}")
        low, high = self.height_mm
        if not (math.isfinite(low) and low < high):
            raise InputError(f"{self.name}: height_mm {list(self.height_mm)} is not a range")
        powers.setflags(write=False)
        object.__setattr__(self, "powers", powers)

    @classmethod
    def constant(
        cls, ktc: float, krc: float, kac: float, kte: float = 0.0, kre: float = 0.0, kae: float = 0.0,
        *, name: str = "constant",
    ) -> Coefficients:  # fmt: skip
        """The same values at every height."""
        return cls(name, np.array([ktc, krc, kac, kte, kre, kae], dtype=np.float64)[:, None])

    def at(self, height_mm: ArrayLike) -> Floats:
        """(6, ...) values at heights (...,) mm, without a look at the range."""
        z = np.asarray(height_mm, dtype=np.float64)
        return np.stack([np.asarray(np.polyval(row, z) + 0.0 * z) for row in self.powers])

    def outside(self, low: float, high: float, slack: float = 1e-6) -> str | None:
        """A sentence if heights from `low` to `high` mm leave the calibrated range, else None."""
        a, b = self.height_mm
        if low >= a - slack and high <= b + slack:
            return None
        worst = high if high > b + slack else low
        return (
            f"coefficients {self.name!r} are calibrated for heights from {a:g} to {b:g} mm above the tip, "
            f"the contact is at {worst:.4g} mm"
        )

    def negative(self, low: float, high: float) -> list[str]:
        """A sentence for each coefficient that is negative somewhere between two heights, with the first of them."""
        z = np.linspace(low, high, 401)
        out = []
        for name, values in zip(NAMES, self.at(z), strict=True):
            below = np.flatnonzero(values < 0.0)
            if len(below):
                unit = "N/mm2" if name.endswith("c") else "N/mm"
                out.append(
                    f"{name} of {self.name!r} is negative from a height of {z[below[0]]:.3g} mm on "
                    f"(lowest {values.min():.4g} {unit} at {z[int(values.argmin())]:.3g} mm)"
                )
        return out

    # -- files ---------------------------------------------------------------------------------------------

    @classmethod
    def load(cls, path: Path | str) -> Coefficients:
        """A TOML file.

        Raises InputError: The file is missing, not TOML, has unknown or missing keys, or values that are not numbers.
        """
        text = read_text(Path(path), "coefficients", InputError, wrong="a coefficient file is TOML text")
        try:
            data = parse_toml(text)
        except tomllib.TOMLDecodeError as exc:
            raise InputError(f"not valid TOML: {exc}", file=str(path)) from exc
        return cls.from_mapping(data, file=str(path))

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], *, file: str | None = None) -> Coefficients:
        """The set in a mapping with the keys of a file; `statistics` and `layers` are left to readers."""
        known = {"name", "height_mm", "notes", "statistics", "layers", *(place for place, _ in PLACES)}
        if unknown := sorted(set(data) - known):
            raise InputError(
                f"unknown key {unknown[0]!r}", file=file, remedy=f"known: {', '.join(sorted(known))}"
            )
        rows: list[list[float]] = []
        for place, _ in PLACES:
            table = data.get(place)
            if not isinstance(table, Mapping):
                raise InputError(
                    f"[{place}] is missing", file=file, remedy="it holds tangential, radial and axial"
                )
            if odd := sorted(set(table) - set(DIRECTIONS)):
                raise InputError(f"unknown key {odd[0]!r} under [{place}]", file=file)
            for direction in DIRECTIONS:
                value = table.get(direction)
                row = value if isinstance(value, list) else [value]
                if not row or not all(isinstance(v, int | float) and not isinstance(v, bool) for v in row):
                    raise InputError(
                        f"[{place}] {direction}: expected a number, or powers of the height from the highest on",
                        file=file,
                    )
                rows.append([float(v) for v in row if v is not None])
        span = data.get("height_mm", [0.0, math.inf])
        if not (isinstance(span, list) and len(span) == 2 and all(isinstance(v, int | float) for v in span)):
            raise InputError("height_mm: expected [lowest, highest] in mm", file=file)
        degree = max(map(len, rows))
        powers = np.array([[0.0] * (degree - len(row)) + row for row in rows])
        notes = data.get("notes", [])
        name = str(data.get("name", Path(file).stem if file else "coefficients"))
        try:
            return cls(name, powers, (float(span[0]), float(span[1])), tuple(str(n) for n in notes))
        except InputError as exc:
            raise InputError(exc.message, file=file) from exc

    def to_toml(self, more: Sequence[str] = ()) -> str:
        """The text of a file; `more` lines at its end."""
        lines = [
            f"name = {_quoted(self.name)}",
            f"height_mm = [{self.height_mm[0]!r}, {_number(self.height_mm[1])}]   # calibrated range above the tip",
        ]
        if self.notes:
            lines += ["notes = [", *(f"  {_quoted(note)}," for note in self.notes), "]"]
        for place, first in PLACES:
            lines += ["", f"[{place}]   # powers of the height in mm, highest first"]
            lines += [
                f"{name} = [{', '.join(repr(float(v)) for v in self.powers[first + k])}]"
                for k, name in enumerate(DIRECTIONS)
            ]
        return "\n".join([*lines, *more]) + "\n"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _number(value: float) -> str:
    return repr(float(value)) if math.isfinite(value) else "inf"


def shipped(name: str | None = None) -> Any:
    """A shipped set by name, or the names of all.

    Raises InputError: No set of this name.
    """
    folder = files("vmachining.force") / "data"
    names = sorted(
        entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")
    )
    if name is None:
        return names
    if name not in names:
        raise InputError(
            f"no coefficient set {name!r}", remedy=f"shipped: {', '.join(names)}; or give a file"
        )
    return Coefficients.from_mapping(tomllib.loads((folder / f"{name}.toml").read_text(encoding="utf-8")))
