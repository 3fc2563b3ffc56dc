"""Engines: stock minus sweeps, each with its own kernel, so that each can referee the others.

| engine | stock is | kernel |
|---|---|---|
| `mesh` | three closed triangle meshes per tile | manifold3d |
| `brep` | read from STEP; the oracle itself comes later | OCCT |

Engines never import each other.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

__all__ = ["brep", "mesh"]


def __getattr__(name: str) -> ModuleType:
    """Load an engine, and its kernel, when it is first asked for."""
    if name in __all__:
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
