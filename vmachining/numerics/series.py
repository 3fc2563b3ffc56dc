"""Trigonometric series in time: what linear joints make of points and directions.

Slides are linear in t and rotary joints turn matrices whose entries are sines and cosines, so everything a
serial chain carries is a finite sum of (P + t R) cos(w t) + (Q + t S) sin(w t). Derivatives, products and
restrictions to a part of the time are exact.

Symbols: w frequency, rad per unit of t; Z = P - iQ complex amplitude, value = Re[(Z0 + t Z1) exp(iwt)].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vmachining.arrays import Floats

Amplitudes: TypeAlias = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """Sum over k of Re[(terms[k, 0] + t terms[k, 1]) exp(i frequencies[k] t)].

    frequencies : (m,) rad per unit of t, >= 0, each once. terms : (m, 2, ...) complex.
    """

    frequencies: Floats
    terms: Amplitudes

    @classmethod
    def linear(cls, value: ArrayLike, slope: ArrayLike) -> Series:
        """value + t slope, any shape."""
        both = np.stack([np.asarray(value, dtype=complex), np.asarray(slope, dtype=complex)])
        return cls(np.zeros(1), both[None])

    @classmethod
    def constant(cls, value: ArrayLike) -> Series:
        """The same at all times."""
        return cls.linear(value, np.zeros(np.shape(value)))

    def at(self, t: ArrayLike, derivative: int = 0) -> Floats:
        """(..., shape) value or derivative of any order at parameters t of shape (...)."""
        s = np.asarray(t, dtype=np.float64)
        shape = self.terms.shape[2:]
        out = np.zeros((*s.shape, *shape))
        wide = s.reshape(*s.shape, *(1 for _ in shape))
        for w, (z0, z1) in zip(self.frequencies, self.terms, strict=True):
            turn = (1j * w) ** derivative
            below = derivative * (1j * w) ** (derivative - 1) if derivative else 0.0
            if w == 0.0:
                out += (turn * (z0 + wide * z1) + below * z1).real
            else:
                out += ((turn * (z0 + wide * z1) + below * z1) * np.exp(1j * w * wide)).real
        return out

    def part(self, a: float, b: float) -> Series:
        """The part from t = a to t = b, with t running from 0 to 1 again."""
        spin = np.exp(1j * self.frequencies * a).reshape(-1, *(1 for _ in self.terms.shape[2:]))
        z0 = (self.terms[:, 0] + a * self.terms[:, 1]) * spin
        z1 = (b - a) * self.terms[:, 1] * spin
        return _collect(self.frequencies * (b - a), np.stack([z0, z1], axis=1))

    def __add__(self, other: Series) -> Series:
        return _collect(
            np.concatenate([self.frequencies, other.frequencies]), np.concatenate([self.terms, other.terms])
        )

    def scaled(self, factor: float) -> Series:
        """Every value times a number."""
        return Series(self.frequencies, factor * self.terms)

    def __matmul__(self, other: Series) -> Series:
        """Matrix times matrix or vector. Only one of the two factors may grow with t.

        Raises ValueError: Both factors grow with t: their product would grow with its square.
        """
        if self.terms[:, 1].any() and other.terms[:, 1].any():
            raise ValueError("the product of two series that grow with t is not such a series")
        frequencies, terms = [], []
        for w, x in zip(self.frequencies, self.terms, strict=True):
            for v, y in zip(other.frequencies, other.terms, strict=True):
                for far, b in ((w + v, y), (w - v, y.conj())):
                    # Re(X e^{iwt}) Re(Y e^{ivt}) = 1/2 Re(X Y e^{i(w + v)t} + X conj(Y) e^{i(w - v)t})
                    frequencies.append(far)
                    terms.append(0.5 * np.stack([x[0] @ b[0], x[0] @ b[1] + x[1] @ b[0]]))
        return _collect(np.array(frequencies), np.array(terms))

    @lru_cache(maxsize=1024)  # noqa: B019  several are asked for more than once for every block
    def bound(self, derivative: int) -> float:
        """Upper bound of the Euclidean length of a derivative for t in [0, 1]; vectors only."""
        return float(bounds(self.frequencies, self.terms, derivative))


def bounds(frequencies: Floats, terms: Amplitudes, derivative: int) -> Floats:
    """(...,) the same for many series with the same frequencies (m,), terms (..., m, 2, k)."""
    far, more = (_reaches(terms[..., k, :], frequencies) for k in (0, 1))
    below = derivative * frequencies ** (derivative - 1) if derivative else 0.0
    total: Floats = (frequencies**derivative * (far + more) + below * more).sum(axis=-1)
    return total


def rotation(axis: Floats, start: float, rate: float) -> Series:
    """(3, 3) active rotation about a unit axis by the angle start + t rate, rad (Rodrigues)."""
    along = np.outer(axis, axis)
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    cos, sin = float(np.cos(start)), float(np.sin(start))
    even, odd = np.eye(3) - along, cross
    # cos(start + wt) even + sin(start + wt) odd = P cos(wt) + Q sin(wt)
    P, Q = cos * even + sin * odd, cos * odd - sin * even
    zero = np.zeros((2, 3, 3), dtype=complex)
    fixed, turning = zero.copy(), zero.copy()
    fixed[0], turning[0] = along, P - 1j * Q
    return _collect(np.array([0.0, rate]), np.stack([fixed, turning]))


def _reaches(z: Amplitudes, w: Floats) -> Floats:
    """(..., m) largest length of Re(z exp(iwt)) over all t, z (..., m, k): half the long axis of an ellipse."""
    p, q = z.real, z.imag
    a, b, c = (p * p).sum(axis=-1), (p * q).sum(axis=-1), (q * q).sum(axis=-1)
    # of the Gram matrix of both half axes
    squared: Floats = np.where(w == 0.0, a, 0.5 * (a + c) + np.hypot(0.5 * (a - c), b))
    return np.sqrt(squared)


def _collect(frequencies: Floats, terms: Amplitudes) -> Series:
    """Frequencies made positive, equal ones joined, empty ones dropped; zero always stays."""
    found: dict[float, Amplitudes] = {0.0: np.zeros(terms.shape[1:], dtype=complex)}
    for w, z in zip(frequencies.tolist(), terms, strict=True):
        value = z.conj() if w < 0.0 else z
        if w == 0.0:
            value = value.real + 0j
        found[abs(w)] = found[abs(w)] + value if abs(w) in found else value
    kept = [w for w, z in found.items() if w == 0.0 or z.any()]
    return Series(np.array(kept), np.array([found[w] for w in kept]))
