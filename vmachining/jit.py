"""Two decorators for compiled kernels: cached on disk, no GIL, no fastmath.

`fastmath` stays off because NaN and infinity mean something here ("no root", "not hit").

numba counts who refers to an array: an atomic addition for every array that a function is given and for every row it
looks at, another one afterwards, and nothing is kept in a register across them. That was measured to be half of the
time of small functions, so what makes no arrays is a `leaf`: it borrows those of its caller, who keeps them.
The option behind it is one that numba uses for its own intrinsics and does not promise to users; `tests/test_jit.py`
tells if it ever means something else.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar, cast

import numba

__all__ = ["kernel", "leaf"]

F = TypeVar("F", bound=Callable[..., Any])

_compiled = partial(numba.njit, cache=True, nogil=True, fastmath=False, error_model="numpy")


def kernel(function: F) -> F:
    """Compile `function` in nopython mode."""
    return cast(F, _compiled()(function))


def leaf(function: F) -> F:
    """Compile a function that makes no arrays, and calls none that does; one that did would not compile."""
    return cast(F, _compiled(_nrt=False)(function))
