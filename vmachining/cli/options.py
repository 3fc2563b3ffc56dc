"""A command is a value: a dataclass whose fields are its words and options; options that several commands have."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from importlib import import_module
from inspect import Parameter, signature
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, dataclass_transform, get_args, get_origin, get_type_hints

import typer

from vmachining.errors import InputError

T = TypeVar("T")

MOST = 1e9
"""Largest number of an option; NaN is beyond every limit. Job files have the same (`job.jobfile.MOST`)."""


def examples(*lines: str) -> str:
    """The end of a help text: command lines, each on a line of its own however narrow the terminal."""
    head = "Examples:" if lines[1:] else "Example:"
    return "\b\n" + "\n".join([head, *(f"  vmachining {line}" for line in lines)])


@dataclass_transform(frozen_default=True, kw_only_default=True)
def command(app: typer.Typer, runs: str, *shown: str, name: str = "") -> Callable[[type[T]], type[T]]:
    """Hang a class into a tree as a command: a frozen dataclass whose docstring is the help and whose fields are the words.

    A field that is a dataclass gives its own fields. runs : "file:function" in this room, which takes the value; imported when
    the command runs. shown : lines of example. name : that of the function if not given.
    """
    file, _, function = runs.partition(":")

    def hang(bare: type[T]) -> type[T]:
        # nobody prints or compares these values, and code for that takes time at every start
        kind = dataclass(frozen=True, kw_only=True, repr=False, eq=False)(bare)

        def called(**words: Any) -> int:
            done: int = getattr(import_module(f"vmachining.cli.{file}"), function)(_made(kind, words))
            return done

        found = list(_words(kind))
        called.__doc__ = kind.__doc__
        called.__annotations__ = {one.name: one.annotation for one in found}
        called.__signature__ = signature(called).replace(parameters=found)  # type: ignore[attr-defined]
        app.command(name or function.rstrip("_"), epilog=examples(*shown))(called)
        return kind

    return hang


def _words(kind: Any) -> Iterator[Parameter]:
    """Parameters of all fields of a dataclass, and of the dataclasses in it."""
    types = get_type_hints(kind, include_extras=True)
    for one in fields(kind):
        hint = types[one.name]
        if is_dataclass(hint):
            yield from _words(hint)
            continue
        default = Parameter.empty if one.default is MISSING else one.default
        if "word" in one.metadata:
            word = one.metadata["word"]
            if get_origin(hint) is Literal:
                word.metavar = word.metavar or "|".join(get_args(hint))
            hint = Annotated[hint, word]
        yield Parameter(one.name, Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _made(kind: Any, words: dict[str, Any]) -> Any:
    """The value of a dataclass from the words of its fields."""
    types = get_type_hints(kind)
    names = (one.name for one in fields(kind))
    return kind(
        **{name: _made(types[name], words) if is_dataclass(types[name]) else words[name] for name in names}
    )


def option(metavar: str | None, help: str, check: Callable[[Any], Any] | None = None, **more: Any) -> Any:
    """An option that is called as its field is; `check` is a callback, `more` goes to typer."""
    return typer.Option(metavar=metavar, help=help, callback=check, **more)


def switch(name: str, help: str) -> Any:
    """A switch that is off unless it is given."""
    return typer.Option(name, help=help)


def argument(metavar: str, help: str) -> Any:
    """A word without a name."""
    return typer.Argument(metavar=metavar, help=help)


def opt(
    default: Any, metavar: str | None, help: str, check: Callable[[Any], Any] | None = None, **more: Any
) -> Any:
    """A field that is an `option`; default : `...` where it must be given. metavar : None: of a `Literal`, its words."""
    return _field(default, option(metavar, help, check, **more))


def flag(name: str, help: str) -> Any:
    """A field that is a `switch`."""
    return _field(False, switch(name, help))


def arg(metavar: str, help: str, default: Any = ...) -> Any:
    """A field that is an `argument`; default : `...` where it must be given."""
    return _field(default, argument(metavar, help))


def _field(default: Any, word: Any) -> Any:
    return field(default=MISSING if default is ... else default, metadata={"word": word})


def within(low: float, high: float) -> Callable[[Any], Any]:
    """Callback of an option: numbers from `low` to `high`."""

    def check(value: Any) -> Any:
        for one in value if isinstance(value, list | tuple) else [value]:
            if one is not None and not low <= one <= high:
                raise typer.BadParameter(f"{one:g}: give a number from {low:g} to {high:g}")
        return value

    return check


def above_zero(value: float | None) -> float | None:
    """Callback of an option: a number above 0, at most `MOST`."""
    if value is not None and not 0.0 < value <= MOST:
        raise typer.BadParameter(f"{value:g}: give a number above 0, at most {MOST:g}")
    return value


def three(text: str, name: str, what: str) -> tuple[float, float, float]:
    """Three finite numbers of an option.

    Raises InputError: Anything else.
    """
    try:
        x, y, z = (float(part) for part in text.split(","))
        if not all(map(isfinite, (x, y, z))):
            raise ValueError
    except ValueError:
        raise InputError(f"{name} {text}: three numbers are expected, {what}") from None
    return x, y, z


def belong(options: Any, names: tuple[str, ...], what: str) -> None:
    """Refuse options that are given although nothing would read them."""
    for item in fields(options):
        if item.name in names and getattr(options, item.name) != item.default:
            raise InputError(f"--{item.name.replace('_', '-')} {what}")


finite = within(-MOST, MOST)
"""Callback of an option: a number of any sign."""


Json = Annotated[bool, typer.Option("--json", help="Machine-readable output on stdout, and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no summary; errors only.")]
Scheduler = Annotated[str | None, option("ADDRESS", "Use the workers of this Dask scheduler instead.")]
Resume = Annotated[bool, switch("--resume", "Continue where an interrupted run stopped.")]
OfMachine = Annotated[
    str | None, option("NAME|FILE", "Preset, machine file or job; moves beyond its limits are findings.")
]
ProgramArg = Annotated[str, argument("PROGRAM", "NC program; - reads standard input.")]
JobArg = Annotated[Path, argument("JOB.toml", "Job file.")]
Out = Annotated[Path | None, option("DIR", "Result directory; default out/NAME.")]
Engine = Annotated[str | None, option("NAME", "Engine for a job; default as in run.")]
Csv = Annotated[bool, switch("--csv", "Write blocks.csv also above 100,000 blocks.")]
StockOut = Annotated[str, option("LIST", "Finished stock as stl, 3mf, glb, step (comma list).")]
LIBRARY = "Tool library: .tools, .json, .fctl, .fctb, .tbl, .t or .csv."
Library = Annotated[Path | None, typer.Option("--tools", metavar="LIBRARY", help=LIBRARY)]
ONE_TOOL = "A tool that the program does not describe, such as 3=ball:10 or 1=flat:1/2in; repeatable, overrides --tools."
OneTool = Annotated[list[str] | None, typer.Option("--tool", metavar="N=TYPE:SIZE", help=ONE_TOOL)]
Units = Annotated[str, option(None, "mm or inch, if the program does not set it.")]
DIALECTS = "Program dialect: iso, fanuc, haas, mazak, okuma, mts, apt, poses; auto: detected and reported."
Dialect = Annotated[str, option(None, DIALECTS)]
Tools = Annotated[Path | None, option("FILE", "Tool table: a job file, or a LinuxCNC .tbl.")]
ToolUnits = Annotated[Literal["mm", "inch"], option("mm|inch", "Unit of a .tbl table.")]
Home = Annotated[str, option("X,Y,Z", "mm; where the tool starts and G28 returns to.")]
TRAVEL = "mm, machine coordinates; moves beyond it are findings (E373)."
Travel = Annotated[str | None, option("X0,Y0,Z0,X1,Y1,Z1", TRAVEL)]
