"""What a run is asked for, and what its stages hand to each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from vmachining.errors import InputError
from vmachining.job.contact import ToolParts
from vmachining.job.jobfile import Job
from vmachining.job.parts import Part, Parts
from vmachining.job.schedule import ScheduleReport
from vmachining.job.store import CONTACTS, PARTS
from vmachining.job.summary import NO_BREP
from vmachining.job.timing import MoveTimes
from vmachining.job.toolpath import Toolpath
from vmachining.job.verified import Written
from vmachining.stock import Stock
from vmachining.tolerance import BREP_SECONDS

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """What is asked for beside the job, see `run`. part : of the run, that alone is made."""

    engine: str | None = None
    chord: float | None = None
    resume: bool = False
    workers: int | None = None
    brep: str = "none"
    brep_seconds: float = BREP_SECONDS
    every_strategy: bool = False
    contact: str = "all"
    stages: Sequence[str] = PARTS
    command: Sequence[str] | None = None
    force: bool = False
    part: Part | None = None
    parts: Parts | None = None
    csv: bool = False

    def of(self, job: Job) -> dict[str, Any]:
        """The options of the manifest, with those of the job that change numbers; workers join them when something is cut.

        Raises InputError: See `asked_stages`; a limit that is not above 0.
        """
        if not self.brep_seconds > 0.0:
            raise InputError(
                f"brep_seconds {self.brep_seconds:g} is not a limit", remedy="give seconds above 0"
            )
        accuracy = job.keys.accuracy
        names = ("chord_mm", "width", "width_mm3", "spacing_mm", "directions")
        found = {name: getattr(accuracy, name) for name in names} | {
            "engine": self.engine, "brep": self.brep, "brep_seconds": self.brep_seconds, "contact": self.contact,
            "stages": asked_stages(self.stages, self.contact, job),
        }  # fmt: skip
        part = None if self.part is None else str(self.part)
        rare = {"every_strategy": self.every_strategy, "csv": self.csv, "part": part}
        return found | {name: value for name, value in rare.items() if value}


def refuse_contact(contact: str, option: str = "--contact") -> None:
    """Refuse a word that names no choice of blocks with contact. option : what it was given by."""
    if contact not in CONTACTS:
        raise InputError(f"{option} {contact!r} is not understood", remedy=f"give {' | '.join(CONTACTS)}")


def asked_stages(stages: Sequence[str], contact: str, job: Job) -> list[str]:
    """What is to be done, in its order; stages are given as words, or as one text with commas.

    Raises InputError: An unknown word; a schedule without the contact of all blocks.
    """
    if isinstance(stages, str):
        stages = stages.split(",")
    if unknown := [name for name in stages if name not in PARTS]:
        raise InputError(f"unknown stage {unknown[0]!r}", remedy=f"take some of {', '.join(PARTS)}")
    refuse_contact(contact)
    chosen = [name for name in PARTS if name == "cut" or name in stages]
    if job.keys.feed is not None and "plan" in chosen and ("contact" not in chosen or contact != "all"):
        remedy = "omit --contact and --stages, or omit the plan as well: --stages cut,judge,show"
        raise InputError(
            "[feed] in the job needs the contact of all blocks", **job.where("feed"), remedy=remedy
        )
    return chosen


class Given(NamedTuple):
    """What is read before anything is cut: tools by number, the program with its times, the raw stock."""

    tools: Mapping[int, ToolParts]
    toolpath: Toolpath
    times: MoveTimes
    stock: Stock

    def written(self, program: Written) -> Given:
        """The same with a rewritten program."""
        return self._replace(toolpath=program.toolpath, times=program.times)


class Planning(NamedTuple):
    """scheduled : columns of the schedule, see `finish`. report : of it. times : of the rewritten program."""

    scheduled: pl.DataFrame | None = None
    report: ScheduleReport | None = None
    times: MoveTimes | None = None


class Opinion(NamedTuple):
    """rows : columns of other engines, see `finish`. brep : counts of its verdicts. second : what exact rays said."""

    rows: pl.DataFrame | None = None
    brep: Mapping[str, Any] = NO_BREP
    second: dict[str, Any] | None = None
