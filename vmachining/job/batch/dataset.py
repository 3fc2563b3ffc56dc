"""The data set of a batch: dataset/job=NAME/blocks.parquet, hive partitions with the schema of `blocks`.

Every file below dataset/ is read by a query over it, so none may lie there that the ledger of the batch does not name.
A file comes whole: it is written in the directory above, where no query looks, and moved to its place.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from vmachining.errors import InputError
from vmachining.job.files import make_folder, sha256, temporary_name, writing

DATASET = "dataset"
TABLE = "blocks.parquet"


class Dataset:
    """Partitions of the finished jobs of a batch.

    out : directory of the batch.
    earlier : ledger of the batch that was there before, None if there was none.
    """

    def __init__(self, out: Path, earlier: Mapping[str, Any] | None) -> None:
        self.path = out / DATASET
        self.digests: dict[str, str] = {}
        """{name of the job's directory: SHA-256} of what lies there now, written by this object."""
        named = (earlier or {}).get(DATASET, {}).items()
        self._earlier: dict[str, str | None] = {k: v for k, v in named if Path(k).name == k}
        self._maker = (earlier or {}).get("process")

    def table(self, name: str) -> Path:
        return self.path / f"job={name}" / TABLE

    def refuse_foreign(self) -> None:
        """Refuse a data set with files that no batch made, or that were changed since.

        Raises InputError: Names the first such file.
        """
        if not os.path.lexists(self.path):
            return
        ours = {self.table(name): digest for name, digest in self._earlier.items()}
        foreign = self.path if self.path.is_symlink() or not self.path.is_dir() else None
        for path in () if foreign else sorted(self.path.rglob("*")):
            if path.is_dir() and not path.is_symlink():
                continue
            known = path in ours and path.is_file() and not path.is_symlink()
            if not known or ours[path] not in (None, sha256(path)):
                foreign = path
                break
        if foreign is not None:
            raise InputError(
                f"was not made by this command, and queries read all of {DATASET}/", file=foreign,
                remedy="move it away, or choose another --out",
            )  # fmt: skip

    def clear(self) -> None:
        """Remove what the earlier batch made, after `refuse_foreign`: no job of it passes for one of this batch."""
        for name in self._earlier:
            torn = [] if self._maker is None else [self._temporary(name, int(self._maker))]
            for path in (self.table(name), *torn):
                with writing(path):
                    path.unlink(missing_ok=True)
            with suppress(OSError):  # not there, or not empty
                self.table(name).parent.rmdir()

    def put(self, folder: Path) -> None:
        """Lay down the blocks of a finished job, whole or not at all.

        Raises InputError: The disk is full, ...; names the file.
        """
        target = self.table(folder.name)
        make_folder(target.parent)
        temporary = self._temporary(folder.name, os.getpid())
        try:
            with writing(target):
                shutil.copyfile(folder / TABLE, temporary)
                digest = sha256(temporary)
                temporary.replace(target)
        except BaseException:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise
        self.digests[folder.name] = digest

    def _temporary(self, name: str, process: int) -> Path:
        return temporary_name(self.path.parent / f"{name}.parquet", process)
