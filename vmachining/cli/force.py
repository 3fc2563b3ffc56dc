"""force identify and force predict."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from vmachining import force
from vmachining.cli.judge_commands import Identify, Predict
from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note, progress_bar
from vmachining.errors import InputError
from vmachining.job import Job
from vmachining.job.brep import parse_blocks
from vmachining.job.files import write_atomic, write_table
from vmachining.job.reading import read_job_program
from vmachining.nc import Motion


def identify_(o: Identify) -> int:
    tests = force.read_tests(o.data, on=o.on)
    fit: force.LayerFit | force.Identification
    title = o.name or o.data.stem
    if o.method == "layers":
        fit = force.layer_coefficients(tests, o.corner_radius, o.teeth)
        found = force.smoothed(fit, degree=o.degree, ref=o.layer_ref, name=title)
        more = ["", "[layers]", f"low_mm = {fit.low.tolist()}", f"high_mm = {fit.high.tolist()}"]
        more += [f"{key} = {fit.values[:, k].tolist()}" for k, key in enumerate(force.NAMES)]
        summary: dict[str, Any] = {"method": "layers", "tests": len(tests), "layers": len(fit.low)}
    else:
        result = fit = force.identify(
            tests, o.corner_radius, o.teeth, degree=o.degree, weights=o.weights,
            confidence=o.confidence, name=title,
        )  # fmt: skip
        found, more = result.coefficients, result.lines()
        summary = {
            "method": "joint", "tests": len(tests), "degrees_of_freedom": result.freedom, "sigma": result.sigma,
            "rms_residual_n": float(np.sqrt((result.residual**2).mean())),
        }  # fmt: skip
    if o.validate is not None:
        summary["validation"], told = _validated(found, o.validate, o)
        more += told
        off = ", ".join(f"{v:.3g} %" for v in summary["validation"]["largest_percent"])
        note(f"validation: largest deviation of Fx, Fy, Fz {off} of the largest mean", quiet=o.as_json)
    text = found.to_toml(more)
    warnings = found.negative(*found.height_mm)
    for words in warnings:
        note(f"vmachining: {words}", quiet=o.as_json)
    if o.out is not None:
        write_atomic(o.out, text)
        note(f"wrote {o.out}", quiet=o.as_json)
    if o.plot is not None:
        from vmachining.report.paper import FORMATS, draw_coefficients, is_picture, write_figure

        if not is_picture(o.plot, "--plot"):
            raise InputError(f"--plot {o.plot}: expected a name that ends in .{', .'.join(FORMATS)}")
        write_figure(draw_coefficients(fit, tests, degree=o.degree), o.plot)
        note(f"wrote {o.plot}", quiet=o.as_json)
    if o.as_json:
        emit({
            "name": found.name, "height_mm": list(found.height_mm),
            "powers": {key: found.powers[k].tolist() for k, key in enumerate(force.NAMES)}, **summary, "warnings": warnings,
        })  # fmt: skip
    elif o.out is None:
        print(text, end="")
    return Code.DONE


def _validated(found: force.Coefficients, data: Path, o: Identify) -> tuple[dict[str, Any], list[str]]:
    """Slots that were not fitted: deviation per axis, as numbers and as lines of the file."""
    tests = force.read_tests(data, on=o.on)
    off = force.predicted_means(found, tests, o.corner_radius, o.teeth) - tests.force
    rms = np.sqrt((off**2).mean(axis=0))
    percent = 100.0 * np.abs(off).max(axis=0) / np.abs(tests.force).max(axis=0)
    told = {"tests": len(tests), "rms_n": rms.tolist(), "largest_percent": percent.tolist()}
    return told, [
        "",
        "[validation]",
        f"data = {json.dumps(data.name)}",
        *(f"{key} = {told[key]}" for key in told),
    ]


def predict_(o: Predict) -> int:
    from vmachining.job.batch import safe_name
    from vmachining.job.predict import measured_table, predict
    from vmachining.report.figures import write_forces

    job = Job.load(o.job)
    trace = None
    if o.measured is not None:  # before minutes are spent on the prediction
        moves = (m for m in read_job_program(job).moves if m.motion is not Motion.RAPID)
        speeds = {m.spindle_rpm for m in moves if m.spindle_rpm}
        trace = force.read_trace(o.measured, on=o.on, rev_min=speeds.pop() if len(speeds) == 1 else None)
    blocks = None if o.block == "all" else [k for part in parse_blocks(o.block, "--block") for k in part]
    with progress_bar(quiet=o.quiet or o.as_json) as progress:
        found = predict(job, blocks, progress=progress or (lambda *_: None))
    folder = o.out if o.out is not None else Path("out") / safe_name(job.name)
    paths = write_forces(found, folder, name=job.name)
    over = None
    if trace is not None:
        over = force.align(found.turns(), trace)
        paths.append(folder / "forces_measured.csv")
        write_table(measured_table(over), paths[-1])
    worst = found.stations.sort("peak_n", descending=True).row(0, named=True)
    power = found.stations.sort("power_w", descending=True).row(0, named=True)
    if o.as_json:
        compared = {} if over is None else {"measured": {
            "start_s": over.start_s, "correlation": over.correlation, "notes": list(over.notes),
            "axes": {axis: of._asdict() for axis, of in over.axes.items()},
        }}  # fmt: skip
        emit({
            "stations": found.stations.height, "rows": found.series.height, "largest_force": worst, "largest_power": power,
            "files": [str(path) for path in paths], "notes": list(found.notes), **compared,
        })  # fmt: skip
        return Code.DONE
    for text in (*found.notes, *(over.notes if over is not None else ())):
        note(f"vmachining: {text}")
    print(f"{job.name}: {found.stations.height} stations, {found.series.height} rows")
    print(f"  force     at most {worst['peak_n']:.6g} N in block {worst['block']} (line {worst['line']})")
    print(f"  power     at most {power['power_w']:.6g} W in block {power['block']} (line {power['line']})")
    if over is not None:
        begins = f"begins {over.start_s:.6g} s after the program"
        print(f"  measured  {begins}, correlation {over.correlation:.3f}")
        for axis, of in over.axes.items():
            print(
                f"    F{axis}      rms {of.rms_n:.4g} N, {of.percent:.3g} % of the largest measured ({of.peak_measured_n:.5g} N; "
                f"predicted {of.peak_n:.5g} N), means {of.mean_measured_n:.4g} and {of.mean_n:.4g} N"
            )
    print(f"  files     {folder}")
    return Code.DONE
