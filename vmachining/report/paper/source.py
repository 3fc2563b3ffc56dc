"""What a result directory holds, as far as figures need it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats, Ints
from vmachining.errors import InputError
from vmachining.job.files import read_manifest

__all__ = ["Results"]


@dataclass(frozen=True, slots=True, eq=False)
class Results:
    """A finished run on disk.

    name : of the job. blocks, scheduled : tables, the second None without a schedule. strategies : their comparison, or
    None. summary : of summary.json. folder : where all of it lies.
    """

    name: str
    folder: Path
    blocks: pl.DataFrame
    scheduled: pl.DataFrame | None
    strategies: pl.DataFrame | None
    summary: dict[str, Any]

    @classmethod
    def load(cls, folder: Path | str) -> Results:
        """Read a result directory of `run`.

        Raises
        ------
        InputError
            It is no such directory, or the run in it has not ended.
        """
        folder = Path(folder)
        manifest = read_manifest(folder)
        table = folder / "blocks.parquet"
        if manifest is None or not table.is_file():
            raise InputError(
                "no result directory of `vmachining run`",
                file=str(folder),
                remedy="give what run had as --out",
            )
        if not manifest.get("complete", False):
            raise InputError(
                "the run in this directory has not ended", file=str(folder), remedy="go on with run --resume"
            )
        scheduled, strategies = folder / "scheduled_blocks.parquet", folder / "strategies.csv"
        return cls(
            str(manifest.get("job", folder.name)),
            folder,
            pl.read_parquet(table),
            pl.read_parquet(scheduled) if scheduled.is_file() else None,
            pl.read_csv(strategies, infer_schema_length=None) if strategies.is_file() else None,
            json.loads((folder / "summary.json").read_text(encoding="utf-8")),
        )

    def stock(self) -> tuple[Floats, Ints]:
        """Vertices (n, 3) mm and triangles (m, 3) of the finished stock.

        Raises
        ------
        InputError
            The directory has no mesh of it.
        """
        import trimesh

        for name in ("stock.stl", "stock.3mf"):
            if (self.folder / name).is_file():
                mesh = trimesh.load_mesh(self.folder / name)
                return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
        raise InputError(
            "no stock.stl or stock.3mf", file=str(self.folder), remedy="run the job with --stock stl"
        )
