"""The record of a run in its directory: the manifest, the checkpoints that it points to, and what its stages have cost."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from vmachining.errors import InputError
from vmachining.job.engagement_columns import Saves
from vmachining.job.files import atomic_path, fingerprints, signature, versions
from vmachining.job.folder import RUN, WORKING, ResultFolder, now
from vmachining.job.jobfile import Job
from vmachining.job.store import continued
from vmachining.machine import described
from vmachining.memory import peak_mb
from vmachining.progress import Progress


class Record:
    """What is where on disk, and how far it is.

    folder : of the result. spent : by the run so far. progress : hears when a checkpoint is written.
    """

    def __init__(self, folder: Path, spent: Spent, progress: Progress) -> None:
        self.place = ResultFolder(folder)
        self.spent, self._progress = spent, progress

    def open(
        self, job: Job, options: dict[str, Any], command: Sequence[str], subprograms: Sequence[str], parts: Sequence[Path], *,
        resume: bool, force: bool,
    ) -> None:  # fmt: skip
        """Begin anew, or continue with what is there, see `store.continued`.

        parts : files of parts that will be read.

        Raises InputError: The directory holds files of somebody else, or the result of another job and nobody said
            `force`.
        Raises JobError: What is there cannot be continued.
        """
        roles = job.inputs | {f"subprogram {k}": Path(name) for k, name in enumerate(subprograms, 1)}
        inputs, place = fingerprints(roles), self.place
        place.refuse_foreign(roles | {f"file {k} of the parts": file for k, file in enumerate(parts, 1)})
        old = place.earlier()
        fresh: dict[str, Any] = {
            "kind": RUN, "job": job.name, "job_file": job.source and str(job.source.resolve()), "complete": False,
            "command": list(command),
            "process": os.getpid(), "started": now(), "ended": None, "seconds": 0.0, "options": options, "inputs": inputs,
            "machine": described(job.machine) if job.machine else None,
            "versions": versions() | signature(), "checkpoints": {}, "files": dict.fromkeys(WORKING),
        }  # fmt: skip
        if old is not None and not force:
            refuse_other_job(old, fresh, place.path)
        points = None if old is None or not resume else continued(place, old, fresh)
        if old is None or not points:  # nothing to continue with
            place.forget()
            place.manifest = fresh
            self.save()  # from here on the directory says that it is not complete
            return
        place.tidy()
        self.spent.add(old["stage_seconds"])
        fresh["started"] = old.get("started", fresh["started"])
        fresh["files"] |= place.made() | dict.fromkeys(WORKING)  # these grow again
        fresh["checkpoints"] = points
        place.manifest = fresh
        self.save()

    def known(self, name: str) -> dict[str, Any] | None:
        """The checkpoint of a pass: file, done, total, and what else `checkpoint` was given."""
        found: dict[str, Any] | None = self.place.manifest["checkpoints"].get(name)
        return found

    def checkpoint(self, name: str, state: Saves, done: int, total: int, **more: Any) -> None:
        """Save the workpiece or what is known of contact, then point the manifest to it, then forget the one before.

        more : for a pass that cuts: shares of the workpiece, and rows, the digest of the rows on disk.
        """
        target = self.place.path / f"checkpoint.{name}.{done}.npz"
        self._progress("saving", 0, 1)
        with self.place.making(target.name), atomic_path(target) as temporary:
            state.save(temporary)
        self._progress("saving", 1, 1)
        manifest, old = self.place.manifest, self.known(name)
        manifest["checkpoints"][name] = {"file": target.name, "done": done, "total": total, **more}
        self.save()
        if old is not None and old["file"] != target.name:
            with suppress(OSError):
                (self.place.path / old["file"]).unlink()
            manifest["files"].pop(old["file"], None)

    def save(self) -> None:
        """Write the manifest with the time spent so far; nothing before it is opened."""
        if self.place.manifest:
            spent = self.spent.summary()
            self.place.manifest |= {
                "seconds": spent["seconds"],
                "stage_seconds": spent["stage_seconds"],
                "ended": now(),
            }
            self.place.save()


def refuse_other_job(old: Mapping[str, Any], new: Mapping[str, Any], folder: Path) -> None:
    """Refuse to replace what another job has made: one of another file with other content, or without files of another name;
    and by a part of a run, or by a whole one, what is not the same part.

    Raises InputError: Names that job.
    """
    files = [manifest.get("job_file") for manifest in (old, new)]
    digests = [manifest.get("inputs", {}).get("job", {}).get("sha256") for manifest in (old, new)]
    part, other = (manifest.get("options", {}).get("part") for manifest in (old, new))
    named = old.get("job") == new["job"]
    same = named if None in files else (files[0] == files[1] or digests[0] == digests[1])
    if same and part == other:
        return
    whose = f"{old.get('job')!r} of {files[0]}" if files[0] else f"{old.get('job')!r}"
    ended = f"part {part}" if part else "the result" if old.get("complete") else "an unfinished run"
    remedy = "choose another --out, or replace it with --force"
    raise InputError(
        f"holds {ended} of {'this' if same else 'another'} job, {whose}", file=folder, remedy=remedy
    )


STAGES = ("read", "cut", "contact", "plan", "judge", "check", "files")
"""In their order: program and stock; removed volumes; contact, chips and forces; feeds and the program with them; second opinions
of exact rays; the B-rep engine; tables, surface and report."""


class Spent:
    """Wall time by stage. A stage within another one is not counted twice; nothing is counted outside of all.

    seconds : {stage: s}, of earlier processes that worked on the same run, too. most_mb : peak while others cut, with theirs.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.most_mb = 0.0
        self._under_way: list[str] = []
        self._since = 0.0

    def _count(self) -> None:
        now = time.perf_counter()
        if self._under_way:
            stage = self._under_way[-1]
            self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._since
        self._since = now

    @contextmanager
    def on(self, stage: str) -> Iterator[None]:
        """The time within is that of a stage."""
        self._count()
        self._under_way.append(stage)
        try:
            yield
        finally:
            self._count()
            self._under_way.pop()

    def add(self, earlier: Mapping[str, float]) -> None:
        for stage, seconds in earlier.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + seconds

    def summary(self) -> dict[str, Any]:
        """Keys of summary.json, up to now."""
        self._count()
        order = {stage: self.seconds[stage] for stage in STAGES if stage in self.seconds}
        return {
            "seconds": sum(self.seconds.values()),
            "stage_seconds": order,
            "peak_mb": max(peak_mb(), self.most_mb),
        }


def in_words(stage_seconds: Mapping[str, float]) -> str:
    """Such as "cut 2.1 s, contact 0.6 s"; stages below a hundredth of the whole are left out."""
    least = 0.01 * sum(stage_seconds.values())
    return ", ".join(
        f"{stage} {seconds:.2g} s" if seconds < 100 else f"{stage} {seconds:.0f} s"
        for stage, seconds in stage_seconds.items()
        if seconds >= least
    )
