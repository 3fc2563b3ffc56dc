"""Files that are either whole or absent, fingerprints of inputs, and the manifest that ties them together."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining.disk import writing
from vmachining.errors import InputError, JobError
from vmachining.textfile import parse_json

if TYPE_CHECKING:
    import polars as pl

MANIFEST = "manifest.json"
STAGES = "stages.zip"
"""Rows and checkpoints of all passes of a complete run, see `job/store.py`."""

PROGRAM_SUFFIX = {
    "apt": ".cl",
    "poses": ".csv",
    "heidenhain": ".h",
    "heidenhain-iso": ".i",
    "sinumerik": ".mpf",
}
"""Of written programs by their dialect; others are .nc."""

TABLES = (
    "blocks.csv", "blocks.parquet", "scheduled_blocks.csv", "scheduled_blocks.parquet", "strategies.csv", "references.csv",
    *(f"scheduled{name}{end}" for name in ("", "_volume", "_chip_area", "_force") for end in (".nc", *PROGRAM_SUFFIX.values())),
    "deviation.csv", "deviation.parquet",
)  # fmt: skip
OUTPUTS = (
    *TABLES, "summary.json", "report.html", "deviation.html", "stock.stl", "stock.3mf", "stock.glb", "stock.step",
)  # fmt: skip
"""Every result file there can be, the manifest apart, and workpieces between blocks (`between`)."""

PACKAGES = (
    "vmachining", "numpy", "numba", "manifold3d", "trimesh", "polars", "cadquery-ocp-novtk", "cadquery-ocp",
)  # fmt: skip


@contextmanager
def atomic_path(target: Path) -> Iterator[Path]:
    """A temporary path beside `target` that takes its place when the block ends without an error.

    The suffix is kept, because writers choose their format by it.

    Raises InputError: The disk is full, the directory read-only, ...; names the target.
    """
    temporary = temporary_name(target, os.getpid())
    if os.path.lexists(temporary):
        raise InputError("is in the way", file=temporary, remedy="move it away")
    try:
        with writing(target):
            yield temporary
            temporary.replace(target)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise


def temporary_name(target: Path, process: int) -> Path:
    """Where a process writes what is to become `target`."""
    return target.with_name(f".{target.stem}.{process}.tmp{target.suffix}")


def make_folder(folder: Path) -> None:
    """Make a result directory, parents too.

    Raises InputError: It cannot be made, or is something else than a directory.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError("is a file, not a directory for results", file=folder, remedy="choose another --out")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as exc:
        what = f"cannot make the result directory: {exc.strerror or exc}"
        raise InputError(what, file=folder, remedy="choose another --out") from exc


def between(block: int) -> str:
    """Name of the file of the workpiece after a block."""
    return f"stock_{block}.step"


def write_atomic(target: Path, data: bytes | str) -> None:
    """Write a whole file or nothing."""
    with atomic_path(target) as temporary:
        temporary.write_bytes(data if isinstance(data, bytes) else data.encode("utf-8"))


def read_table(path: Path) -> pl.DataFrame:
    """A table that `write_table` wrote, or one like it."""
    import polars as pl

    return pl.read_parquet(path) if path.suffix == ".parquet" else pl.read_csv(path, infer_schema_length=None)


def write_table(frame: pl.DataFrame, *targets: Path) -> None:
    """Write a table to files, .parquet or else CSV, each whole or not at all."""
    for target in targets:
        with atomic_path(target) as temporary:
            (frame.write_parquet if target.suffix == ".parquet" else frame.write_csv)(temporary)


def write_json(target: Path, value: Any) -> None:
    """Write an indented JSON file; NaN is refused, because JSON has none."""
    write_atomic(target, json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def sha256(path: Path) -> str:
    """Hexadecimal digest of a file's bytes.

    Raises InputError: The file cannot be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as exc:
        raise InputError(f"cannot read: {exc.strerror or exc}", file=path) from exc


def fingerprints(paths: dict[str, Path]) -> dict[str, dict[str, str]]:
    """{role: {file, sha256}} of the inputs."""
    return {role: {"file": str(path), "sha256": sha256(path)} for role, path in paths.items()}


def versions() -> dict[str, str]:
    found = {"python": platform.python_version(), "platform": platform.platform(terse=True)}
    for package in PACKAGES:
        with suppress(importlib.metadata.PackageNotFoundError):
            found[package] = importlib.metadata.version(package)
    return found


@cache
def _source_digest() -> str:
    """Of the code of this package: a version number does not tell two states of a checkout apart."""
    root, digest = Path(__file__).resolve().parents[1], hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(f"{path.relative_to(root)}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:12]


def signature() -> dict[str, str]:
    """What must be equal wherever numbers are to be equal."""
    found = {name: version for name, version in versions().items() if name != "platform"}
    return found | {"processor": platform.machine(), "source of vmachining": _source_digest()}


def other_origin(made_with: Mapping[str, str]) -> str | None:
    """The first entry of a `signature` that is not as here, as "numpy 2.0, this is 2.1"; None: all are."""
    for name, here in signature().items():
        if made_with.get(name) != here:
            return f"{name} {made_with.get(name, '(not noted)')}, this is {here}"
    return None


def read_manifest(folder: Path, name: str = MANIFEST) -> dict[str, Any] | None:
    """The manifest of an output directory, or None if none exists.

    Raises JobError: It is there and not readable.
    """
    path = folder / name
    if not path.exists():
        return None
    try:
        manifest = parse_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as exc:
        raise JobError(f"not a readable manifest: {exc}", file=path) from exc
    if not isinstance(manifest, dict):
        raise JobError("not a manifest", file=path)
    return manifest
