"""What a finished result still knows of its stages, and the one rule of what may differ when a run continues.

A result that is complete keeps the rows and the last checkpoint of every pass in one file, `stages.zip`. Asking more of it is
then one more stage: the archive is unpacked, the run continues where every pass has ended, and only what is asked in addition is
done.

| option | when a run continues |
|---|---|
| brep, brep_seconds, contact, stages, stock, stock_at, csv | what is asked in addition is done, what is there stays |
| workers | any value |
| every other one | changes numbers that are on disk: refused by name |
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile

from vmachining.errors import JobError
from vmachining.job.files import MANIFEST, STAGES, atomic_path, other_origin, sha256
from vmachining.job.folder import PATTERN, WORKING, ResultFolder, is_made
from vmachining.job.jobfile import Job
from vmachining.textfile import parse_json

PARTS = ("cut", "contact", "plan", "judge", "show")
"""What a run consists of, and a user may leave out: all but the first."""

CONTACTS = ("none", "sample", "all")

ADDED = ("brep", "brep_seconds", "contact", "stages", "stock", "stock_at", "csv")
"""Options whose later values add to what is there."""

FREE = (*ADDED, "workers")
"""Options that may differ when a run continues: they change no number that is on disk."""


def refuse_other_options(
    before: Mapping[str, Any], after: Mapping[str, Any], file: Path, *, ended: bool
) -> None:
    """Refuse to continue a run with options that would have given other numbers.

    before, after : options of the run that is there and those that are requested. ended : whether it is complete.

    Raises JobError: Names every such option with both values.
    """
    changes = [
        f"{name} was {_shown(before, name)} and is {_shown(after, name)}"
        for name in (*after, *(before.keys() - after.keys()))
        if name not in FREE and before.get(name) != after.get(name)
    ]
    if changes:
        what = f"the {'finished' if ended else 'interrupted'} run had other options: {', '.join(changes)}"
        remedy = "continue with the old ones, choose another --out, or run again without --resume, which replaces it"
        raise JobError(what, file=file, remedy=remedy)


def _shown(options: Mapping[str, Any], name: str) -> str:
    return json.dumps(options[name]) if name in options else "not given"


def continued(place: ResultFolder, old: Mapping[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """Checkpoints that a run continues with, of an interrupted run or of a complete one; none: it begins anew.

    A complete result of other inputs or of another version is not a start: it is replaced. old, new : manifests of the run that
    is there and of the one that continues; `new["options"]` takes over what the complete one has.

    Raises JobError: Names every option with its old and its new value, or the version, or the input that changed.
    """
    file, kept = place.path / MANIFEST, old.get("checkpoints", {})
    points = {name: entry for name, entry in kept.items() if (place.path / entry["file"]).is_file()}
    # a complete result; or one that was, whose process was killed while it unpacked, or laid down what it added
    ended = "stages" in old and (not points or len(points) < len(kept))
    if ended:
        points = old["stages"] if (place.path / STAGES).is_file() else {}
    other = _other_origin(old, new)
    if not points or (ended and other is not None):
        return {}
    before, options = old.get("options", {}), new["options"]
    refuse_other_options(before, options, file, ended=ended)
    if other is not None:
        raise JobError(other[0], file=other[1] or str(file), remedy="run again without --resume")
    if "stages" in old:
        brep = [text for text in (before.get("brep", "none"), options["brep"]) if text != "none"]
        parts = dict.fromkeys(part for text in brep for part in text.split("+"))
        options["brep"] = "all" if "all" in parts else "+".join(parts) or "none"
        options["contact"] = max(before.get("contact", "all"), options["contact"], key=CONTACTS.index)
        stages = {*before.get("stages", PARTS), *options["stages"]}
        options["stages"] = [name for name in PARTS if name in stages]
        options |= {name: before[name] for name in ("stock", "stock_at") if name in before}
        new["stages"] = old["stages"]
    if "csv" in before:  # of an interrupted run, too: no option takes it back
        options["csv"] = before["csv"]
    if ended:
        _reopen(place, old)
    return points


def _other_origin(old: Mapping[str, Any], new: Mapping[str, Any]) -> tuple[str, str] | None:
    """Why a run has another origin, and the file, if one changed; None: inputs and version are the same."""
    if other := other_origin(old["versions"]):
        return f"the interrupted run was made with {other}", ""
    for role, entry in new["inputs"].items():
        if old.get("inputs", {}).get(role, {}).get("sha256") != entry["sha256"]:
            return f"the {role} file changed since the interrupted run", entry["file"]
    return None


def same_inputs(job: Job, manifest: Mapping[str, Any] | None) -> bool:
    """Whether a manifest is about exactly the files of a job."""
    return manifest is not None and not changed_inputs(job, manifest)


def changed_inputs(job: Job, manifest: Mapping[str, Any]) -> list[str]:
    """Input files that differ from those in a manifest, each as "the <role> file <path>"."""
    inputs: Mapping[str, Mapping[str, str]] = manifest.get("inputs", {})
    here = dict(job.inputs)
    for role, entry in inputs.items():  # a program may call others, in files that only its last run knows
        if role.startswith("subprogram"):
            here[role] = Path(entry["file"])
    same = {role for role in here if role in inputs and here[role].is_file()}
    same = {role for role in same if sha256(here[role]) == inputs[role]["sha256"]}
    changed = [role for role in dict.fromkeys((*inputs, *here)) if role not in same]
    return [f"the {role} file {here[role] if role in here else inputs[role]['file']}" for role in changed]


def why_anew(job: Job, manifest: Mapping[str, Any]) -> str | None:
    """Why a run cannot continue from a result; None where it can."""
    if changed := changed_inputs(job, manifest):
        return f"{' and '.join(changed)} changed since this result was made"
    other = other_origin(manifest["versions"])
    return other and f"this result was made with {other}"


def finished(job: Job, folder: Path, wanted: Mapping[str, Any] | None = None) -> dict[str, Any] | None:
    """The summary of a complete run of exactly these inputs to which nothing is added; None: there is something to do.

    wanted : options that are requested, by their names in the manifest; what is not named is taken as it is there.

    Raises JobError: An option that would have given other numbers, see `refuse_other_options`.
    """
    manifest = ResultFolder(folder).earlier()
    if manifest is None or not manifest.get("complete") or not same_inputs(job, manifest):
        return None
    if not all(is_made(folder / name, manifest["files"]) for name in manifest.get("outputs", ())):
        return None
    options, accuracy = manifest.get("options", {}), job.keys.accuracy
    own = {name: getattr(accuracy, name) for name in ("chord_mm", "width", "width_mm3")}
    after = {**options, **own, **(wanted or {})}
    refuse_other_options(options, after, folder, ended=True)
    if _in_addition(options, after):
        return None
    try:
        summary: dict[str, Any] = parse_json((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return summary


def _in_addition(before: Mapping[str, Any], after: Mapping[str, Any]) -> bool:
    """Whether options ask for something that is not there."""
    brep = after.get("brep", "none")
    longer = after.get("brep_seconds", 0.0) > before.get("brep_seconds", 0.0)
    if brep != "none" and (brep != before.get("brep") or longer) and before.get("brep") != "all":
        return True
    if CONTACTS.index(after.get("contact", "all")) > CONTACTS.index(before.get("contact", "all")):
        return True
    if after.get("csv") and not before.get("csv"):
        return True
    if set(after.get("stages", ())) - set(before.get("stages", after.get("stages", ()))):
        return True
    return any(set(after.get(name, ())) - set(before.get(name, ())) for name in ("stock", "stock_at"))


def keep_stages(place: ResultFolder, source: Path) -> None:
    """Put rows and checkpoints of all passes in `source` into `stages.zip`, for `_reopen`; or the one that was made there."""
    points, packed = place.manifest.get("checkpoints", {}), source / STAGES
    if not points and source == place.path:
        return
    if not points:
        place.manifest["files"].pop(STAGES, None)  # of another result
        if packed.is_file():
            with place.making(STAGES), atomic_path(place.path / STAGES) as temporary:
                shutil.copyfile(packed, temporary)
        return
    names = [*(entry["file"] for entry in points.values()), *WORKING]
    place.manifest["stages"] = points
    target = place.path / STAGES
    with place.making(STAGES), atomic_path(target) as temporary, ZipFile(temporary, "w") as archive:
        for name in names:
            if (source / name).is_file():
                packs = not name.endswith(".npz")  # checkpoints are packed where it pays
                archive.write(source / name, name, ZIP_DEFLATED if packs else ZIP_STORED, 1)


def _reopen(place: ResultFolder, manifest: Mapping[str, Any]) -> None:
    """Unpack `stages.zip` of a complete result; its manifest says from here on that the directory is not complete.

    Raises JobError: The archive is damaged, or holds something else.
    """
    archive = place.path / STAGES
    place.tidy()
    place.manifest = {**manifest, "complete": False, "process": os.getpid(), "files": {**manifest["files"]}}
    try:
        with ZipFile(archive) as packed:
            names = packed.namelist()
            if strange := [name for name in names if name not in WORKING and not PATTERN.fullmatch(name)]:
                what = f"holds {strange[0]!r}, which no run writes"
                raise JobError(what, file=archive, remedy="run again without --resume")
            with place.making(*names):
                for name in names:
                    with (
                        atomic_path(place.path / name) as target,
                        packed.open(name) as source,
                        target.open("wb") as sink,
                    ):
                        shutil.copyfileobj(source, sink)
    except (BadZipFile, EOFError) as exc:
        raise JobError(f"is damaged ({exc})", file=archive, remedy="run again without --resume") from exc


def together(earlier: Mapping[str, Any] | None, name: str, asked: Iterable[Any]) -> tuple[Any, ...]:
    """An option of a result that was complete before and what is asked in addition, each value once."""
    before = earlier.get(name, ()) if earlier else ()
    return tuple(dict.fromkeys((*before, *asked)))
