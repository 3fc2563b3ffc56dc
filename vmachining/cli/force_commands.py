"""The `force` commands of the tree."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from vmachining.cli.options import Json, Quiet, arg, command, examples, opt

EXAMPLE = "force identify slots.csv --corner-radius 4 --teeth 2 --out coefficients.toml"

force = typer.Typer(
    help="Cutting forces: coefficients from slot tests, forces of a job over time.", epilog=examples(EXAMPLE),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip

On = Annotated[Literal["tool", "workpiece"], opt("tool|workpiece", "What the measured forces act on.")]


@command(force, "force:identify_", shown=(EXAMPLE,))
class Identify:
    """Cutting and edge coefficients over the height, with residuals and intervals, as a coefficient file."""

    data: Annotated[
        Path, arg("DATA.csv", "Slot tests: depth_mm, feed_mm_per_tooth, fx_n, fy_n, fz_n (means).")
    ]
    corner_radius: Annotated[float, opt("MM", "0: flat end.")]
    teeth: Annotated[int, opt(None, "Teeth of the tool.", min=1)]
    degree: Annotated[int, opt(None, "Degree of the polynomials in height.", min=0)] = 3
    method: Annotated[
        Literal["joint", "layers"], opt("joint|layers", "One fit with intervals, or layer by layer.")
    ] = "joint"
    weights: Annotated[
        Literal["relative", "resultant", "equal"],
        opt("relative|resultant|equal", "Noise: relative to each force, to the resultant, or equal."),
    ] = "relative"
    layer_ref: Annotated[
        Literal["mid", "top"], opt("mid|top", "Height that a layer's values are assigned to.")
    ] = "mid"
    on: On = "tool"
    confidence: Annotated[float, opt(None, "Confidence level of the intervals.")] = 0.95
    validate: Annotated[
        Path | None,
        opt("DATA.csv", "Slots that were not fitted, at another feed: how far off are the means?"),
    ] = None
    name: Annotated[str | None, opt(None, "Name of the set; default: the file name.")] = None
    out: Annotated[Path | None, opt("FILE.toml", "Coefficient file; default: stdout.")] = None
    plot: Annotated[Path | None, opt("FILE", "Coefficients and residuals as .svg, .pdf, .png.")] = None
    as_json: Json = False


@command(
    force,
    "force:predict_",
    shown=(
        "force predict models/slot/job.toml --block 20-30 --out out/forces",
        "force predict part.toml --measured trace.csv --on workpiece",
    ),
)
class Predict:
    """Force over time: a revolution at every station of the blocks, as CSV and Parquet, with a picture."""

    job: Annotated[Path, arg("JOB.toml", "Job file with a [force] table.")]
    block: Annotated[str, opt("all|3,7-12", "Blocks as numbered in the table of a run.")] = "all"
    measured: Annotated[
        Path | None,
        opt("TRACE.csv", "Measured: time_s or phi_deg, fx_n, fy_n, fz_n; compared with the prediction."),
    ] = None
    on: On = "tool"
    out: Annotated[Path | None, opt("DIR", "Default out/NAME.")] = None
    quiet: Quiet = False
    as_json: Json = False
