"""What every engine answers: stock minus sweep, one block at a time.

`job`, `contact`, `oracle` and `feed` know an engine by this protocol and by nothing else. Adding an engine is a
room beside this file and one line in the table of `engines/__init__.py`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, Self, cast

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.settings import VectorSettings
from vmachining.errors import InputError
from vmachining.htmltable import box_words, facts_html
from vmachining.interval import Interval
from vmachining.stock import MeshStock, Stock
from vmachining.sweep import Sweep
from vmachining.tolerance import CHORD_MM, WIDTH, WIDTH_MM3

if TYPE_CHECKING:
    import pyvista
    import trimesh
    from matplotlib.figure import Figure


class Removal(NamedTuple):
    """Removed volume of one block, mm^3.

    proven : True: `lo` and `hi` are bounds. False: an interval of stated confidence, which is never called a
        bracket, or an interval of which a step is not proven; the room of the engine says which.
    engine : who answered, where an engine hands blocks on to another one; None: the engine itself.
    note : why the interval is wider than was requested; None: it is not.
    """

    lo: float
    estimate: float
    hi: float
    proven: bool = True
    engine: str | None = None
    note: str | None = None

    @property
    def bracket(self) -> Interval:
        """The three numbers, and whether they are proven."""
        return Interval(self.lo, self.estimate, self.hi, self.proven)

    @property
    def width(self) -> float:
        """hi - lo."""
        return self.hi - self.lo

    def plus(self, *others: Removal) -> Removal:
        """Removal of blocks together, added up in their order; proven where all are."""
        lo, estimate, hi, proven, engine, note = self
        for low, middle, high, is_proven, name, why in others:
            lo, estimate, hi, proven, note = (
                lo + low,
                estimate + middle,
                hi + high,
                proven and is_proven,
                note or why,
            )
            if engine != name:
                engine = "+".join(sorted({*_names(engine), *_names(name)}))
        return Removal(lo, estimate, hi, proven, engine, note)


def _names(engine: str | None) -> list[str]:
    return engine.split("+") if engine else []


NOTHING = Removal(0.0, 0.0, 0.0)


class StockSurface(NamedTuple):
    """Triangles of a workpiece that know who cut them.

    vertices : (n, 3) mm. triangles : (m, 3) indices, outward. block : (m,) number of the block that cut the
    triangle, -1 of the raw stock.
    """

    vertices: Floats
    triangles: Ints
    block: Ints

    def _repr_html_(self) -> str:
        """What a notebook shows: size and box."""
        facts = [
            ("triangles", str(len(self.triangles))),
            ("cut by blocks", str(len(np.unique(self.block[self.block >= 0])))),
        ]
        if len(self.vertices):
            facts.append(("box, mm", box_words(self.vertices.min(axis=0), self.vertices.max(axis=0))))
        return facts_html("Surface of a workpiece", facts)

    def to_trimesh(self) -> trimesh.Trimesh:
        """As `trimesh.Trimesh`, with `face_attributes["block"]`."""
        import trimesh

        mesh = trimesh.Trimesh(self.vertices, self.triangles, process=False)
        mesh.face_attributes["block"] = self.block
        return mesh

    def to_pyvista(self) -> pyvista.PolyData:
        """As `pyvista.PolyData`, with the block of each triangle in `cell_data["block"]`.

        Raises InputError: pyvista is not installed.
        """
        try:
            import pyvista
        except ImportError as exc:
            raise InputError("to_pyvista needs pyvista", remedy="pip install pyvista") from exc
        faces: Any = self.triangles
        mesh: Any = pyvista.PolyData.from_regular_faces(self.vertices, faces)
        mesh.cell_data["block"] = self.block
        return cast("pyvista.PolyData", mesh)

    def plot(self) -> Figure:
        """A shaded view as a matplotlib figure; a notebook shows it."""
        return resolve_name("vmachining.report.paper:draw_surface")(self)  # type: ignore[no-any-return]

    def export(self, path: Path | str) -> None:
        """Write it in a format of trimesh, by suffix: .stl, .obj, .ply, .3mf in mm, .glb in m with y upright, as glTF has it."""
        mesh = self.to_trimesh()
        if Path(path).suffix.lower() in (".glb", ".gltf"):
            mesh.apply_transform(np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1e3]]) / 1e3)
        mesh.export(str(path))


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What a job asks of its engine.

    chord : mm, how far surfaces may lie apart that represent each other.
    design : the part as designed, for engines that measure against it.
    vectors : how dense discrete vectors stand.
    width, width_mm3 : of a block's bracket, relative and in mm^3; the block is done when it is as narrow as either.
    spacing : mm, of rays; None: what the engine takes by itself. directions : of rays, 1 (along z) or 3.
    """

    chord: float = CHORD_MM
    design: MeshStock | None = None
    vectors: VectorSettings | None = None
    width: float = WIDTH
    width_mm3: float = WIDTH_MM3
    spacing: float | None = None
    directions: int = 3


class Request(NamedTuple):
    """One order to an engine. sweep; block : its number; cuts : whether it is taken out, or only asked what it would take.

    within : see `Engine.touch`."""

    sweep: Sweep
    block: int | None = None
    cuts: bool = True
    within: float | None = None


class Share(NamedTuple):
    """The part of a workpiece that one of several processes cuts."""

    part: int = 0
    parts: int = 1


WHOLE = Share()


class Engine(Protocol):
    """Workpiece of one job, cut block by block.

    name : as in the column `engine` and behind `--engine`.
    chord : mm, see `Options`; checks of shank and holder are as coarse as this.
    proof : what the bounds rest on, in a few words, for the summary.
    stock_volume, volume : of the raw and of the present workpiece, mm^3; stated where they are not bounds.
    """

    name: str
    chord: float
    stock_volume: Interval

    @classmethod
    def of(cls, stock: Stock, options: Options) -> Self:
        """The raw workpiece.

        Raises StockError: The engine does not take this stock.
        """
        ...

    @classmethod
    def load(cls, path: Path) -> Self:
        """The workpiece that `save` wrote.

        Raises EngineError: The file cannot be read or is damaged.
        """
        ...

    @classmethod
    def takes(cls, sweep: Sweep) -> bool:
        """Whether `cut` and `touch` answer for such a tool and motion; where not, they raise EngineError."""
        ...

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """Take the sweep out of the workpiece; exactly 0 in air.

        Raises EngineError: The kernel failed, or the engine does not take this sweep; names the block. The workpiece is
            as before.
        """
        ...

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """What the sweep would take; the workpiece stays as it is.

        within : mm, how exact the surfaces need be at least; None: as for `cut`.
        """
        ...

    @property
    def proof(self) -> str: ...

    @property
    def volume(self) -> Interval: ...

    def surface(self) -> StockSurface:
        """The workpiece as closed triangles, for STL, 3MF and pictures."""
        ...

    def save(self, path: Path) -> None:
        """Write what is needed to continue with the next block, see `load`."""
        ...


class Batched(Engine, Protocol):
    """An engine that is faster when it has many orders at once."""

    def answer(self, requests: Sequence[Request]) -> list[Removal]:
        """What `cut` and `touch` would answer one after the other."""
        ...


class Divisible(Engine, Protocol):
    """An engine whose workpiece several processes can cut, each by all sweeps, each its own part of it.

    Volumes are the sums over the parts, and so are removals, see `summed`.
    """

    def summed(self, parts: Sequence[Removal]) -> Removal:
        """What all parts together remove, from what each has answered to one order."""
        ...

    def in_use(self) -> Ints | None:
        """Numbers of the blocks whose sweeps a whole workpiece still has a use for; None: it keeps no sweeps."""
        ...

    def forget_others(self, blocks: Ints) -> None:
        """Told to a part: of which blocks the whole has a use, see `in_use`."""
        ...

    @classmethod
    def load(cls, path: Path, *, share: Share = WHOLE) -> Self:
        """See `Engine`; cuts that part only."""
        ...

    @classmethod
    def join(cls, engines: Iterable[Self]) -> Self:
        """One engine of those that cut all parts, in the order of their shares."""
        ...
