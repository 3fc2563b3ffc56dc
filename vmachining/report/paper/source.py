"""What a result directory holds, as far as figures need it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from vmachining.arrays import Floats, Ints
from vmachining.errors import InputError
from vmachining.job.files import read_manifest, read_table
from vmachining.stock import read_mesh
from vmachining.textfile import parse_json

if TYPE_CHECKING:
    from vmachining.engines.protocol import StockSurface
    from vmachining.job import RunResult


def stored(folder: Path, name: str, lacks: str, remedy: str) -> pl.DataFrame:
    """A table of a directory. InputError with these words: it is not there."""
    if not (folder / name).is_file():
        raise InputError(lacks, file=folder, remedy=remedy)
    return read_table(folder / name)


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
        manifest, table = read_manifest(folder), folder / "blocks.parquet"
        if manifest is None or not table.is_file():
            remedy = "give what run had as --out"
            raise InputError("no result directory of `vmachining run`", file=folder, remedy=remedy)
        if not manifest.get("complete", False):
            remedy = "continue with run --resume"
            raise InputError("the run in this directory has not ended", file=folder, remedy=remedy)
        files = (folder / name for name in ("scheduled_blocks.parquet", "strategies.csv"))
        scheduled, strategies = (read_table(file) if file.is_file() else None for file in files)
        summary = parse_json((folder / "summary.json").read_text(encoding="utf-8"))
        name = str(manifest.get("job", folder.name))
        return cls(name, folder, read_table(table), scheduled, strategies, summary)

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
