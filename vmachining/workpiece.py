"""Stock minus sweeps in a few lines, with the engine of your choice."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from vmachining.engines import engine_class
from vmachining.engines.protocol import NOTHING, Options, Removal, StockSurface
from vmachining.errors import InputError
from vmachining.htmltable import facts_html
from vmachining.interval import Interval
from vmachining.stock import BoxStock, CylinderStock, MeshStock, Stock, read_mesh
from vmachining.sweep import Sweep
from vmachining.tolerance import CHORD_MM, WIDTH, WIDTH_MM3

Box = BoxStock
Cylinder = CylinderStock


def Mesh(file: Path | str, *, scale: float = 1.0) -> MeshStock:  # noqa: N802  reads like the other stocks
    """The solid in an STL or 3MF file. scale : mm per unit of the file. Raises StockError where it is not a closed solid."""
    return read_mesh(Path(file), scale=scale)


def Step(file: Path | str, *, chord: float = CHORD_MM) -> Stock:  # noqa: N802
    """The solid in a STEP file, curved faces within `chord` (mm). Raises StockError where it holds no single solid."""
    from vmachining.job.stock import step_stock

    return step_stock(Path(file), chord)


class Workpiece:
    """A raw stock that sweeps are cut from, one after the other.

        wp = vm.Workpiece(vm.Box((0, 0, -20), (100, 60, 0)), width=0.001)
        tool = vm.FlatEnd(diameter=10, length=40)
        removed = wp.cut(vm.Sweep(tool, (-10, 30, -5), (110, 30, -5)))     # Interval, mm^3
        wp.surface().to_trimesh().show()

    stock : `Box`, `Cylinder`, `Mesh`, `Step`, or a file of the last two.
    engine : a name of `vmachining.engines.ENGINES`.
    chord : mm, how far apart the inner and outer surface may lie (mesh).
    width, width_mm3 : of the interval of one cut, relative and in mm^3; it is done at either (columns).
    spacing : mm between rays, directions : 1 or 3 (dexel).
    Raises StockError: The engine does not take this stock.
    Raises InputError: No such engine.
    """

    def __init__(
        self,
        stock: Stock | Path | str,
        *,
        engine: str = "columns",
        chord: float = CHORD_MM,
        width: float = WIDTH,
        width_mm3: float = WIDTH_MM3,
        spacing: float | None = None,
        directions: int = 3,
    ) -> None:
        if isinstance(stock, Path | str):
            stock = (Mesh if Path(stock).suffix.lower() in (".stl", ".3mf") else Step)(stock)
        if engine == "vectors":
            raise InputError(
                "vectors measure a program against a design", remedy="take vmachining.run or `measure`"
            )
        options = Options(
            chord=chord, width=width, width_mm3=width_mm3, spacing=spacing, directions=directions
        )
        self.stock, self.engine = stock, engine_class(engine).of(stock, options)
        self.removals: list[Removal] = []

    def cut(self, *sweeps: Sweep) -> Interval:
        """Take sweeps out, mm^3; several count as one cut, as the arcs and lines of one block do."""
        number = len(self.removals) + 1
        found = _sum([self.engine.cut(sweep, number) for sweep in sweeps])
        self.removals.append(found)
        return found.bracket

    def would_remove(self, sweep: Sweep) -> Interval:
        """What `cut` would take, mm^3; the workpiece stays as it is."""
        return self.engine.touch(sweep).bracket

    @property
    def removed(self) -> Interval:
        """All that was cut, mm^3."""
        return _sum(self.removals).bracket

    @property
    def volume(self) -> Interval:
        """What is left, mm^3."""
        return self.engine.volume

    def surface(self) -> StockSurface:
        """The workpiece as closed triangles; `block` is the number of the cut, from 1, and -1 on raw stock."""
        return self.engine.surface()

    def __repr__(self) -> str:
        return f"Workpiece({self.engine.name}, {len(self.removals)} cuts, {self.volume:.6g} mm3)"

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        facts = [
            ("cuts", str(len(self.removals))),
            ("removed, mm3", str(self.removed)),
            ("left, mm3", str(self.volume)),
        ]
        return facts_html(f"Workpiece, engine {self.engine.name}", facts)


def _sum(parts: Sequence[Removal]) -> Removal:
    total = NOTHING
    for part in parts:
        total = total.plus(part)
    return total
