"""Cutting and edge coefficients from mean forces of slot tests at several depths and feeds.

Symbols: D depth of a slot, mm; f feed per tooth, mm; r corner radius, mm; N teeth. Upright tool, feed along +x, forces on
the tool. The mean force over a revolution is linear in the coefficients, so with K_q(z) a
polynomial of the height one linear fit gives them all.

Two ways: `identify`, one weighted fit of all means, with intervals; and `layer_coefficients`, the published way: differences
of consecutive depths give a layer's coefficients, which are smoothed over the height. Differences of layers magnify noise
several times, and two feeds leave nothing to tell it by.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import InputError
from vmachining.force.coefficients import NAMES, Coefficients
from vmachining.force.measured import read_columns


class LayerIntegrals(NamedTuple):
    """Integrals along the edge between two heights, mm: of sin^2 lam, sin lam, sin lam cos lam, cos lam and 1."""

    ss: float
    s: float
    sc: float
    c: float
    one: float


def layer_integrals(low: float, high: float, r: float) -> LayerIntegrals:
    """Between heights `low` < `high` mm: the corner in closed form, its rest a cylinder."""
    if r == 0.0:
        return LayerIntegrals(high - low, high - low, 0.0, 0.0, high - low)
    a, b = (float(np.arccos(1.0 - min(d, r) / r)) for d in (low, high))
    above = max(high, r) - max(low, r)

    def part(at: float) -> Floats:
        sin, cos = np.sin(at), np.cos(at)
        return r * np.array([(at - sin * cos) / 2.0, -cos, sin**2 / 2.0, sin, at])

    ss, s, sc, c, one = (part(b) - part(a)).tolist()
    return LayerIntegrals(ss + above, s + above, sc, c, one + above)


Weights = Literal["relative", "resultant", "equal"]

COLUMNS = ("depth_mm", "feed_mm_per_tooth", "fx_n", "fy_n", "fz_n")
"""Of a file of tests; every name ends in its unit."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
FLOOR = 0.005
"""Least noise of a component as a share of the resultant of its test: no sensor is exact where a force passes zero."""


@dataclass(frozen=True, slots=True, eq=False)
class SlotTests:
    """Slots: depth (n,) mm, feed (n,) mm per tooth, force (n, 3) N mean over a revolution, on the tool, feed along +x."""

    depth: Floats
    feed: Floats
    force: Floats

    def __init__(self, depth: ArrayLike, feed: ArrayLike, force: ArrayLike) -> None:
        for name, value, shape in (("depth", depth, (-1,)), ("feed", feed, (-1,)), ("force", force, (-1, 3))):
            try:
                object.__setattr__(self, name, rows(value, *shape, name=name))
            except ValueError as exc:
                raise InputError(str(exc)) from exc
        n = len(self.depth)
        if self.feed.shape != (n,) or self.force.shape != (n, 3):
            raise InputError(
                f"{n} depths, {len(self.feed)} feeds, {len(self.force)} forces: expected as many of each"
            )
        if n and not ((self.depth > 0).all() and (self.feed > 0).all()):
            raise InputError("depths and feeds per tooth must be above zero")

    def __len__(self) -> int:
        return len(self.depth)


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """Result of the joint fit.

    coefficients : with the range of heights that was tested. covariance : (6 (d + 1),) * 2 of the powers, row by row.
    residual : (n, 3) N, measured less fitted. sigma : standard deviation of the weighted residuals (of relative noise if
    weights were relative). freedom : degrees of freedom. confidence : of the intervals.
    """

    coefficients: Coefficients
    covariance: Floats
    residual: Floats
    fitted: Floats
    sigma: float
    freedom: int
    confidence: float

    @property
    def _factor(self) -> float:
        from scipy.special import stdtrit  # slow to load, and only the fit needs it

        return float(stdtrit(self.freedom, 0.5 + 0.5 * self.confidence)) if self.freedom else float("nan")

    def half_width(self, height_mm: ArrayLike) -> Floats:
        """(6, n) half width of the interval of every coefficient at heights (n,) mm."""
        z = np.atleast_1d(np.asarray(height_mm, dtype=np.float64))
        d = self.coefficients.powers.shape[1]
        basis = np.vander(z, d)
        out = np.empty((6, len(z)))
        for q in range(6):
            part = self.covariance[q * d : (q + 1) * d, q * d : (q + 1) * d]
            out[q] = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", basis, part, basis), 0.0))
        return self._factor * out

    def lines(self) -> list[str]:
        """Residuals and intervals for a coefficient file, whose readers leave them alone."""
        low, high = self.coefficients.height_mm
        heights = np.linspace(low, high, 6)
        values, half = self.coefficients.at(heights), self.half_width(heights)
        size = np.linalg.norm(self.fitted, axis=1)
        relative = np.linalg.norm(self.residual, axis=1) / np.where(size > 0.0, size, np.nan)
        more = [
            "", "[statistics]", 'method = "joint weighted least squares"', f"tests = {len(self.residual)}",
            f"degrees_of_freedom = {self.freedom}", f"confidence = {self.confidence!r}",
            f"sigma = {self.sigma!r}   # of the weighted residuals",
            f"rms_residual_n = {float(np.sqrt((self.residual**2).mean()))!r}",
            f"largest_residual_n = {float(np.abs(self.residual).max())!r}",
            f"largest_relative_residual = {float(np.nanmax(relative))!r}",
            f"height_mm = {_row(heights)}",
        ]  # fmt: skip
        for name, value, wide in zip(NAMES, values, half, strict=True):
            more += [f"{name} = {_row(value)}", f"{name}_half_width = {_row(wide)}"]
        return more

    def to_toml(self) -> str:
        """Coefficient file with residuals and intervals."""
        return self.coefficients.to_toml(self.lines())


@dataclass(frozen=True, slots=True, eq=False)
class LayerFit:
    """Layers between consecutive depths: low, high (n,) mm, values (n, 6) Ktc, Krc, Kac, Kte, Kre, Kae."""

    low: Floats
    high: Floats
    values: Floats

    def heights(self, ref: Literal["mid", "top"] = "mid") -> Floats:
        """(n,) mm a layer's values are given to."""
        if ref not in ("mid", "top"):
            raise InputError(f"unknown layer_ref {ref!r}", remedy="mid or top")
        return self.high if ref == "top" else 0.5 * (self.low + self.high)


def weighted_integrals(depth: float, r: float, degree: int) -> Floats:
    """(degree + 1, 5) integrals of z^k (sin^2 lam, sin lam, sin lam cos lam, cos lam, 1) ds from 0 to a depth, mm."""
    out = np.zeros((degree + 1, 5))
    if r > 0.0:
        top = float(np.arccos(1.0 - min(depth, r) / r))
        lam = 0.5 * top * (NODES + 1.0)
        sin, cos = np.sin(lam), np.cos(lam)
        parts = np.stack([sin**2, sin, sin * cos, cos, np.ones_like(sin)])
        z = r * (1.0 - cos)
        for k in range(degree + 1):
            out[k] = (parts * (0.5 * top * r * WEIGHTS * z**k)).sum(axis=1)
    if depth > r:
        for k in range(degree + 1):
            out[k, [0, 1, 4]] += (depth ** (k + 1) - r ** (k + 1)) / (k + 1)
    return out


def identify(
    tests: SlotTests,
    corner_radius: float,
    teeth: int,
    *,
    degree: int = 3,
    weights: Weights = "relative",
    confidence: float = 0.95,
    name: str = "identified",
) -> Identification:
    """One least-squares fit of all means on the powers of all six coefficients.

    corner_radius : mm. teeth : of the tool. degree : of the polynomials in the height.
    weights : "relative" for noise in proportion to each component (but at least 0.5 % of the resultant of its test), found in
        a few rounds from the fitted forces; "resultant" for noise in proportion to the resultant; "equal" for noise of one
        size. Intervals are right where the noise is of the kind that is said.
    confidence : of the intervals, from the residuals and Student's t.
    Raises InputError: Options out of range; fewer than degree + 1 depths, or fewer than two feeds.
    """
    _check(tests, corner_radius, teeth)
    if degree < 0 or not 0.0 < confidence < 1.0 or weights not in ("relative", "resultant", "equal"):
        raise InputError(f"degree {degree}, confidence {confidence:g}, weights {weights!r}: out of range")
    depths, feeds = np.unique(tests.depth), np.unique(tests.feed)
    if len(depths) <= degree:
        raise InputError(
            f"{len(depths)} depths are too few for polynomials of degree {degree}",
            remedy=f"test {degree + 1} depths or more, or take --degree {len(depths) - 1}",
        )
    if len(feeds) < 2:
        raise InputError(
            "one feed cannot separate cutting from edge coefficients", remedy="test two feeds or more"
        )
    scale = float(depths.max())
    a = _design(tests, corner_radius, teeth, degree, scale)
    y = tests.force.ravel()
    weight = np.ones(len(y))
    for _ in range(1 if weights == "equal" else 4):
        x, *_ = np.linalg.lstsq(a * weight[:, None], y * weight, rcond=None)
        if weights != "equal":
            force = (a @ x).reshape(-1, 3)
            size = np.linalg.norm(force, axis=1, keepdims=True) * np.ones(3)
            noise = size if weights == "resultant" else np.sqrt(force**2 + (FLOOR * size) ** 2)
            weight = 1.0 / np.where(noise > 0.0, noise, 1.0).ravel()
    u, s, vt = np.linalg.svd(a * weight[:, None], full_matrices=False)
    if s[-1] <= 1e-13 * s[0]:
        raise InputError(
            "the tests do not determine all coefficients", remedy="test more depths, or a lower degree"
        )
    x = vt.T @ ((u.T @ (y * weight)) / s)
    fitted = a @ x
    free = len(y) - a.shape[1]
    sigma = float(np.sqrt((((y - fitted) * weight) ** 2).sum() / free)) if free > 0 else float("nan")
    inverse = vt.T / s
    covariance = (sigma**2 if free > 0 else 0.0) * (inverse @ inverse.T)
    # columns are powers of z / scale, lowest first: to powers of z, highest first
    d = degree + 1
    turn = np.zeros((6 * d, 6 * d))
    for q in range(6):
        for k in range(d):
            turn[q * d + (degree - k), q * d + k] = scale**-k
    powers = (turn @ x).reshape(6, d)
    found = Coefficients(name, powers, (0.0, scale))
    return Identification(
        found, turn @ covariance @ turn.T, (y - fitted).reshape(-1, 3), fitted.reshape(-1, 3), sigma, max(free, 0),
        confidence,
    )  # fmt: skip


def _design(tests: SlotTests, r: float, teeth: int, degree: int, scale: float) -> Floats:
    """(3 n, 6 (degree + 1)): mean forces of unit powers of z / scale, lowest first, coefficient by coefficient."""
    d = degree + 1
    out = np.zeros((len(tests), 3, 6, d))
    known = {depth: weighted_integrals(depth, r, degree) for depth in np.unique(tests.depth).tolist()}
    power = scale ** -np.arange(d, dtype=np.float64)
    pi = np.pi
    for i, (depth, f) in enumerate(zip(tests.depth.tolist(), tests.feed.tolist(), strict=True)):
        ss, s, sc, c, one = (known[depth] * power[:, None]).T
        x, y, z = out[i]
        x[1], x[4], x[2], x[5] = -f * ss / 4, -s / pi, -f * sc / 4, -c / pi
        y[0], y[3] = f * s / 4, one / pi
        z[1], z[4], z[2], z[5] = f * sc / pi, c / 2, -f * ss / pi, -s / 2
    return teeth * out.reshape(3 * len(tests), 6 * d)


def predicted_means(coefficients: Coefficients, tests: SlotTests, corner_radius: float, teeth: int) -> Floats:
    """(n, 3) N: mean forces that coefficients predict for slots, as tests of another feed validate them.

    Raises InputError: A slot deeper than the coefficients know.
    """
    _check(tests, corner_radius, teeth)
    top = coefficients.height_mm[1]
    if (tests.depth > top * (1.0 + 1e-9)).any():
        raise InputError(
            f"a slot of {tests.depth.max():g} mm, where coefficients are known up to {top:g} mm",
            remedy="validate with depths that the tests reach",
        )
    a = _design(tests, corner_radius, teeth, coefficients.powers.shape[1] - 1, 1.0)
    return np.asarray((a @ coefficients.powers[:, ::-1].ravel()).reshape(-1, 3))


def layer_coefficients(tests: SlotTests, corner_radius: float, teeth: int) -> LayerFit:
    """Coefficients of every layer between consecutive depths, from differences of means at the same feed (7-9).

    Raises InputError: A layer with fewer than two feeds in common.
    """
    _check(tests, corner_radius, teeth)
    mean: dict[tuple[float, float], Floats] = {}
    for depth, f in sorted(set(zip(tests.depth.tolist(), tests.feed.tolist(), strict=True))):
        mean[depth, f] = tests.force[(tests.depth == depth) & (tests.feed == f)].mean(axis=0)
    depths = np.unique(tests.depth)
    lows = np.concatenate([[0.0], depths[:-1]])
    values = []
    for low, high in zip(lows.tolist(), depths.tolist(), strict=True):
        shared = [f for d, f in mean if d == high and (low == 0.0 or (low, f) in mean)]
        if len(shared) < 2:
            raise InputError(
                f"the layer from {low:g} to {high:g} mm has {len(shared)} feeds in common: expected two or more",
                remedy="test the same feeds at every depth",
            )
        force = np.array([mean[high, f] - (mean[low, f] if low > 0.0 else 0.0) for f in shared])
        slope, edge = np.polyfit(np.array(shared), force, 1)
        ss, s, sc, c, one = layer_integrals(low, high, corner_radius)
        n, pi = teeth, np.pi
        a, b = -4.0 * slope[0] / n, pi * slope[2] / n
        g, h = -pi * edge[0] / n, 2.0 * edge[2] / n
        cut, rub = ss**2 + sc**2, s**2 + c**2
        values.append(
            [4.0 * slope[1] / (n * s), (a * ss + b * sc) / cut, (a * sc - b * ss) / cut,
             pi * edge[1] / (n * one), (g * s + h * c) / rub, (g * c - h * s) / rub]
        )  # fmt: skip
    return LayerFit(lows, depths, np.array(values))


def smoothed(
    fit: LayerFit, *, degree: int = 3, ref: Literal["mid", "top"] = "mid", name: str = "identified by layers"
) -> Coefficients:
    """Least-squares polynomials of the layers' values over the height (7-10)."""
    z = fit.heights(ref)
    if len(z) <= degree:
        raise InputError(
            f"{len(z)} layers are too few for polynomials of degree {degree}", remedy="test more depths"
        )
    powers = np.polyfit(z, fit.values, degree).T
    return Coefficients(name, powers, (0.0, float(fit.high.max())))


def read_tests(path: Path | str, *, on: Literal["tool", "workpiece"] = "tool") -> SlotTests:
    """Tests of a CSV file with the columns depth_mm, feed_mm_per_tooth, fx_n, fy_n, fz_n; others are left alone.

    on : whether the forces act on the tool, or on the workpiece (as a dynamometer under it says).

    Raises InputError: No such file, columns that are missing or name another unit, cells that are not numbers; names
        line and column.
    """
    if on not in ("tool", "workpiece"):
        raise InputError(f"forces on {on!r}: expected tool or workpiece")
    data, lines = read_columns(path, COLUMNS, "slot tests")[1:]
    if (data[:, :2] <= 0.0).any():
        line = int(lines[np.argmax((data[:, :2] <= 0.0).any(axis=1))])
        raise InputError("depth and feed must be above zero", file=str(path), line=line)
    return SlotTests(data[:, 0], data[:, 1], data[:, 2:] * (1.0 if on == "tool" else -1.0))


def _check(tests: SlotTests, r: float, teeth: int) -> None:
    if not len(tests):
        raise InputError("there are no tests")
    if not (np.isfinite(r) and r >= 0.0):
        raise InputError(f"corner radius {r:g} mm: expected 0 or more")
    if teeth < 1:
        raise InputError(f"{teeth} teeth: expected at least 1")


def _row(values: Floats) -> str:
    return "[" + ", ".join(repr(float(v)) if np.isfinite(v) else "nan" for v in values) + "]"
