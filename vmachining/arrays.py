"""Array shapes checked once at the border, so that inner code can trust them."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]


def rows(values: ArrayLike, *shape: int, name: str) -> Floats:
    """A finite, read-only float array of the wanted shape.

    values : array_like
    shape : int, wanted shape, -1 for any length.
    name : str, used in the message.
    Raises ValueError: Wrong shape, or a value that is not finite.
    """
    array = np.array(values, dtype=np.float64)
    if array.ndim != len(shape) or any(
        want not in (-1, have) for want, have in zip(shape, array.shape, strict=True)
    ):
        raise ValueError(f"{name}: expected shape {shape}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: every value must be finite")
    array.setflags(write=False)
    return array


def brief(values: ArrayLike) -> str:
    """`(50, 0, 10.5)`: the numbers of a point, for people."""
    flat = np.ravel(np.asarray(values, dtype=np.float64)).tolist()
    return f"({', '.join(f'{round(v, 9) + 0.0:.6g}' for v in flat)})"
