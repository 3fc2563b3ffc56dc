"""Engines: stock minus sweeps, each with its own kernel, so that each can referee the others.

| engine | stock is | kernel |
|---|---|---|
| `columns` | raw stock and sweeps by tiles; bounds from convexity along the tool axis, see `relay.py` | numba |
| `mesh` | closed triangle meshes per tile | manifold3d |
| `dexel` | intervals along rays in one direction or three | numba |
| `rays` | the raw stock and all sweeps; lengths along exact rays (`dexel/rays`) | - |
| `vectors` | lengths of vectors that stand on the design part | - |
| `brep` | solids with faces; judges blocks, see `--brep` | OCCT |

Engines never import each other. Every engine answers `protocol.Engine`, and everybody else knows them by that alone.
`ENGINES` below lists those that can cut a job. Another package adds one by the entry-point group `vmachining.engines`,
see `docs/add_an_engine.md`.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pkgutil import resolve_name
from types import ModuleType

from vmachining.engines.protocol import Engine
from vmachining.errors import InputError
from vmachining.installed import Installed

__all__ = [
    "ENGINES", "RAYS", "Entry", "brep", "columns", "dexel", "engine_class", "entry_of", "mesh", "vectors",
]  # fmt: skip

LATER = ("brep",)
"""Named by the interface; they cannot cut a job yet."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A line of the table of engines.

    place : "module:class" of the `Engine`; loaded, with its kernel, when somebody asks for it.
    takes : stocks, tools and motions, in words, for --help.
    divisible : whether it is `Divisible`, so that several processes can cut one workpiece.
    divided_from : number of blocks above which starting them pays, where no number of processes is given.
    batched : whether it is `Batched`, so that it gets many blocks at once.
    """

    place: str
    takes: str
    divisible: bool = False
    divided_from: int = 300
    batched: bool = False


_OWN = {
    "columns": Entry(
        "vmachining.engines.relay:ColumnsFirst",
        "upright convex tools on stocks with a flat bottom, proven to a width; passes the rest to mesh, block by block",
        divisible=True,
        divided_from=4000,
    ),
    "mesh": Entry("vmachining.engines.mesh:MeshEngine", "any stock, tool and motion", divisible=True),
    "dexel": Entry(
        "vmachining.engines.dexel:DexelEngine",
        "any stock, tool and motion, by a grid of rays; intervals are stated, not proven",
        batched=True,
    ),
    "rays": Entry(
        "vmachining.engines.dexel:RayEngine",
        "any stock, tool and motion, by new rays for each block; intervals are stated, not proven",
    ),
    "vectors": Entry(
        "vmachining.engines.vectors:VectorEngine",
        "any tool and motion, with a [design]; volumes are not proven",
        batched=True,
    ),
}

ENGINES = Installed("vmachining.engines", Entry, _OWN)
"""Ours, and those of installed packages."""

RAYS = ("dexel", "rays")
"""Engines of rays, which need no audit by rays."""


def entry_of(name: str) -> Entry:
    """The line of the table of an engine that cuts."""
    return ENGINES[name]


def engine_class(name: str) -> type[Engine]:
    """The class behind `--engine NAME`.

    Raises InputError: No such engine, or none that can cut a job.
    """
    if name in ENGINES:
        found: type[Engine] = resolve_name(ENGINES[name].place)
        return found
    if name in LATER:
        raise InputError(f"engine {name!r} is not supported yet", remedy=f"take {', '.join(ENGINES)}")
    raise InputError(f"unknown engine {name!r}", remedy=f"one of {', '.join(ENGINES)}")


def __getattr__(name: str) -> ModuleType:
    """Load an engine, and its kernel, when it is first asked for."""
    if name in ("brep", "columns", "dexel", "mesh", "vectors"):
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
