"""Files that are either whole or absent, fingerprints of inputs, and the manifest that ties them together."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from vmachining.errors import InputError, JobError

__all__ = ["atomic_path", "fingerprints", "read_manifest", "sha256", "versions", "write_atomic", "write_json"]

MANIFEST = "manifest.json"
PACKAGES = ("vmachining", "numpy", "numba", "manifold3d", "trimesh", "polars", "cadquery")


@contextmanager
def atomic_path(target: Path) -> Iterator[Path]:
    """A temporary path beside `target` that takes its place when the block ends without an error.

    The suffix is kept, because writers choose their format by it.
    """
    temporary = target.with_name(f".{target.stem}.{os.getpid()}.tmp{target.suffix}")
    try:
        yield temporary
        temporary.replace(target)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise


def write_atomic(target: Path, data: bytes | str) -> None:
    """Write a whole file or nothing."""
    with atomic_path(target) as temporary:
        temporary.write_bytes(data if isinstance(data, bytes) else data.encode("utf-8"))


def write_json(target: Path, value: Any) -> None:
    """Write an indented JSON file; NaN is refused, because JSON has none."""
    write_atomic(target, json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def sha256(path: Path) -> str:
    """Hexadecimal digest of a file's bytes.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    digest = hashlib.sha256()
    try:
        with path.open("rb") as file:
            while chunk := file.read(1 << 20):
                digest.update(chunk)
    except OSError as exc:
        raise InputError(f"cannot read: {exc.strerror or exc}", file=str(path)) from exc
    return digest.hexdigest()


def fingerprints(paths: dict[str, Path]) -> dict[str, dict[str, str]]:
    """{role: {file, sha256}} of the inputs."""
    return {role: {"file": str(path), "sha256": sha256(path)} for role, path in paths.items()}


def versions() -> dict[str, str]:
    """What produced the numbers."""
    found = {"python": platform.python_version(), "platform": platform.platform(terse=True)}
    for package in PACKAGES:
        with suppress(importlib.metadata.PackageNotFoundError):
            found[package] = importlib.metadata.version(package)
    return found


def read_manifest(folder: Path) -> dict[str, Any] | None:
    """The manifest of an output directory, or None if there is none.

    Raises
    ------
    JobError
        It is there and not readable.
    """
    path = folder / MANIFEST
    if not path.exists():
        return None
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as exc:
        raise JobError(f"not a readable manifest: {exc}", file=str(path)) from exc
    if not isinstance(manifest, dict):
        raise JobError("not a manifest", file=str(path))
    return manifest
