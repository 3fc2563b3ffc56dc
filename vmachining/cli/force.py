"""force identify and force predict."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vmachining.cli.force_commands import IdentifyOptions
from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note, progress_bar
from vmachining.force import NAMES, identify, layer_coefficients, read_tests, smoothed
from vmachining.job import Job
from vmachining.job.brep import parse_blocks
from vmachining.job.files import write_atomic

__all__ = ["identify_", "predict_"]


def identify_(file: Path, o: IdentifyOptions) -> int:
    """`vmachining force identify`."""
    tests = read_tests(file, on=o.on)
    title = o.name or file.stem
    if o.method == "layers":
        fit = layer_coefficients(tests, o.corner_radius, o.teeth)
        found = smoothed(fit, degree=o.degree, ref=o.layer_ref, name=title)
        more = ["", "[layers]", f"low_mm = {fit.low.tolist()}", f"high_mm = {fit.high.tolist()}"]
        more += [f"{key} = {fit.values[:, k].tolist()}" for k, key in enumerate(NAMES)]
        text, summary = found.to_toml(more), {"method": "layers", "tests": len(tests), "layers": len(fit.low)}
    else:
        result = identify(
            tests, o.corner_radius, o.teeth, degree=o.degree, weights=o.weights,
            confidence=o.confidence, name=title,
        )  # fmt: skip
        found, text = result.coefficients, result.to_toml()
        summary = {
            "method": "joint", "tests": len(tests), "degrees_of_freedom": result.freedom, "sigma": result.sigma,
            "rms_residual_n": float(np.sqrt((result.residual**2).mean())),
        }  # fmt: skip
    warnings = found.negative(*found.height_mm)
    for words in warnings:
        note(f"vmachining: {words}", quiet=o.as_json)
    if o.out is not None:
        write_atomic(o.out, text)
        note(f"wrote {o.out}", quiet=o.as_json)
    if o.as_json:
        emit({
            "name": found.name, "height_mm": list(found.height_mm),
            "powers": {key: found.powers[k].tolist() for k, key in enumerate(NAMES)}, **summary, "warnings": warnings,
        })  # fmt: skip
    elif o.out is None:
        print(text, end="")
    return Code.DONE


def predict_(file: Path, *, block: str, out: Path | None, quiet: bool, as_json: bool) -> int:
    """`vmachining force predict`."""
    from vmachining.job.batch import safe_name
    from vmachining.job.predict import predict
    from vmachining.report.force import write_forces

    job = Job.load(file)
    blocks = None if block == "all" else [k for part in parse_blocks(block, "--block") for k in part]
    with progress_bar(quiet=quiet or as_json) as progress:
        found = predict(job, blocks, progress=progress or (lambda *_: None))
    folder = out if out is not None else Path("out") / safe_name(job.name)
    paths = write_forces(found, folder, name=job.name)
    worst = found.stations.sort("peak_n", descending=True).row(0, named=True)
    power = found.stations.sort("power_w", descending=True).row(0, named=True)
    if as_json:
        emit({
            "stations": found.stations.height, "rows": found.series.height, "largest_force": worst, "largest_power": power,
            "files": [str(path) for path in paths], "notes": list(found.notes),
        })  # fmt: skip
        return Code.DONE
    for text in found.notes:
        note(f"vmachining: {text}")
    print(f"{job.name}: {found.stations.height} stations, {found.series.height} rows")
    print(f"  force     at most {worst['peak_n']:.6g} N in block {worst['block']} (line {worst['line']})")
    print(f"  power     at most {power['power_w']:.6g} W in block {power['block']} (line {power['line']})")
    print(f"  files     {folder}")
    return Code.DONE
