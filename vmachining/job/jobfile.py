"""Reading a job file: every refusal names file, line and key, and the nearest key for a misspelt one."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from vmachining.errors import JobError, KinematicsError, ToolError
from vmachining.htmltable import facts_html
from vmachining.job.mill import Mill
from vmachining.job.model import TOOL_KEYS, JobFile, ProgramKeys, Stock
from vmachining.job.words import Refuse, first_refusal
from vmachining.machine import Machine
from vmachining.stock import BoxStock, CylinderStock
from vmachining.textfile import parse_toml, read_text
from vmachining.tomlplaces import KeyPath, dotted, key_positions, nearest, position_of, toml_refusal
from vmachining.tool import Cutter, Tool, mapping_of_tool, tool_from_mapping

MM_PER_INCH = 25.4
MOST = 1e9
"""Above every length, speed and acceleration in mm and minutes: a thousand kilometres, as for programs."""


FILES = (
    ("program", "file"), ("machine", "file"), ("stock", "stl"), ("stock", "step"), ("design", "stl"), ("design", "step"),
)  # fmt: skip
"""Keys that name a file that must exist, relative to the job file; a machine file is read at once."""


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Job:
    """A checked job: what to simulate, with which tools, in which stock.

        job = vm.Job.load("models/slot/job.toml")
        job = vm.Job(program="part.nc", tools=[vm.BallNose(diameter=6, length=40)],
                     stock=vm.Box((0, 0, -20), (100, 60, 0)), feed=vm.Feed(strategy="volume"))
        job.replace(accuracy={"width": 0.003}).save("part.toml")

    keys : the file as data, in its own units; `scale` turns its unit-less lengths into mm.
    tools : by number, lengths in mm.
    folder : relative file names start here.
    machine : the kinematic chain; None: three slides.
    source : the job file, or None for a job made in Python.
    """

    keys: JobFile
    tools: dict[int, Tool]
    folder: Path
    machine: Machine | None
    source: Path | None
    positions: dict[KeyPath, tuple[int, int]]

    def __init__(
        self,
        *,
        program: Path | str | Mapping[str, Any] | ProgramKeys,
        tools: Iterable[Cutter | Mapping[str, Any]] | Mapping[int, Cutter],
        stock: Path | str | Mapping[str, Any] | Stock | BoxStock | CylinderStock,
        folder: Path | str = ".",
        **tables: Any,
    ) -> None:
        """A job of Python values.

        Parameters
        ----------
        program : the NC file, or the table `[program]`.
        tools : cutters, numbered from 1 as they come, or by number; or tables as under `[[tools]]`. Lengths in mm.
        stock : a box, a cylinder, a STEP or STL file, or the table `[stock]`.
        folder : relative file names start here.
        tables : `name`, `units`, and the other tables of a job file: `machine`, `design`, `vectors`, `accuracy`, `feed`,
            `force`, each a mapping or a value such as `vm.Feed(...)`.

        Raises
        ------
        JobError
            As `load`.
        """
        given = {"program": program, "tools": tools, "stock": stock, **tables}
        made = self.from_mapping({key: _table(key, value) for key, value in given.items()}, folder)
        for name in self.__slots__:
            object.__setattr__(self, name, getattr(made, name))

    def replace(self, **tables: Any) -> Job:
        """The same job with other tables; keys that a mapping leaves out stay as they are.

        tables : as the constructor takes them; None takes a table out. Raises JobError like `load`.
        """
        data = self.keys.model_dump(exclude_unset=True)
        for key, value in tables.items():
            new = None if value is None else _table(key, value)
            old = data.get(key)
            if key != "stock" and isinstance(old, dict) and isinstance(new, dict):
                new = old | new
            data[key] = new
        return self.from_mapping(
            {key: value for key, value in data.items() if value is not None}, self.folder
        )

    def save(self, path: Path | str) -> None:
        """Write the job as a separate file; file names in it are made relative to that file."""
        import tomli_w

        path = Path(path)
        data = self.keys.model_dump(exclude_unset=True, exclude_none=True)
        for table, key in FILES:
            if data.get(table, {}).get(key) is not None:
                data[table][key] = os.path.relpath(self.folder / data[table][key], path.parent)
        if "subroutines" in data["program"]:
            folders = data["program"]["subroutines"]
            data["program"]["subroutines"] = [
                os.path.relpath(self.folder / name, path.parent) for name in folders
            ]
        if self.keys.force is not None and "coefficients" in self.inputs:
            data["force"]["coefficients"] = os.path.relpath(self.inputs["coefficients"], path.parent)
        path.write_text(tomli_w.dumps(data), encoding="utf-8")

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
            data = parse_toml(text)
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
        """The same job with another [accuracy] chord_mm. Raises JobError where that is not a length."""
        if not 0.0 < chord_mm <= MOST:
            raise JobError(f"chord {chord_mm:g} mm: a length above zero is expected")
        return self._accurate(chord_mm=float(chord_mm))

    def with_width(self, width: float | str) -> Job:
        """The same job with another [accuracy] width: 0.01 or "1%". Raises JobError where that is not a share."""
        text = str(width)
        try:
            share = float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
        except ValueError:
            share = math.nan
        if not 0.0 < share <= 1.0:
            raise JobError(f"width {text!r}: a share such as 1% or 0.01 is expected")
        return self._accurate(width=share)

    def with_spacing(self, spacing_mm: float | None, directions: int | None = None) -> Job:
        """The same job with other rays of the dexel engine. Raises JobError where they cannot be."""
        given: dict[str, Any] = {}
        if spacing_mm is not None:
            if not 0.0 < spacing_mm <= MOST:
                raise JobError(f"spacing {spacing_mm:g} mm: a length above zero is expected")
            given["spacing_mm"] = float(spacing_mm)
        if directions is not None:
            if directions not in (1, 3):
                raise JobError(f"{directions} directions of rays: 1 (along z) or 3 are expected")
            given["directions"] = directions
        return self._accurate(**given)

    def _accurate(self, **given: Any) -> Job:
        job = copy(self)
        accuracy = self.keys.accuracy.model_copy(update=given)
        object.__setattr__(job, "keys", self.keys.model_copy(update={"accuracy": accuracy}))
        return job

    @classmethod
    def _checked(
        cls,
        data: dict[str, Any],
        folder: Path,
        source: Path | None,
        positions: dict[KeyPath, tuple[int, int]],
    ) -> Job:
        def refuse(message: str, path: KeyPath, remedy: str | None = None) -> JobError:
            line, col = position_of(path, positions) or (None, None)
            return JobError(message, file=source, line=line, col=col, remedy=remedy)

        _refuse_huge(data, (), refuse)
        try:
            keys = JobFile.model_validate(data)
        except ValidationError as exc:
            raise first_refusal(exc, refuse) from exc
        tools = _tools(keys, refuse)
        job = object.__new__(cls)
        keys, chain = _machine(keys, folder, refuse)
        values = (keys, tools, folder, chain, source, positions)
        for slot, value in zip(cls.__slots__, values, strict=True):
            object.__setattr__(job, slot, value)
        for path in FILES:
            name = getattr(getattr(keys, path[0]), path[1], None)
            if name is not None and not (folder / name).is_file():
                what = "is a directory" if (folder / name).is_dir() else "no such file"
                what = f"{path[1]} = {name!r}: {what} in {folder.resolve()}"
                raise refuse(what, path, "file names are relative to the job file")
        return job

    def __repr__(self) -> str:
        (_, program), (_, tools), (_, stock) = self._facts()
        return f"Job({self.name!r}, program {program!r}, tools {{{tools}}}, stock {stock})"

    def _repr_html_(self) -> str:
        return facts_html(f"Job {self.name}", self._facts())

    def _facts(self) -> list[tuple[str, str]]:
        tools = ", ".join(f"{number}: {tool.name}" for number, tool in self.tools.items())
        kinds = ("box", "cylinder", "step", "stl")
        stock = next(key for key in kinds if getattr(self.keys.stock, key) is not None)
        return [("program", str(self.keys.program.file)), ("tools", tools), ("stock", stock)]

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
        """The STL or STEP file of the part as designed."""
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
    def work_offsets(self) -> dict[str, tuple[float, float, float]]:
        """Machine coordinates of the zeros, mm, by name."""
        scale, given = self.scale, self.keys.program.work_offsets
        return {name.upper(): (scale * x, scale * y, scale * z) for name, (x, y, z) in given.items()}

    @property
    def home(self) -> tuple[float, float, float]:
        """mm, start position in work coordinates."""
        x, y, z = (self.scale * v for v in self.keys.program.home)
        return x, y, z

    def where(self, *path: str | int) -> dict[str, Any]:
        """file, line, col keywords of an error about one key."""
        line, col = position_of(path, self.positions) or (None, None)
        return {"file": self.source, "line": line, "col": col}


def _table(key: str, value: Any) -> Any:
    """The value of a key of the job file from what the constructor of `Job` takes for it."""
    if isinstance(value, BaseModel):
        return value.model_dump(exclude_unset=True)
    if key == "tools":
        pairs = value.items() if isinstance(value, Mapping) else enumerate(value, 1)
        return [
            mapping_of_tool(one, n) if isinstance(one, Cutter) else {"number": n, **one} for n, one in pairs
        ]
    if isinstance(value, BoxStock):
        return {"box": dict(zip(("min", "max"), value.bounds.tolist(), strict=True))}
    if isinstance(value, CylinderStock):
        return {"cylinder": {"center": list(value.center), "radius": value.radius, "z": list(value.z)}}
    if isinstance(value, str | Path) and key in ("program", "stock", "design", "machine"):
        suffix = "stl" if Path(value).suffix.lower() == ".stl" else "step"
        return {"file" if key in ("program", "machine") else suffix: str(value)}
    return dict(value) if isinstance(value, Mapping) else value


def _refuse_huge(value: Any, path: KeyPath, refuse: Refuse) -> None:
    """Numbers that no job means, such as 1e99: a slip of the pen that would be computed with for hours."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            _refuse_huge(inner, (*path, str(key)), refuse)
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            _refuse_huge(inner, (*path, index), refuse)
    elif isinstance(value, int | float) and not isinstance(value, bool) and MOST < abs(value) < math.inf:
        what = f"{dotted(path)} = {value:g} is out of range"
        raise refuse(what, path, f"numbers of a job lie within {MOST:g}")


def _machine(keys: JobFile, folder: Path, refuse: Refuse) -> tuple[JobFile, Machine | None]:
    """The keys with those of the machine file filled in, and the kinematic chain; None: three slides."""
    own = keys.machine
    try:
        mill = Mill.of(own, folder)
    except KinematicsError as exc:
        if exc.line is not None:  # a line of the machine file says more than the key that names the file
            raise
        key = "file" if own.file is not None else "options" if "option" in exc.message else "chain"
        raise refuse(f"{key}: {exc.message}", ("machine", key), exc.remedy) from exc
    return keys.model_copy(update={"machine": mill.keys}), mill.chain


def _tools(keys: JobFile, refuse: Refuse) -> dict[int, Tool]:
    scale = MM_PER_INCH if keys.units == "inch" else 1.0
    tools: dict[int, Tool] = {}
    for index, mapping in enumerate(keys.tools):
        path: KeyPath = ("tools", index)
        if odd := [key for key in mapping if key not in TOOL_KEYS]:
            close = nearest(odd[0], TOOL_KEYS)
            meant = f"did you mean {close!r}?" if close else None
            raise refuse(f"unknown key {odd[0]!r} under [[tools]]", (*path, odd[0]), meant)
        number = mapping.get("number")
        if isinstance(number, bool) or not isinstance(number, int) or number < 1:
            shown = f" = {number!r}" if "number" in mapping else " is missing"
            what = f"number{shown}: every tool needs a whole number from 1"
            raise refuse(what, (*path, "number"), "add number = 1, as in the program's T1")
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

    def scaled(value: Any) -> Any:  # what is not a number is left for the tool room to refuse
        if isinstance(value, list):
            return [scaled(v) for v in value]
        return scale * value if isinstance(value, int | float) and not isinstance(value, bool) else value

    if scale != 1.0:
        if isinstance(out.get("apt"), Mapping):
            out["apt"] = {k: v if k.endswith("_deg") else scaled(v) for k, v in out["apt"].items()}
        if isinstance(out.get("profile"), list):
            out["profile"] = scaled(out["profile"])
    return out
