"""The command tree. Bodies import what they need, so that `--help` loads no kernel."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from vmachining.cli.job_commands import jobs, shows
from vmachining.cli.judge_commands import force, judges, times
from vmachining.cli.nc_commands import nc, programs, toolpath
from vmachining.cli.options import examples

SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 110}


app = typer.Typer(
    name="vmachining",
    help="Milling simulation: removed volume of every NC block with its error, and the feed it allows.",
    epilog=examples("demo --out out/demo", "init part.nc --out part.toml", "run part.toml"),
    no_args_is_help=True, add_completion=True, rich_markup_mode=None, pretty_exceptions_enable=False,
    context_settings=SETTINGS,
)  # fmt: skip
for group in (jobs, judges, programs, shows):
    app.registered_commands += group.registered_commands
app.add_typer(nc, name="nc")
app.add_typer(force, name="force")
app.add_typer(toolpath, name="toolpath")
app.add_typer(times, name="times")


def _version(show: bool) -> None:
    if show:
        from importlib.metadata import version

        typer.echo(version("vmachining"))
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Milling simulation: removed volume of every NC block with its error, and the feed it allows."""


def command() -> Any:
    """The command that `main` runs."""
    return typer.main.get_command(app)
