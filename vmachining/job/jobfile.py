"""Reading a job file: every refusal names file, line and key, and the nearest key for a misspelt one."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from vmachining.errors import JobError, KinematicsError, ToolError
from vmachining.job.keys import dotted, key_positions, nearest, position_of, toml_refusal
from vmachining.job.model import TOOL_KEYS, JobFile
from vmachining.job.model import Machine as MachineKeys
from vmachining.job.words import Refuse, first_refusal
from vmachining.machine import Machine, load
from vmachining.textfile import read_text
from vmachining.tool import Tool, tool_from_mapping

__all__ = ["MM_PER_INCH", "Job", "read_tools"]

MM_PER_INCH = 25.4
MOST = 1e9
"""Above every length, speed and acceleration in mm and minutes: a thousand kilometres, as for programs."""


@dataclass(frozen=True, slots=True, eq=False)
class Job:
    """A checked job: what to simulate, with which tools, in which stock.

    keys : the file as data, in its own units; `scale` turns its unit-less lengths into mm.
    tools : by number, lengths in mm.
    folder : relative file names start here.
    machine : the kinematic chain; None: three slides.
    source : the job file, or None for a job made in Python.
    """

    keys: JobFile
    tools: dict[int, Tool]
    folder: Path
    machine: Machine | None = None
    source: Path | None = None
    positions: dict[tuple[str | int, ...], tuple[int, int]] = field(default_factory=dict, repr=False)

    @classmethod
    def load(cls, path: Path | str) -> Job:
        """The job in a TOML file.

        Raises
        ------
        JobError
            The file is missing, unreadable, not TOML, has an unknown key, a value out of range, a
            contradiction, or names a file that does not exist. The message starts with file:line:column.
        """
        path = Path(path)
        text = read_text(path, "job file", JobError, wrong="a job file is TOML text")
        try:
            data = tomllib.loads(text)
        except tomllib.TOMLDecodeError as exc:
            raise toml_refusal(text, exc, str(path)) from exc
        return cls._checked(data, path.parent, path, key_positions(text))

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], folder: Path | str = ".") -> Job:
        """The job in a mapping with the keys of a job file. Raises JobError like `load`."""
        return cls._checked(dict(data), Path(folder), None, {})

    @classmethod
    def of(cls, job: Job | Path | str) -> Job:
        """A job, or the one in a file."""
        return job if isinstance(job, Job) else cls.load(job)

    def with_chord(self, chord_mm: float) -> Job:
        """The same job with another [accuracy] chord_mm. Raises JobError where that is no length."""
        if not (math.isfinite(chord_mm) and 0.0 < chord_mm <= MOST):
            raise JobError(f"chord {chord_mm:g} mm: a length above zero is wanted")
        accuracy = self.keys.accuracy.model_copy(update={"chord_mm": float(chord_mm)})
        return replace(self, keys=self.keys.model_copy(update={"accuracy": accuracy}))

    def with_width(self, text: str) -> Job:
        """The same job with another [accuracy] width, "1%" or "0.01". Raises JobError where that is no share."""
        try:
            width = float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
        except ValueError:
            width = math.nan
        if not 0.0 < width <= 1.0:
            raise JobError(f"width {text!r}: a share such as 1% or 0.01 is wanted")
        accuracy = self.keys.accuracy.model_copy(update={"width": width})
        return replace(self, keys=self.keys.model_copy(update={"accuracy": accuracy}))

    def with_spacing(self, spacing_mm: float | None, directions: int | None = None) -> Job:
        """The same job with other rays of the dexel engine. Raises JobError where they cannot be."""
        given: dict[str, Any] = {}
        if spacing_mm is not None:
            if not (math.isfinite(spacing_mm) and 0.0 < spacing_mm <= MOST):
                raise JobError(f"spacing {spacing_mm:g} mm: a length above zero is wanted")
            given["spacing_mm"] = float(spacing_mm)
        if directions is not None:
            if directions not in (1, 3):
                raise JobError(f"{directions} directions of rays: 1 (along z) or 3 are wanted")
            given["directions"] = directions
        accuracy = self.keys.accuracy.model_copy(update=given)
        return replace(self, keys=self.keys.model_copy(update={"accuracy": accuracy}))

    @classmethod
    def _checked(
        cls,
        data: dict[str, Any],
        folder: Path,
        source: Path | None,
        positions: dict[tuple[str | int, ...], tuple[int, int]],
    ) -> Job:
        def refuse(message: str, path: tuple[str | int, ...], remedy: str | None = None) -> JobError:
            line, col = position_of(path, positions) or (None, None)
            return JobError(message, file=str(source) if source else None, line=line, col=col, remedy=remedy)

        _refuse_huge(data, (), refuse)
        try:
            keys = JobFile.model_validate(data)
        except ValidationError as exc:
            raise first_refusal(exc, refuse) from exc
        tools = _tools(keys, refuse)
        job = cls(keys, tools, folder, _machine(keys.machine, folder, refuse), source, positions)
        for path, name in (
            (("program", "file"), keys.program.file),
            (("stock", "stl"), keys.stock.stl),
            (("stock", "step"), keys.stock.step),
            (("design", "stl"), keys.design.stl if keys.design else None),
            (("design", "step"), keys.design.step if keys.design else None),
        ):
            if name is not None and not (folder / name).is_file():
                what = "is a directory" if (folder / name).is_dir() else "no such file"
                raise refuse(
                    f"{path[1]} = {name!r}: {what} in {folder.resolve()}",
                    path,
                    "file names are relative to the job file",
                )
        return job

    def __repr__(self) -> str:
        tools = ", ".join(f"{number}: {tool.name}" for number, tool in self.tools.items())
        kind = next(
            key for key in ("box", "cylinder", "step", "stl") if getattr(self.keys.stock, key) is not None
        )
        return f"Job({self.name!r}, program {self.keys.program.file!r}, tools {{{tools}}}, stock {kind})"

    @property
    def name(self) -> str:
        """Used for the output directory and titles."""
        return self.keys.name

    @property
    def scale(self) -> float:
        """mm per unit of the lengths whose key names no unit."""
        return MM_PER_INCH if self.keys.units == "inch" else 1.0

    @property
    def program_path(self) -> Path:
        """The NC program."""
        return self.folder / self.keys.program.file

    @property
    def stock_path(self) -> Path | None:
        """The STL or STEP file, if the stock is one."""
        name = self.keys.stock.stl or self.keys.stock.step
        return self.folder / name if name else None

    @property
    def design_path(self) -> Path | None:
        """The STL or STEP file of the part that is wanted."""
        keys = self.keys.design
        return None if keys is None else self.folder / str(keys.stl or keys.step)

    @property
    def machine_path(self) -> Path | None:
        """The machine file, if there is one."""
        name = self.keys.machine.file
        return self.folder / name if name else None

    @property
    def inputs(self) -> dict[str, Path]:
        """{role: path} of every file that the job names; subprograms are known when the program has been read."""
        paths = {
            "job": self.source, "program": self.program_path, "machine": self.machine_path,
            "stock": self.stock_path, "design": self.design_path,
        }  # fmt: skip
        if self.keys.force is not None:  # the name of a shipped set, or a file
            file = self.folder / self.keys.force.coefficients
            paths["coefficients"] = file if file.is_file() else None
        return {role: path for role, path in paths.items() if path is not None}

    @property
    def home(self) -> tuple[float, float, float]:
        """mm, start position in work coordinates."""
        x, y, z = (self.scale * v for v in self.keys.program.home)
        return x, y, z

    def where(self, *path: str | int) -> dict[str, Any]:
        """file, line, col keywords of an error about one key."""
        line, col = position_of(path, self.positions) or (None, None)
        return {"file": str(self.source) if self.source else None, "line": line, "col": col}


def _refuse_huge(value: Any, path: tuple[str | int, ...], refuse: Refuse) -> None:
    """Numbers that no job means, such as 1e99: a slip of the pen that would be computed with for hours."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            _refuse_huge(inner, (*path, str(key)), refuse)
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            _refuse_huge(inner, (*path, index), refuse)
    elif isinstance(value, int | float) and not isinstance(value, bool) and MOST < abs(value) < math.inf:
        raise refuse(
            f"{dotted(path)} = {value:g} is out of range", path, f"numbers of a job lie within {MOST:g}"
        )


def _machine(keys: MachineKeys, folder: Path, refuse: Refuse) -> Machine | None:
    """The kinematic chain; None: three slides."""
    if keys.chain is not None and keys.file is not None:
        raise refuse("chain and file exclude each other", ("machine", "file"), "a file describes the chain")
    if keys.chain in (None, "xyz") and keys.file is None:
        return None
    try:
        return load(str(keys.chain)) if keys.file is None else load(folder / keys.file)
    except KinematicsError as exc:
        if exc.line is not None:  # a line of the machine file says more than the key that names the file
            raise
        key = "chain" if keys.file is None else "file"
        raise refuse(f"{key}: {exc.message}", ("machine", key), exc.remedy) from exc


def _tools(keys: JobFile, refuse: Refuse) -> dict[int, Tool]:
    scale = MM_PER_INCH if keys.units == "inch" else 1.0
    tools: dict[int, Tool] = {}
    for index, mapping in enumerate(keys.tools):
        path: tuple[str | int, ...] = ("tools", index)
        for key in mapping:
            if key not in TOOL_KEYS:
                close = nearest(key, TOOL_KEYS)
                raise refuse(
                    f"unknown key {key!r} under [[tools]]",
                    (*path, key),
                    f"did you mean {close!r}?" if close else None,
                )
        number = mapping.get("number")
        if isinstance(number, bool) or not isinstance(number, int) or number < 1:
            shown = f" = {number!r}" if "number" in mapping else " is missing"
            raise refuse(
                f"number{shown}: every tool wants a whole number from 1",
                (*path, "number"),
                "add number = 1, as in the program's T1",
            )
        if number in tools:
            raise refuse(f"tool {number} is given twice", (*path, "number"), "give each its own number")
        try:
            tools[number] = tool_from_mapping(_in_mm(mapping, scale))
        except ToolError as exc:
            word = exc.word or next((k for k in mapping if k in exc.message), None)
            place = (*path, word) if word in mapping else path
            message = exc.message.removeprefix(f"tool {number}: ")
            raise refuse(f"tool {number}: {message}", place, exc.remedy) from exc
    return tools


def _in_mm(mapping: Mapping[str, Any], scale: float) -> dict[str, Any]:
    """A tool's mapping with `apt` and `profile` in mm; keys that name mm are mm already."""
    out = dict(mapping)

    def scaled(value: Any) -> Any:  # what is no number is left for the tool room to refuse
        if isinstance(value, list):
            return [scaled(v) for v in value]
        return scale * value if isinstance(value, int | float) and not isinstance(value, bool) else value

    if scale != 1.0:
        if isinstance(out.get("apt"), Mapping):
            out["apt"] = {k: v if k.endswith("_deg") else scaled(v) for k, v in out["apt"].items()}
        if isinstance(out.get("profile"), list):
            out["profile"] = scaled(out["profile"])
    return out


def read_tools(path: Path | str) -> dict[int, Tool]:
    """Only the [[tools]] part of a TOML file, as `--tools` takes it.

    Raises
    ------
    JobError
        Unreadable, or a tool that cannot exist.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except OSError as exc:
        raise JobError(f"cannot read the tool table: {exc.strerror or exc}", file=str(path)) from exc
    except UnicodeDecodeError as exc:
        raise JobError(f"not a UTF-8 text (byte {exc.start})", file=str(path)) from exc
    except tomllib.TOMLDecodeError as exc:
        raise toml_refusal(text, exc, str(path)) from exc
    entries = data.get("tools")
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise JobError("no [[tools]] in this file", file=str(path))
    positions = key_positions(text)

    def refuse(message: str, where: tuple[str | int, ...], remedy: str | None = None) -> JobError:
        line, col = position_of(where, positions) or (None, None)
        return JobError(message, file=str(path), line=line, col=col, remedy=remedy)

    units = "inch" if data.get("units") == "inch" else "mm"
    keys = JobFile.model_construct(tools=entries, units=units)
    return _tools(keys, refuse)
