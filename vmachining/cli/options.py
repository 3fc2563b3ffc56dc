"""Options as values: a command names the dataclass of its options, and their words are made of its fields."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from inspect import Parameter, signature
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

import typer

from vmachining.errors import InputError

MOST = 1e9
"""Largest number of an option; NaN is beyond every limit. Job files have the same (`job.jobfile.MOST`)."""


def examples(*lines: str) -> str:
    """The end of a help text: command lines, each on a line of its own however narrow the terminal."""
    head = "Examples:" if lines[1:] else "Example:"
    return "\b\n" + "\n".join([head, *(f"  vmachining {line}" for line in lines)])


def command(app: typer.Typer, name: str | None = None, *, shown: tuple[str, ...]) -> Callable[..., Any]:
    """Hang a function into a tree, with lines of example. A parameter that is a dataclass becomes its fields, an option each."""

    def hang(function: Callable[..., int]) -> Callable[..., int]:
        hints = get_type_hints(function, include_extras=True)
        values = {key: hint for key, hint in hints.items() if is_dataclass(hint)}
        found: list[Parameter] = []
        for parameter in signature(function).parameters.values():
            if parameter.name not in values:
                found.append(_word(parameter.name, hints[parameter.name], parameter.default))
                continue
            kind = values[parameter.name]
            types = get_type_hints(kind, include_extras=True)
            for field in fields(kind):
                default = Parameter.empty if field.default is MISSING else field.default
                found.append(_word(field.name, types[field.name], default))

        def called(**words: Any) -> int:
            for key, kind in values.items():
                words[key] = kind(**{field.name: words.pop(field.name) for field in fields(kind)})  # type: ignore[operator]
            return function(**words)

        called.__name__, called.__doc__ = function.__name__, function.__doc__
        called.__annotations__ = {one.name: one.annotation for one in found}
        called.__signature__ = signature(called).replace(parameters=found)  # type: ignore[attr-defined]
        app.command(name, epilog=examples(*shown))(called)
        return function

    return hang


def _word(name: str, hint: Any, default: Any) -> Parameter:
    return Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def opt(
    metavar: str | None, help: str, check: Callable[[Any], Any] | None = None, **more: Any
) -> Any:  # fmt: skip
    """An option that is called as its field is; `check` is a callback, `more` goes to typer."""
    return typer.Option(metavar=metavar, help=help, callback=check, **more)


def flag(name: str, help: str) -> Any:
    """A switch that is off unless it is given."""
    return typer.Option(name, help=help)


def arg(metavar: str, help: str) -> Any:
    """A word without a name."""
    return typer.Argument(metavar=metavar, help=help)


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
Scheduler = Annotated[str | None, opt("ADDRESS", "Workers of this Dask scheduler instead.")]
Resume = Annotated[bool, flag("--resume", "Continue where an interrupted run stopped.")]
OfMachine = Annotated[
    str | None, opt("NAME|FILE", "Preset, machine file or job; moves beyond its limits are findings.")
]
BlockDelete = Annotated[bool, flag("--block-delete", "Skip lines that open with a slash.")]
ProgramArg = Annotated[str, arg("PROGRAM", "NC program; - reads standard input.")]
JobArg = Annotated[Path, arg("JOB.toml", "Job file.")]
Out = Annotated[Path | None, opt("DIR", "Result directory; default out/NAME.")]
Engine = Annotated[str | None, opt("NAME", "Of a job; default as in run.")]
StockOut = Annotated[str, opt("LIST", "Finished stock as stl, 3mf, glb, step (comma list).")]
LIBRARY = "Tool library: .tools, .json, .fctl, .fctb, .tbl, .t or .csv."
Library = Annotated[Path | None, typer.Option("--tools", metavar="LIBRARY", help=LIBRARY)]
ONE_TOOL = (
    "A tool that the program does not tell, such as 3=ball:10 or 1=flat:1/2in; repeatable, before --tools."
)
OneTool = Annotated[list[str] | None, typer.Option("--tool", metavar="N=TYPE:SIZE", help=ONE_TOOL)]
Units = Annotated[str, opt(None, "mm or inch, if the program does not set it.")]
DIALECTS = "Program dialect: iso, fanuc, haas, mazak, okuma, mts, apt, poses; auto: detected and reported."
Dialect = Annotated[str, opt(None, DIALECTS)]
Tools = Annotated[Path | None, opt("FILE", "Tool table: a job file, or a LinuxCNC .tbl.")]
ToolUnits = Annotated[Literal["mm", "inch"], opt("mm|inch", "Unit of a .tbl table.")]
Rotary = Annotated[str, opt("ABC", "Rotary axes of the machine.")]
Home = Annotated[str, opt("X,Y,Z", "mm; where the tool starts and G28 returns to.")]
CrcEntry = Annotated[str, opt("prev|next", "How cutter compensation enters the path.")]
CrcCorner = Annotated[str, opt("arc|exact|miter|line", "How compensation treats corners.")]
Taps = Annotated[str, opt("reference|axis", "Where taps in G18 and G19 go; axis: into holes.")]
Dwell = Annotated[str, opt("s|ms", "Unit of P in G4 and in canned cycles.")]
MaxSteps = Annotated[int, opt("N", "Most lines that loops and calls may execute.", min=1)]
FromLine = Annotated[int, opt("N", "Restart at this line.", min=1)]
CONTROL = "A parameter of the control, such as compensation=wear; repeatable."
ControlKeys = Annotated[list[str] | None, opt("KEY=VALUE", CONTROL)]
FOLDERS = "Another folder of subprogram files; repeatable."
Subroutines = Annotated[list[Path] | None, opt("DIR", FOLDERS)]
TRAVEL = "mm, machine coordinates; moves beyond it are findings (E373)."
Travel = Annotated[str | None, opt("X0,Y0,Z0,X1,Y1,Z1", TRAVEL)]
