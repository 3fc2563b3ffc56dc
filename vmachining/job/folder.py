"""Whose files a result directory holds, and who may write into it now.

A directory may hold anything: only names that a command writes itself matter to it. A file of such a name is ours if
the manifest of the directory names it and it still has the SHA-256 that stands there; a name without a digest is
being written by the process that the manifest names, or was when that process ended. Whatever else has such a name
belongs to somebody and is refused before the first block, and so is an input of the job, which is known by its inode:
links and other spellings of a name do not hide it.

A lock keeps two processes out of one directory. It is the kernel's (`flock`), so it ends with its holder.
"""

from __future__ import annotations

import fcntl
import os
import re
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from vmachining.disk import writing
from vmachining.errors import EngineError, InputError, JobError
from vmachining.job.files import (
    MANIFEST,
    OUTPUTS,
    STAGES,
    make_folder,
    read_manifest,
    sha256,
    temporary_name,
    versions,
    write_json,
)

RUN = "vmachining run"
"""Kind of the manifest of a run."""

WORKING = (
    "blocks.partial.csv", "scheduled_blocks.partial.csv", "pieces.partial.csv", "brep.partial.csv",
    "pieces.nc", "pieces.csv", "pieces.cl",
)  # fmt: skip
"""Tables that grow while a run is working, what it reads again, and what a complete one keeps of them."""

PATTERN = re.compile(r"stock_\d+\.step|checkpoint\.\w+\.\d+\.npz", re.IGNORECASE)
"""Names with a number in them: workpieces between blocks, and checkpoints."""

LOCK_FILE = ".vmachining.lock"
"""Only where a directory cannot be locked itself, as on NFS."""

ENGAGEMENT = (
    "engagement.csv", "engagement.parquet", "engagement.html", "engagement.png", "engagement_map.csv",
    "engagement_chips.csv",
    "positions.csv", "positions.parquet", "chips.csv", "chips.parquet", "chip_points.parquet",
    "figure_chips.svg", "figure_chips.pdf", "figure_chips.png",
    "section.parquet", "figure_section.svg", "figure_section.pdf", "figure_section.png",
)  # fmt: skip
"""Files of `vmachining engage`."""

Identity: TypeAlias = tuple[int, int]


class _Entry(BaseModel):
    model_config = ConfigDict(strict=True)


class _Input(_Entry):
    file: str
    sha256: str


class _Point(_Entry):
    file: str = Field(pattern=rf"^({PATTERN.pattern})$")
    done: int = Field(ge=0)
    total: int = Field(ge=0)
    shares: int = Field(default=1, ge=1)
    rows: str | None = None


class _Options(_Entry):
    engine: str | None
    chord_mm: float | None
    width: float | None
    spacing_mm: float | None
    directions: int | None
    brep: str
    brep_seconds: float
    contact: Literal["none", "sample", "all"]
    stages: list[str]
    stock: list[str] = []
    stock_at: list[int] = []
    part: str | None = None


class _Made(_Entry):
    """What every manifest of ours has. dataset : of a batch."""

    process: int | None = None
    files: dict[str, str | None]
    dataset: dict[str, str | None] = {}


class _Run(_Made):
    """What that of a run has."""

    job: str
    job_file: str | None
    complete: bool
    options: _Options
    inputs: dict[str, _Input]
    versions: dict[str, str]
    stage_seconds: dict[str, float]
    checkpoints: dict[str, _Point]
    stages: dict[str, _Point] = {}
    outputs: list[str] = []


def now() -> str:
    """The time in UTC, ISO 8601, to the second."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def program_words() -> list[str]:
    """The command line of this process, the program by its name alone."""
    return [Path(sys.argv[0]).name, *sys.argv[1:]]


def identity(path: Path) -> Identity | None:
    """What a path leads to, whatever it is called: device and inode; None if it leads nowhere."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino


class ResultFolder:
    """A directory that one command writes into, with the manifest that says what it made there.

    path : Path
    kind : of the manifest; one of another kind is not ours.
    names : that the command may write, the manifest among them.
    pattern : of further ones.
    """

    def __init__(
        self,
        path: Path,
        *,
        kind: str = RUN,
        names: Collection[str] = (*OUTPUTS, *WORKING, STAGES, MANIFEST),
        pattern: re.Pattern[str] | None = PATTERN,
        manifest: str = MANIFEST,
    ) -> None:
        self.path = path
        self.manifest: dict[str, Any] = {}
        self._kind, self._names, self._pattern, self._manifest = kind, names, pattern, manifest

    # -- whose is what -------------------------------------------------------------------------------------

    def made(self) -> dict[str, str | None]:
        """{name: digest} of the files that the manifest in the directory names; a digest of None says that the
        process which wrote that file may not have ended it."""
        manifest = self.earlier()
        return {} if manifest is None else _named(manifest)

    def earlier(self) -> dict[str, Any] | None:
        """The manifest that lies there, None if none exists, it is of another kind, or it is damaged."""
        with suppress(JobError, ValidationError):
            manifest = read_manifest(self.path, self._manifest)
            if manifest is not None and manifest.get("kind") == self._kind:
                (_Run if self._kind == RUN else _Made).model_validate(manifest)
                return manifest
        return None

    def refuse_foreign(self, inputs: Mapping[str, Path], same: Collection[str] = ()) -> None:
        """Refuse a directory where a file of ours would take the place of somebody's.

        inputs : {role: path} of what the command reads. same : names of files that are as they will be.

        Raises InputError: Names the first such file.
        """
        manifest = self.earlier()
        made = {} if manifest is None else _named(manifest) | {self._manifest: None}
        roles = {identity(path): role for role, path in inputs.items()}
        for path in (path for path in self._taken() if path.name not in same):
            role = roles.get(identity(path))
            taken = "and results have a file of that name"
            if role is not None:
                raise InputError(
                    f"is the {role} of this job, {taken}", file=path, remedy="choose another --out"
                )
            if not is_made(path, made):
                changed = made.get(path.name) is not None and path.is_file() and not path.is_symlink()
                what = "was changed since it was made" if changed else "was not made by this command"
                raise InputError(
                    f"{what}, {taken}", file=path, remedy="move it away, or choose another --out"
                )

    def _taken(self) -> Iterator[Path]:
        """Paths in the directory whose names the command may write, the manifest first; dangling links, too."""
        for name in sorted(self._names, key=lambda name: (name != self._manifest, name)):
            if os.path.lexists(self.path / name):
                yield self.path / name
        if self._pattern is not None and self.path.is_dir():
            yield from (path for path in sorted(self.path.iterdir()) if self._pattern.fullmatch(path.name))

    def forget(self, keep: Collection[str] = ()) -> None:
        """Remove what an earlier process made here, so that no file of it passes for one of this one."""
        manifest = self.earlier()
        if manifest is None:
            return
        made = _named(manifest)
        for name in made:
            path = self.path / name
            if name not in keep and is_made(path, made):
                with writing(path):
                    path.unlink(missing_ok=True)
        self.tidy()

    def tidy(self) -> None:
        """Remove what an earlier process was writing when it was killed."""
        manifest = self.earlier() or {}
        if (maker := manifest.get("process")) is None:
            return
        for name in (*_named(manifest), self._manifest):
            torn = temporary_name(self.path / name, maker)
            if torn.is_file() and not torn.is_symlink():
                with writing(torn):
                    torn.unlink(missing_ok=True)

    # -- the manifest --------------------------------------------------------------------------------------

    def save(self) -> None:
        write_json(self.path / self._manifest, self.manifest)

    @contextmanager
    def making(self, *names: str) -> Iterator[None]:
        """The files of these names are ours: said before they are written, with their digests afterwards."""
        files: dict[str, str | None] = self.manifest["files"]
        files |= dict.fromkeys(names)
        self.save()
        yield
        for name in names:
            if (self.path / name).is_file():
                files[name] = sha256(self.path / name)
            else:
                del files[name]
        self.save()


def _named(manifest: Mapping[str, Any]) -> dict[str, str | None]:
    """{name: digest}."""
    return {name: digest for name, digest in manifest["files"].items() if Path(name).name == name}


def is_made(path: Path, made: Mapping[str, str | None]) -> bool:
    """Whether a file is one of those that were made, as it was made."""
    if path.name not in made or path.is_symlink() or not path.is_file():
        return False
    digest = made[path.name]
    return digest is None or sha256(path) == digest


@contextmanager
def usable(checkpoint: Path) -> Iterator[Path]:
    """A checkpoint to be read within.

    Raises JobError: It cannot be read: it is damaged, or something else.
    """
    try:
        yield checkpoint
    except EngineError as exc:
        what = f"the checkpoint cannot be used: {exc.reason}"
        raise JobError(what, file=checkpoint, remedy="run again without --resume") from exc


def refuse_target(path: Path, inputs: Mapping[str, Path], mark: bytes) -> None:
    """Refuse one file that a command is asked to write, if it is an input or somebody else's.

    mark : what files of this command have within their first kilobyte.

    Raises InputError: Names it.
    """
    if not os.path.lexists(path):
        return
    role = next((role for role, given in inputs.items() if identity(given) == identity(path)), None)
    if role is not None and path.exists():
        raise InputError(f"is the {role} itself", file=path, remedy="choose another name")
    if path.is_file() and not path.is_symlink():
        with path.open("rb") as file:
            if mark in file.read(1024):
                return
    remedy = "move it away, or choose another name"
    raise InputError("exists and was not made by this command", file=path, remedy=remedy)


def _locked(path: Path, flags: int) -> int:
    """A descriptor with the lock of a directory, of a file in it where the file system locks no directories."""
    descriptor = os.open(path, flags, 0o666)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise
    except OSError:  # NFS locks nothing that is not open for writing
        os.close(descriptor)
        if flags != os.O_RDONLY:
            raise
        return _locked(path / LOCK_FILE, os.O_RDWR | os.O_CREAT)
    return descriptor


class FolderLock:
    """One process at a time in a directory. Released at the end of a `with`, or by the kernel.

    Entering does not take it yet, because the directory may have to be made first: `acquire` does, once.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._descriptor: int | None = None

    @property
    def is_held(self) -> bool:
        return self._descriptor is not None

    def acquire(self) -> None:
        """Take the lock, if it is not held already.

        Raises InputError: Another process has it; says which one.
        """
        if self._descriptor is not None:
            return
        try:
            self._descriptor = _locked(self.path, os.O_RDONLY)
        except BlockingIOError as exc:
            what, remedy = (
                "another vmachining writes into this directory",
                "wait for it, stop it, or choose another --out",
            )
            raise InputError(f"{what}{self._holder()}", file=self.path, remedy=remedy) from exc
        except OSError as exc:
            what = f"cannot be locked: {exc.strerror or exc}"
            raise InputError(what, file=self.path, remedy="choose another --out") from exc

    def _holder(self) -> str:
        try:
            manifest = read_manifest(self.path) or {}
        except JobError:
            return ""
        if manifest.get("complete") is not False or "process" not in manifest:
            return ""
        return f" (process {manifest['process']}, since {manifest.get('started')})"

    def release(self) -> None:
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def __enter__(self) -> FolderLock:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def engagement_folder(path: Path) -> ResultFolder:
    """A directory as `vmachining engage` sees it: it may be that of a run, so the manifest has its own name."""
    return ResultFolder(
        path, kind="vmachining engagement", names=(*ENGAGEMENT, "engagement.json"), pattern=None, manifest="engagement.json",
    )  # fmt: skip


@contextmanager
def engagement_files(path: Path, inputs: Mapping[str, Path] | None = None) -> Iterator[None]:
    """Tables and pictures of engagement are written within; those of an earlier call go first.

    Raises InputError: The directory holds a file of somebody else under one of their names, or somebody is writing
        there.
    """
    make_folder(path)
    place = engagement_folder(path)
    with FolderLock(path) as lock:
        lock.acquire()
        place.refuse_foreign(inputs or {})
        place.forget()
        place.manifest = {
            "kind": "vmachining engagement", "complete": False, "command": program_words(), "process": os.getpid(),
            "started": now(), "versions": versions(), "files": {},
        }  # fmt: skip
        with place.making(*ENGAGEMENT):
            yield
        place.manifest |= {"complete": True, "ended": now()}
        place.save()
