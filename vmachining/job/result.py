"""What a run gives back, and how it is laid down in a directory."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Literal

from vmachining.disk import Scratch
from vmachining.engagement import Engagement
from vmachining.engagement.along import Sweeps
from vmachining.engines.protocol import Engine, StockSurface
from vmachining.errors import EngineError
from vmachining.htmltable import facts_html, table_html
from vmachining.interval import Interval
from vmachining.job.brep import JUDGED, blank, refuse_beyond, write_step
from vmachining.job.engage import EdgeKind, Method, Scene, engage
from vmachining.job.files import STAGES, TABLES, between, make_folder, read_table, write_json
from vmachining.job.folder import FolderLock, ResultFolder, now
from vmachining.job.jobfile import Job
from vmachining.job.record import Spent, in_words, refuse_other_job
from vmachining.job.schedule import ScheduleReport
from vmachining.job.stock import write_stock
from vmachining.job.store import keep_stages, together
from vmachining.job.toolpath import Toolpath
from vmachining.memory import give_back
from vmachining.nc import Program
from vmachining.stock import Triangles

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

Kind = Literal["load", "bracket", "feed", "engagement", "stock"]
"""Of figures over the program."""

HEAD = (
    "block", "line", "text", "tool", "motion", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "proven", "time_s",
    "warning",
)  # fmt: skip
ROWS, SHOWN = 5, 5
"""Of the table in a notebook, and warnings among the facts."""

DEVIATION_PAGE = "vmachining.report.deviation:write_deviation"
PAGE = "vmachining.report:write_report"
"""Who writes report.html. The report room sits above this one, so it is named here and not imported: a result
must be able to write all of its files, and the arrows between rooms still point down."""


@dataclass(slots=True, eq=False)
class RunResult:
    """A finished simulation.

    job, toolpath : what ran; program : as it was read. summary : the keys of summary.json. inputs : {role: {file, sha256}}.
    stock : the engine with the finished workpiece; `stock.volume`, `stock.surface()`.
    schedule : what the rewritten program does, None without [feed].
    folder : where the tables lie. place : the same with its manifest. lock : of that directory, held or not.
    """

    job: Job
    toolpath: Toolpath
    summary: dict[str, Any]
    inputs: dict[str, dict[str, str]]
    stock: Engine
    schedule: ScheduleReport | None
    folder: Path
    place: ResultFolder
    lock: FolderLock
    findings: list[tuple[int, str, str]] = field(default_factory=list)
    """(line, text, message) of program warnings on lines that do not move."""
    spent: Spent = field(default_factory=Spent)
    earlier: Mapping[str, Any] | None = None
    """Options of the complete result that this one adds to."""
    _keep: Scratch | None = field(default=None, repr=False)
    _surface: StockSurface | None = field(default=None, repr=False)
    _scene: Scene | None = field(default=None, repr=False)
    sweeps: Sweeps | None = field(default=None, repr=False)
    """All motions as contact has laid them out, for the maps of the page; None: they are laid out again."""

    def __repr__(self) -> str:
        s = self.summary
        return (
            f"RunResult({self.job.name!r}, {s['blocks']} blocks, {s['removed_mm3']:.6g} mm3 removed, "
            f"between {s['removed_lo_mm3']:.6g} and {s['removed_hi_mm3']:.6g}, {s['warnings']} warnings)"
        )

    def _repr_html_(self) -> str:
        """Sums of a run, and the head of its table."""
        count = self.summary["blocks"]
        rows = self.blocks.select(HEAD).head(ROWS).rows()
        more = f"<p>and {count - len(rows)} more: <code>.blocks</code></p>" if count > len(rows) else ""
        return facts_html(f"{self.job.name}: {count} blocks", self.facts) + table_html(HEAD, rows) + more

    def account(self) -> None:
        """Put into the summary what the run has cost up to now."""
        self.summary |= self.spent.summary()

    @property
    def removed(self) -> Interval:
        """Removed volume of all blocks, mm^3; stated where it is not proven."""
        s = self.summary
        return Interval(s["removed_lo_mm3"], s["removed_mm3"], s["removed_hi_mm3"], s["proven"])

    @property
    def program(self) -> Program:
        """The program that ran."""
        return self.toolpath.program

    @property
    def manifest(self) -> dict[str, Any]:
        """What made the numbers: inputs, options, versions, times."""
        return self.place.manifest

    @property
    def blocks(self) -> pl.DataFrame:
        """One row per NC block that moves; see `COLUMNS`."""
        return read_table(self.folder / "blocks.parquet")

    @property
    def scheduled_blocks(self) -> pl.DataFrame | None:
        """The same of the rewritten program, None without [feed]."""
        return read_table(self.folder / "scheduled_blocks.parquet") if self.schedule is not None else None

    @property
    def surface(self) -> StockSurface:
        """Triangles of the finished workpiece with the block that cut each; made once, for files, report and picture."""
        if self._surface is None:
            give_back()
            self._surface = self.stock.surface()
            give_back()
        return self._surface

    @property
    def facts(self) -> list[tuple[str, str]]:
        """What came out, in words with units, the first warnings among it."""
        s = self.summary
        stated = f" ({s['stated_blocks']} of {s['blocks']} blocks are stated)" if s["stated_blocks"] else ""
        sure = f"{'proven' if s['proven'] else 'stated, not proven'}{stated}"
        after = f" -> {s['scheduled_time_s']:.2f} s scheduled" if s["scheduled_time_s"] is not None else ""
        out = [
            ("removed", f"{s['removed_mm3']:.6g} mm3   +-{self.removed.error:.2g}"),
            ("between", f"{s['removed_lo_mm3']:.6g} and {s['removed_hi_mm3']:.6g} mm3, {sure}"),
            ("time", f"{s['time_s']:.2f} s{after}"),
            ("took", f"{in_words(s['stage_seconds'])}; at most {s['peak_mb']:.0f} MB"),
            ("warnings", f"{s['warnings']}"),
        ]
        warned = (
            self.blocks.filter(self.blocks["warning"].is_not_null()).select("line", "warning").head(SHOWN)
        )
        first = sorted([*warned.iter_rows(), *((line, text) for line, _, text in self.findings)])[:SHOWN]
        out += [("", f"line {line}: {text}") for line, text in first]
        if (left := s["warnings"] - len(first)) > 0:
            out.append(("", f"and {left} more in blocks.parquet and report.html"))
        if machine := s.get("machine"):
            out.append(("machine", f"{machine['name']}: {', '.join(machine['rotary'])}"))
        if asked := s["brep"]["asked"]:
            said = ", ".join(f"{s['brep'][word]} {word}" for word in JUDGED)
            out.append(("B-rep", f"{asked} blocks asked: {said}"))
        for name, volume in s.get("stock_files_mm3", {}).items():
            if abs(volume - s["final_mm3"]) > 1e-6 * s["final_mm3"]:
                off, rounding = volume - s["final_mm3"], volume - s["stock_mesh_mm3"]
                words = f"{name} differs from the estimate by {off:+.2g} mm3, {rounding:+.2g} of it"
                out.append(("stock", f"{words} from rounding of its coordinates"))
        out += [("stock", s["stock_step_refused"])] if "stock_step_refused" in s else []
        if s["guesses"]:
            out.append(
                ("guesses", f"{len(s['guesses'])} lines of the job are guesses: report.html lists them")
            )
        out += [("note", text) for text in s["notes"]]
        out += [("contact", text) for text in s.get("contact_notes", ())]
        return out + ([("table", s["table_note"])] if "table_note" in s else [])

    def contact(
        self,
        block: int,
        at: float = 0.5,
        *,
        method: Method = "dexel",
        angles: int = 360,
        edge: EdgeKind = "straight",
    ) -> Engagement:
        """What the cutting edge touches at a fraction of a block; see `engage`, which has all options."""
        if self._scene is None:
            self._scene = Scene.of(self.job)
        return engage(self._scene, block, at=at, method=method, angles=angles, edge=edge)

    def plot(self, kind: Kind = "load", *, over: Literal["time", "block"] | None = None) -> Figure:
        """A figure over the program, as a matplotlib figure; a notebook shows it.

        Parameters
        ----------
        kind : "load", "bracket", "feed", "engagement" or "stock". over : "time" or "block", along the x axis.

        Raises
        ------
        InputError
            Unknown kind, or the run has not what it shows.
        """
        return resolve_name("vmachining.report.paper:draw_result")(self, kind, over=over)  # type: ignore[no-any-return]

    def write(
        self,
        folder: Path | str,
        *,
        stock: Iterable[str] = ("stl",),
        stock_at: Iterable[int] = (),
        report: bool = True,
        force: bool = False,
    ) -> Path:
        """Put all result files into `folder`, each whole or not at all; the manifest goes last.

        Parameters
        ----------
        stock : formats of the finished workpiece, "stl", "3mf", "glb" and "step". A STEP that the B-rep engine refuses
            is not written; `summary["stock_step_refused"]` then says why.
        stock_at : blocks after each of which the workpiece is written, too: stock_7.step after block 7.
        report : whether to write report.html. force : the result of another job in `folder` is replaced.

        Raises
        ------
        InputError
            `folder` holds files of somebody else, or the result of another job.
        """
        folder = Path(folder)
        formats = together(self.earlier, "stock", stock)
        stock_at = together(self.earlier, "stock_at", stock_at)
        steps: dict[str, int | None] = {between(block): block for block in sorted(set(stock_at))}
        if "step" in formats:
            steps["stock.step"] = None
        if steps:  # refused before anything is written
            blank(self.job)
            asked = tuple(range(block, block + 1) for block in steps.values() if block is not None)
            refuse_beyond(asked, int(self.summary["blocks"]) - 1, "stock_at")
        make_folder(folder)
        same = folder.resolve() == self.folder.resolve()
        place = self.place if same else ResultFolder(folder)
        if not same and not force and (old := place.earlier()) is not None:
            refuse_other_job(old, self.manifest, folder)
        with FolderLock(folder) as own:
            if not (same and self.lock.is_held):
                own.acquire()
            with self.spent.on("files"):
                self._lay_down(place, formats, steps, report)
        return folder

    def _lay_down(
        self, place: ResultFolder, formats: tuple[str, ...], steps: dict[str, int | None], report: bool
    ) -> None:
        """See `write`."""
        folder, here = place.path, place is self.place
        meshes = [f"stock.{suffix}" for suffix in formats if suffix != "step"]
        tables = [name for name in TABLES if (self.folder / name).is_file()]
        wanted = [*meshes, *steps, "summary.json", *(["report.html"] * report)]
        if report and "deviation" in self.summary:
            wanted.append("deviation.html")
        place.refuse_foreign({role: Path(entry["file"]) for role, entry in self.inputs.items()})
        if not here:
            place.tidy()
            place.manifest = {**self.manifest, "files": place.made()}
        place.manifest |= {"complete": False, "process": os.getpid()}
        with place.making(*wanted, *([] if here else tables)):
            if not here:
                for name in tables:
                    shutil.copyfile(self.folder / name, folder / name)
            held: dict[str, float] = {}
            if meshes:
                vertices, triangles, owner = self.surface
                self.summary["stock_mesh_mm3"] = Triangles(vertices, triangles).volume
            for name in meshes:
                held[name] = write_stock(Triangles(vertices, triangles), folder / name, owner)
            if held:
                self.summary["stock_files_mm3"] = held
            refused = []
            for name, block in steps.items():
                try:
                    write_step(self, folder / name, block)
                except EngineError as exc:  # every other file is right without it
                    refused.append(exc.message)
            if refused:
                self.summary["stock_step_refused"] = "; ".join(refused)
            if report:
                resolve_name(PAGE)(self, folder / "report.html")
            if "deviation.html" in wanted:
                resolve_name(DEVIATION_PAGE)(self, folder / "deviation.html")
            self.account()  # the report takes time and memory, too
            write_json(folder / "summary.json", self.summary)
        outputs = [name for name in (*tables, *wanted) if (folder / name).is_file()]
        keep_stages(place, self.folder)
        made = [*outputs, *(name for name in (STAGES,) if name in place.manifest["files"])]
        after = [block for block in steps.values() if block is not None]
        options = {**place.manifest["options"], "stock": list(formats), "stock_at": after}
        place.forget(keep=made)  # what an earlier run had more, rows and checkpoints of this one
        place.manifest |= {
            "complete": True, "ended": now(), "options": options, "checkpoints": {}, "outputs": outputs,
            "files": {name: place.manifest["files"][name] for name in made},
        }  # fmt: skip
        place.save()
