"""Pages of the site that are made from the code itself, so that they cannot fall behind it.

mkdocs calls `on_files` at every build; each generated page is a Markdown file that exists only in the build.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from textwrap import dedent
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))
from errata import errata_page


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages."""
    for path, page in PAGES.items():
        files.append(File.generated(config, path, content=page()))
    return files


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table; pipes in cells are escaped."""
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(_cell(c) for c in line) + " |" for line in lines) + "\n"


def _cell(text: str) -> str:
    return " ".join(str(text).split()).replace("|", "\\|")


# -- command line ------------------------------------------------------------------------------------------


def command_line() -> str:
    """Every command with its options, as typer documents them."""
    import typer
    from typer.cli import get_docs_for_click

    from vmachining.cli.app import command

    root = command()
    text = get_docs_for_click(obj=root, ctx=typer.Context(root), name="vmachining")
    examples = re.compile("\x08\n(Examples?):\n((?:  .*\n?)+)")
    text = examples.sub(lambda hit: f"{hit[1]}:\n\n```text\n{dedent(hit[2]).strip()}\n```\n", text)
    return "# Command line\n\n" + CODES + text.split("\n", 1)[1]


CODES = """Exit codes: 0 done, 1 findings or blocks that could not be certified, 2 bad usage or input, 3 a bug, 130
interrupted. `--json` prints machine-readable output alone on stdout; progress and messages go to stderr. Completion of your
shell: `vmachining --install-completion`.

"""


# -- job file ----------------------------------------------------------------------------------------------


def job_file() -> str:
    """Every key of the job file, from the models that check it."""
    from vmachining.job.model import JobFile
    from vmachining.tool.table import MEANINGS

    schema = JobFile.model_json_schema()
    out = ["# Job file\n", JOB_INTRO]
    for heading, section in _sections("", schema, schema):
        out.append(f"\n## {heading or 'Top level'}\n")
        if heading and "description" in section:
            out.append(section["description"] + "\n")
        needed = section.get("required", [])
        rows = [
            (f"`{key}`", _type(value), _default(value, key in needed), value.get("description", ""))
            for key, value in section["properties"].items()
            if not _models(value) and key != "tools"
        ]
        out.append(table(("key", "type", "default", "meaning"), rows))
    out.append("\n## [[tools]]\n")
    out.append(table(("key", "meaning"), ((f"`{key}`", text) for key, text in MEANINGS.items())))
    return "\n".join(out)


JOB_INTRO = """TOML. A key that does not exist is refused with its line and the nearest one that does; so is a value of the
wrong type or outside its limits. Keys that name a unit keep it; `units` is that of the others (`home`, stock, free meridians).
`vmachining init PROGRAM` writes a commented one.
"""

Schema = dict[str, Any]


def _sections(prefix: str, section: Schema, root: Schema) -> Iterable[tuple[str, Schema]]:
    yield (f"[{prefix}]" if prefix else ""), section
    for key, value in section["properties"].items():
        for name in _models(value):
            inner = root["$defs"][name.rsplit("/", 1)[1]]
            yield from _sections(f"{prefix}.{key}" if prefix else key, inner, root)


def _models(value: Schema) -> list[str]:
    """References to other models in a property."""
    return [part["$ref"] for part in (value, *value.get("anyOf", ())) if "$ref" in part]


def _type(value: Schema) -> str:
    """A property's type in words."""
    if "anyOf" in value:
        return " or ".join(_type(part) for part in value["anyOf"] if part.get("type") != "null")
    if "enum" in value:
        return ", ".join(f"`{choice}`" for choice in value["enum"])
    if "const" in value:
        return f"`{value['const']}`"
    if "prefixItems" in value:
        return "[" + ", ".join(_type(item) for item in value["prefixItems"]) + "]"
    if value.get("type") == "array":
        return f"list of {_type(value.get('items', {}))}"
    for limit, sign in (("exclusiveMinimum", ">"), ("minimum", "≥")):
        if limit in value:
            return f"number {sign} {value[limit]:g}"
    return {"string": "text", "boolean": "true or false", "object": "table"}.get(
        value.get("type", ""), "number"
    )


def _default(value: Schema, required: bool) -> str:
    if required:
        return "required"
    given = value.get("default")
    return "" if given is None else f"`{str(given).lower() if isinstance(given, bool) else given}`"


# -- tables ------------------------------------------------------------------------------------------------


def tables() -> str:
    """Columns of `blocks` with units and meaning."""
    from vmachining.job.table import COLUMNS, MEANINGS

    rows = ((f"`{name}`", kind.__name__, MEANINGS.get(name, "")) for name, kind in COLUMNS.items())
    return TABLES_INTRO + table(("column", "type", "meaning"), rows) + SUMMARY


TABLES_INTRO = """# Tables and summaries

## blocks.parquet, blocks.csv

One row per NC block that moves, in program order; with more than 100,000 blocks, `blocks.csv` is written only with `--csv`. A
cell is empty where nothing was computed; a 0 is a computed zero. The unit is in the name; lengths are in millimetres,
coordinates are work coordinates of the tool tip.

"""

SUMMARY = """
## summary.json

`blocks`, `removed_mm3` with `removed_lo_mm3` and `removed_hi_mm3`, `proven` (whether these are bounds), `stated_blocks`
(blocks whose intervals are not proven), `stock_mm3`, `final_mm3` with its bounds, `time_s`,
`scheduled_time_s`, `brep` (blocks asked, agreed, retried, refused, disputed), `second_judge` (blocks that a second
engine judged, and the total of all), `warnings`, `notes` (what must be known of all
numbers at once), `seconds` and `stage_seconds` (of the whole run, and of each stage), `peak_mb`, both after the report.

## manifest.json

Inputs with SHA-256, versions, options, whether the run is complete: see the page on files of a result directory.
"""


# -- machines, findings ------------------------------------------------------------------------------------


def machines() -> str:
    """Presets with their options and their default offsets."""
    import inspect

    from vmachining.machine import machinefile
    from vmachining.machine.presets import PRESETS, preset

    rows = []
    for name, make in sorted(PRESETS.items()):
        machine = preset(name)
        axes = ", ".join(axis.name for axis in machine.axes) if hasattr(machine, "axes") else ""
        try:
            options = ", ".join(
                f"`{p.name}` = {p.default}"
                for p in inspect.signature(make).parameters.values()
                if p.default is not inspect.Parameter.empty
            )
        except ValueError:
            options = ""
        rows.append((f"`{name}`", axes, options))
    example = (machinefile.__doc__ or "").split("\n\n", 1)[1].rstrip()
    return (
        '# Machines\n\n`[machine] chain = "NAME"` takes one of these; `file = "machine.toml"` any serial chain of linear '
        "and rotary axes. Lengths in mm.\n\n"
        + table(("chain", "axes, from the workpiece to the tool", "options and their defaults"), rows)
        + f"\n## A machine file\n\n```toml\n{example}\n```\n"
    )


def findings() -> str:
    """The catalogue of the tester."""
    from vmachining.nc.findings import CATALOGUE

    rows = ((f"`{c}`", e.title, e.explanation, e.hint) for c, e in sorted(CATALOGUE.items()))
    return (
        "# Findings of the tester\n\nE: the block is left out, and a run refuses the program. W, I: it is executed. "
        "`vmachining nc check --explain CODE` says the same on the terminal.\n\n"
        + table(("code", "what", "why it matters", "what to do"), rows)
    )


PAGES: dict[str, Callable[[], str]] = {
    "reference/command_line.md": command_line,
    "reference/job_file.md": job_file,
    "reference/tables.md": tables,
    "reference/machines.md": machines,
    "reference/findings.md": findings,
    "reference/errata.md": lambda: errata_page(table),
}
