"""Parts of one run, made anywhere and joined to the tables that one run makes, to the last digit.

Part k of n cuts its shares of the workpiece after all sweeps, and asks the contact of every n-th chunk of blocks. What its
shares answer is noted order by order, so that a merge adds them up as one run does; that a share has few orders to wait for
needs shares of fixed borders, which columns have where they take every motion. Elsewhere, and where [feed] measures volumes along
blocks, the merge cuts. Schedules, second opinions and files are made by the merge.

The directory of a part is that of a run that is not complete: `--resume` continues it.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, cast
from zipfile import ZIP_STORED, ZipFile

import numpy as np

from vmachining.checkpoint import DAMAGE, Saved, opened
from vmachining.disk import Scratch, scribbling
from vmachining.engines import engine_class
from vmachining.engines.protocol import Divisible, Engine, Removal, Share
from vmachining.engines.serving import joined
from vmachining.errors import EngineError, FullError, InputError
from vmachining.job.executor import InProcess, Later
from vmachining.job.files import other_origin
from vmachining.job.folder import ResultFolder, is_made, usable
from vmachining.job.paths import CutterPath
from vmachining.tool import Profile

ANSWERS = "answers.npz"


@contextmanager
def _unpacked(file: Path) -> Iterator[Path]:
    """A directory with what lies in a file of `Noted.save`.

    Raises EngineError: It is missing, damaged or something else.
    Raises FullError: No room to unpack it.
    """
    with Scratch() as folder:
        try:
            with ZipFile(file) as archive, scribbling(folder):
                archive.extractall(folder)
        except FullError:
            raise
        except DAMAGE as exc:
            raise EngineError(f"checkpoint {file.name} cannot be read: {exc}", engine="part") from exc
        yield folder


class Part(NamedTuple):
    """Number k (from 1) of n."""

    number: int
    of: int

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    def shares(self, count: int) -> list[int]:
        """Its shares of so many."""
        return list(range(count))[self.number - 1 :: self.of]


def parse_part(text: str) -> Part:
    """Of words such as 3/64.

    Raises InputError: They are not parts of a run.
    """
    found = re.fullmatch(r"\s*(\d{1,6})\s*/\s*(\d{1,6})\s*", text)
    if not found or not 1 <= int(found[1]) <= int(found[2]):
        raise InputError(
            f"--part {text!r} is not understood", remedy="give K/N with K from 1 to N, such as 3/64"
        )
    return Part(int(found[1]), int(found[2]))


class Noted(InProcess):
    """Some shares of a workpiece in this process, with all that they answered.

    known : what `save` wrote, to continue from.
    """

    def __init__(self, engine: Engine, shares: int, own: Sequence[int], known: Path | None = None) -> None:
        super().__init__(engine, shares, own)
        self._own, self._names = list(own), list[str | None]([None])
        self._numbers = [array("d") for _ in own]
        self._proven, self._named = [bytearray() for _ in own], [bytearray() for _ in own]
        self._notes: list[dict[str, str]] = [{} for _ in own]
        if known is not None:
            self._continue(known, shares)

    def _summed(self, parts: list[Removal]) -> Removal:
        for k, part in enumerate(parts):
            if part.engine not in self._names:
                self._names.append(part.engine)
            if part.note is not None:
                self._notes[k][str(len(self._proven[k]))] = part.note
            self._numbers[k].extend(part[:3])
            self._proven[k].append(part.proven)
            self._named[k].append(self._names.index(part.engine))
        return super()._summed(parts)

    def save(self, path: Path) -> None:
        """The shares, and the answers: (n, 3) lo, estimate, hi of every order, whether they are proven, by whom, and notes."""
        self._flush()
        arrays: dict[str, Any] = {}
        for k, share in enumerate(self._own):
            arrays[f"numbers{share}"] = np.frombuffer(self._numbers[k]).reshape(-1, 3)
            arrays[f"proven{share}"] = np.frombuffer(bytes(self._proven[k]), dtype=np.uint8)
            arrays[f"named{share}"] = np.frombuffer(bytes(self._named[k]), dtype=np.uint8)
        state = {"shares": self._own, "names": self._names, "notes": self._notes}
        with Scratch() as folder:
            with scribbling(folder):
                for share, engine in zip(self._own, self._engines, strict=True):
                    engine.save(folder / f"{share}.npz")
                Saved("part", state, arrays).write(folder / ANSWERS)
            with ZipFile(path, "w", ZIP_STORED) as archive:
                for file in folder.glob("*.npz"):
                    archive.write(file, file.name)

    def _continue(self, known: Path, shares: int) -> None:
        kind = cast("type[Divisible]", engine_class(self.engine))
        with usable(known), _unpacked(known) as folder:
            with opened(folder / ANSWERS, "part") as saved:
                state = saved.state
                for k, share in enumerate(self._own):
                    raw = {
                        name: saved.arrays[f"{name}{share}"].tobytes()
                        for name in ("numbers", "proven", "named")
                    }
                    self._numbers[k] = array("d", raw["numbers"])
                    self._proven[k], self._named[k] = bytearray(raw["proven"]), bytearray(raw["named"])
            self._names, self._notes = list(state["names"]), [dict(notes) for notes in state["notes"]]
            self._engines = [
                kind.load(folder / f"{k}.npz", **({"share": Share(k, shares)} if shares > 1 else {}))
                for k in self._own
            ]


class Replayed:
    """What the shares of all parts have answered, added up in the order of the shares.

    engine : the raw workpiece. files : of `Noted.save`, together of all shares.
    """

    ahead = 0

    def __init__(self, engine: Engine, files: Sequence[Path]) -> None:
        self.engine, self.chord = engine.name, engine.chord
        self._whole, self._next = engine, 0
        self._scratch = Scratch()
        self._shares: dict[int, _Answers] = {}
        for file in files:
            with _unpacked(file) as folder:
                with opened(folder / ANSWERS, "part") as saved:
                    state, arrays = saved.state, saved.arrays
                for k, share in enumerate(state["shares"]):
                    self._shares[share] = _Answers(
                        arrays[f"numbers{share}"], arrays[f"proven{share}"], arrays[f"named{share}"],
                        state["names"], state["notes"][k],
                    )  # fmt: skip
                    (folder / f"{share}.npz").rename(self._scratch.path / f"{share}.npz")
        counts = {len(answers.numbers) for answers in self._shares.values()}
        if len(counts) != 1 or sorted(self._shares) != list(range(len(self._shares))):
            what = f"the parts answered {sorted(counts)} orders with shares {sorted(self._shares)}"
            raise InputError(what, remedy="make all parts again")
        (self._orders,) = counts

    def _answer(self) -> Later:
        k, self._next = self._next, self._next + 1
        if k >= self._orders:
            raise self._another(f"more than {self._orders}")
        parts = [self._shares[share].of(k) for share in range(len(self._shares))]
        found = parts[0] if len(parts) == 1 else cast("Divisible", self._whole).summed(parts)
        return lambda: found

    def _another(self, orders: str) -> EngineError:
        what = f"the parts answered {self._orders} orders, and this run gives {orders}"
        return EngineError(what, engine=self.engine)

    def cut(self, profile: Profile, path: CutterPath, block: int) -> Later:
        return self._answer()

    def touch(self, profile: Profile, path: CutterPath, within: float | None = None) -> Later:
        return self._answer()

    def save(self, path: Path) -> None:
        """See `Executor`; only after all orders there is a workpiece."""
        self.finish().save(path)

    def finish(self) -> Engine:
        """See `Executor`. A workpiece that a checkpoint knows already needs no order.

        Raises EngineError: The parts had more orders than this run.
        """
        if self._next not in (0, self._orders):
            raise self._another(str(self._next))
        files = [self._scratch.path / f"{share}.npz" for share in range(len(self._shares))]
        if len(files) == 1:
            return engine_class(self.engine).load(files[0])
        whole = joined(self.engine, files)
        if (blocks := whole.in_use()) is not None:
            whole.forget_others(blocks)
        return whole

    def peak_mb(self) -> float:
        return 0.0

    def close(self) -> None:
        self._scratch.cleanup()


class _Answers(NamedTuple):
    """Of one share, see `Noted.save`."""

    numbers: Any
    proven: Any
    named: Any
    names: list[str | None]
    notes: Mapping[str, str]

    def of(self, k: int) -> Removal:
        lo, estimate, hi = self.numbers[k].tolist()
        note = self.notes.get(str(k)) if self.notes else None
        return Removal(lo, estimate, hi, bool(self.proven[k]), self.names[self.named[k]], note)


class Parts(NamedTuple):
    """Complete parts of one run. manifest : of the first one. cut, contact : their files, by pass."""

    manifest: dict[str, Any]
    cut: list[Path]
    contact: list[Path]


def read_parts(folders: Sequence[Path]) -> Parts:
    """All parts of one run, each once.

    Raises InputError: A directory that holds no part, one that is not complete, of other inputs, options or code; one that is
        missing or there twice.
    """
    found: dict[int, tuple[Path, dict[str, Any]]] = {}
    cut: list[Path] = []
    contact: list[Path] = []
    for folder in folders:
        manifest = ResultFolder(folder).earlier() or {}
        text = manifest.get("options", {}).get("part")
        if text is None:
            raise InputError(
                "contains no part of a run", file=folder, remedy="give what `run --part K/N` wrote"
            )
        part = parse_part(text)
        if other := other_origin(manifest["versions"]):
            remedy = "make all parts, and merge them, with one version"
            raise InputError(f"part {part} was made with {other}", file=folder, remedy=remedy)
        if not manifest.get("part_complete"):
            remedy = f"vmachining run {manifest.get('job_file')} --part {part} --out {folder} --resume"
            raise InputError(f"part {part} is not complete", file=folder, remedy=remedy)
        if part.number in found:
            twice = f"{found[part.number][0]} and {folder}"
            raise InputError(f"part {part} is there twice: {twice}", remedy="give each part once")
        if found:
            _refuse_other(*next(iter(found.values())), folder, manifest, part)
        found[part.number] = folder, manifest
        points = manifest["checkpoints"]
        for name, files in (("program", cut), ("engagement", contact)):
            if name in points:
                files.append(path := folder / points[name]["file"])
                if not is_made(path, manifest["files"]):
                    what = "this part cannot be used: it is missing, or not as it was made"
                    raise InputError(what, file=path, remedy="make the part again")
    if not found:
        raise InputError("no parts are given", remedy="vmachining merge DIR... --out DIR")
    count = part.of
    if missing := [str(k) for k in range(1, count + 1) if k not in found]:
        shown = ", ".join(missing[:10]) + (f" and {len(missing) - 10} more" if len(missing) > 10 else "")
        several = len(missing) > 1
        remedy = f"vmachining run {manifest.get('job_file')} --part {missing[0]}/{count}"
        what = f"part{'s' * several} {shown} of {count} {'are' if several else 'is'} missing"
        raise InputError(what, remedy=remedy)
    return Parts(next(iter(found.values()))[1], cut, contact)


def _refuse_other(
    first: Path, one: Mapping[str, Any], folder: Path, other: Mapping[str, Any], part: Part
) -> None:
    """Refuse a part of another run than the first one."""
    before = parse_part(one["options"]["part"])
    if before.of != part.of:
        what = f"holds part {part}, and {first} part {before}"
        raise InputError(what, file=folder, remedy="merge parts of one division")
    for role, entry in one["inputs"].items():
        if other["inputs"].get(role, {}).get("sha256") != entry["sha256"]:
            what = f"part {part} was made of another {role} than {first}"
            raise InputError(what, file=folder, remedy="make it again")
    changed = [
        name for name in one["options"].keys() | other["options"].keys()
        if name not in ("part", "workers") and one["options"].get(name) != other["options"].get(name)
    ]  # fmt: skip
    if changed:
        what = f"part {part} was made with another {', '.join(sorted(changed))} than {first}"
        raise InputError(what, file=folder, remedy="make all parts with the same options")
