"""Forces over time: tables, and a page that opens offline."""

from __future__ import annotations

from pathlib import Path

from vmachining.job.files import make_folder, write_table
from vmachining.job.predict import Prediction
from vmachining.report.chart import Curve, chart
from vmachining.report.figures import Panel, write_page
from vmachining.report.numbers import number, plural


def force_panels(found: Prediction) -> list[Panel]:
    """Largest force and mean power at the stations over time, and the forces over the turn with the largest one."""
    s = found.stations.sort("time_s")
    worst = s.sort("peak_n", descending=True, nulls_last=True).row(0, named=True)
    turn = found.series.filter(
        (found.series["block"] == worst["block"]) & (found.series["at"] == worst["at"])
    ).sort("phi_deg")
    time = s["time_s"].to_numpy()
    told = f"at block {worst['block']}, line {worst['line']}, {worst['at']:.3g} of its path"
    axes = (("fx_n", "along x"), ("fy_n", "along y"), ("fz_n", "along z"), ("resultant_n", "resultant"))
    curves = [Curve(label, turn["phi_deg"].to_numpy(), turn[name].to_numpy()) for name, label in axes]
    return [
        Panel(title="Largest force of a revolution", text=f"The largest is {number(worst['peak_n'], 5)} N, {told}.",
              svg=chart([Curve("force", time, s["peak_n"].to_numpy())], x="time, s", y="N", zero=True)),
        Panel(title="Mean power at the cutter",
              svg=chart([Curve("power", time, s["power_w"].to_numpy())], x="time, s", y="W", zero=True)),
        Panel(title="Force on the tool over the revolution with the largest force", text=f"In workpiece axes, {told}.",
              svg=chart(curves, x="rotation of the first tooth, degrees", y="N")),
    ]  # fmt: skip


def write_forces(found: Prediction, folder: Path | str, *, name: str = "") -> list[Path]:
    """Write forces.csv, forces.parquet (revolutions), force_stations.csv and forces.html; the files written."""
    folder = Path(folder)
    make_folder(folder)
    paths = [folder / n for n in ("forces.csv", "forces.parquet", "force_stations.csv", "forces.html")]
    write_table(found.series, *paths[:2])
    write_table(found.stations, paths[2])
    notes = (
        [Panel(title="Notes", head=("what",), rows=[(note,) for note in found.notes])] if found.notes else []
    )
    write_page(
        paths[3], [*notes, *force_panels(found)], kind="forces", name=name or "Forces",
        subtitle="Forces on the tool of all teeth, at stations along the blocks",
        chips=[("", plural(len(found.stations), "station"))],
    )  # fmt: skip
    return paths
