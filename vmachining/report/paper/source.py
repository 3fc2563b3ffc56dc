"""What a result directory holds, as far as figures need it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from vmachining.arrays import Floats, Ints
from vmachining.errors import InputError
from vmachining.job.files import read_manifest
from vmachining.stock import read_mesh
from vmachining.textfile import parse_json

if TYPE_CHECKING:
    from vmachining.engines.protocol import StockSurface
    from vmachining.job import RunResult


@dataclass(frozen=True, slots=True, eq=False)
class Results:
    """A finished run on disk.

    name : of the job. blocks, scheduled : tables, the second None without a schedule. strategies : their comparison, or
    None. summary : of summary.json. folder : where all of it lies. finished : the workpiece, where no file of it is needed.
    """

    name: str
    folder: Path
    blocks: pl.DataFrame
    scheduled: pl.DataFrame | None
    strategies: pl.DataFrame | None
    summary: dict[str, Any]
    finished: StockSurface | None = None

    @classmethod
    def of(cls, result: RunResult) -> Results:
        """A run in memory, written or not."""
        blocks, scheduled = result.blocks, result.scheduled_blocks
        return cls(result.job.name, result.folder, blocks, scheduled, None, result.summary, result.surface)

    @classmethod
    def load(cls, folder: Path | str) -> Results:
        """Read a result directory of `run`.

        Raises InputError: It is no such directory, or the run in it has not ended.
        """
        folder = Path(folder)
        manifest = read_manifest(folder)
        table = folder / "blocks.parquet"
        if manifest is None or not table.is_file():
            raise InputError(
                "no result directory of `vmachining run`",
                file=folder,
                remedy="give what run had as --out",
            )
        if not manifest.get("complete", False):
            raise InputError(
                "the run in this directory has not ended",
                file=folder,
                remedy="continue with run --resume",
            )
        scheduled, strategies = folder / "scheduled_blocks.parquet", folder / "strategies.csv"
        return cls(
            str(manifest.get("job", folder.name)),
            folder,
            pl.read_parquet(table),
            pl.read_parquet(scheduled) if scheduled.is_file() else None,
            pl.read_csv(strategies, infer_schema_length=None) if strategies.is_file() else None,
            parse_json((folder / "summary.json").read_text(encoding="utf-8")),
        )

    def stock(self) -> tuple[Floats, Ints]:
        """Vertices (n, 3) mm and triangles (m, 3) of the finished stock.

        Raises InputError: The directory has no mesh of it.
        """
        if self.finished is not None:
            return self.finished.vertices, self.finished.triangles
        for name in ("stock.stl", "stock.3mf"):
            if (self.folder / name).is_file():
                mesh = read_mesh(self.folder / name)
                return mesh.vertices, mesh.triangles
        raise InputError("no stock.stl or stock.3mf", file=self.folder, remedy="run the job with --stock stl")
