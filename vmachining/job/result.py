"""What a run gives back, and how it is laid down in a directory."""

from __future__ import annotations

import pkgutil
import shutil
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import StockSurface
from vmachining.errors import EngineError
from vmachining.job.brep import blank, refuse_beyond, write_step
from vmachining.job.files import MANIFEST, TABLES, between, forget_outputs, make_folder, write_json
from vmachining.job.jobfile import Job
from vmachining.job.schedule import ScheduleReport
from vmachining.job.stock import write_stock
from vmachining.nc import Program

if TYPE_CHECKING:
    import polars as pl

__all__ = ["PAGE", "RunResult"]

PAGE = "vmachining.report:write_report"
"""Who writes report.html. The report room sits above this one, so it is named here and not imported: a result
must be able to write all of its files, and the arrows between rooms still point down."""


@dataclass(slots=True, eq=False)
class RunResult:
    """A finished simulation.

    job, program : what ran. summary : the keys of summary.json. inputs : {role: {file, sha256}}.
    stock : the engine with the finished workpiece; `stock.volume`, `stock.surface()`.
    schedule : what the rewritten program does, None without [feed].
    folder : where the tables lie.
    """

    job: Job
    program: Program
    summary: dict[str, Any]
    inputs: dict[str, dict[str, str]]
    stock: MeshEngine
    schedule: ScheduleReport | None
    folder: Path
    manifest: dict[str, Any]
    findings: list[tuple[int, str, str]] = field(default_factory=list)
    """(line, text, message) of program warnings on lines that do not move."""
    _keep: TemporaryDirectory[str] | None = field(default=None, repr=False)

    @property
    def blocks(self) -> pl.DataFrame:
        """One row per NC block that moves; see `COLUMNS`."""
        import polars as pl

        return pl.read_parquet(self.folder / "blocks.parquet")

    @property
    def scheduled_blocks(self) -> pl.DataFrame | None:
        """The same of the rewritten program, None without [feed]."""
        import polars as pl

        path = self.folder / "scheduled_blocks.parquet"
        return pl.read_parquet(path) if self.schedule is not None else None

    @property
    def surface(self) -> StockSurface:
        """Triangles of the finished workpiece with the block that cut each."""
        return self.stock.surface()

    def write(
        self,
        folder: Path | str,
        *,
        stock: Iterable[str] = ("stl",),
        stock_at: Iterable[int] = (),
        report: bool = True,
    ) -> Path:
        """Put all result files into `folder`, each whole or not at all; the manifest goes last.

        Parameters
        ----------
        stock : formats of the finished workpiece, "stl", "3mf" and "step". A STEP that the B-rep engine refuses
            is not written; `summary["stock_step_refused"]` then says why.
        stock_at : blocks after each of which the workpiece is written, too: stock_7.step after block 7.
        report : whether to write report.html.
        """
        folder, formats = Path(folder), tuple(stock)
        steps: dict[str, int | None] = {between(block): block for block in sorted(set(stock_at))}
        if "step" in formats:
            steps["stock.step"] = None
        if steps:  # refused before anything is written
            blank(self.job)
            asked = tuple(range(block, block + 1) for block in steps.values() if block is not None)
            refuse_beyond(asked, int(self.summary["blocks"]) - 1, "stock_at")
        make_folder(folder)
        self.manifest["complete"] = False
        write_json(folder / MANIFEST, self.manifest)
        if folder.resolve() != self.folder.resolve():
            for name in TABLES:
                if (self.folder / name).is_file():
                    shutil.copyfile(self.folder / name, folder / name)
        for suffix in formats:
            if suffix != "step":
                write_stock(self.stock, folder / f"stock.{suffix}")
        refused = []
        for name, block in steps.items():
            try:
                write_step(self, folder / name, block)
            except EngineError as exc:  # every other file is right without it
                refused.append(exc.message)
        if refused:
            self.summary["stock_step_refused"] = "; ".join(refused)
        write_json(folder / "summary.json", self.summary)
        if report:
            pkgutil.resolve_name(PAGE)(self, folder / "report.html")
        stocks = [f"stock.{suffix}" for suffix in formats if suffix != "step"] + list(steps)
        files = [*TABLES, *stocks, "summary.json", *(["report.html"] * report)]
        made = [name for name in files if ((self.folder if name in TABLES else folder) / name).is_file()]
        forget_outputs(folder, keep=made)
        self.manifest |= {"complete": True, "outputs": made}
        write_json(folder / MANIFEST, self.manifest)
        return folder
