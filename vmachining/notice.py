"""What a command reports while it works. Light, so that commands without kernels load none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(slots=True)
class Notice:
    """compiling : called once, when the first kernel of this process is compiled and not found in the cache."""

    compiling: Callable[[], None] | None = None


notice = Notice()
