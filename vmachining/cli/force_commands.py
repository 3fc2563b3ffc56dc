"""The `force` commands of the tree."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vmachining.cli.options import Json, Quiet, examples

__all__ = ["force"]

force = typer.Typer(
    help="Cutting forces: coefficients from slot tests, forces of a job over time.",
    epilog=examples("force identify slots.csv --corner-radius 4 --teeth 2 --out coefficients.toml"),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip


@force.command(
    epilog=examples("force identify slots.csv --corner-radius 4 --teeth 2 --out coefficients.toml")
)
def identify(
    data: Annotated[
        Path,
        typer.Argument(
            metavar="DATA.csv", help="Slot tests: depth_mm, feed_mm_per_tooth, fx_n, fy_n, fz_n (means)."
        ),
    ],
    corner_radius: Annotated[float, typer.Option("--corner-radius", metavar="MM", help="0: flat end.")],
    teeth: Annotated[int, typer.Option("--teeth", min=1, help="Teeth of the tool.")],
    degree: Annotated[int, typer.Option("--degree", min=0, help="Of the polynomials in the height.")] = 3,
    method: Annotated[
        str,
        typer.Option("--method", metavar="joint|layers", help="One fit with intervals, or layer by layer."),
    ] = "joint",
    weights: Annotated[
        str,
        typer.Option(
            "--weights",
            metavar="relative|resultant|equal",
            help="Noise in proportion to what, or of one size.",
        ),
    ] = "relative",
    layer_ref: Annotated[
        str, typer.Option("--layer-ref", metavar="mid|top", help="Height a layer's values are given to.")
    ] = "mid",
    on: Annotated[
        str, typer.Option("--on", metavar="tool|workpiece", help="What the measured forces act on.")
    ] = "tool",
    confidence: Annotated[float, typer.Option("--confidence", help="Of the intervals.")] = 0.95,
    name: Annotated[str | None, typer.Option("--name", help="Of the set; default: that of the file.")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.toml", help="Coefficient file; default: stdout.")
    ] = None,
    as_json: Json = False,
) -> int:
    """Cutting and edge coefficients over the height, with residuals and intervals, as a coefficient file."""
    from vmachining.cli import force as room

    return room.identify_(
        data, corner_radius=corner_radius, teeth=teeth, degree=degree, method=method, weights=weights,
        layer_ref=layer_ref, on=on, confidence=confidence, name=name, out=out, as_json=as_json,
    )  # fmt: skip


@force.command(epilog=examples("force predict models/slot/job.toml --block 20-30 --out out/forces"))
def predict(
    job: Annotated[Path, typer.Argument(metavar="JOB.toml", help="Job file with a [force] table.")],
    block: Annotated[
        str, typer.Option("--block", metavar="all|3,7-12", help="Blocks as in blocks.csv of a run.")
    ] = "all",
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Default out/NAME.")] = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Force over time: a revolution at every station of the blocks, as CSV and Parquet, with a picture."""
    from vmachining.cli import force as room

    return room.predict_(job, block=block, out=out, quiet=quiet, as_json=as_json)
