"""`force identify` and `force predict`: files, JSON, messages."""

from __future__ import annotations

import json

import polars as pl
import pytest
from tinyjob import JOB, write_job

from vmachining.cli.main import run
from vmachining.force import Coefficients

SLOTS = "depth_mm,feed_mm_per_tooth,fx_n,fy_n,fz_n\n" + "".join(
    f"{d},{f},{-(40 * f + 3) * d},{(120 * f + 8) * d},{(10 * f + 2) * d}\n"
    for d in (1, 2, 3, 4, 6)
    for f in (0.1, 0.2, 0.3)
)
FORCE = '\n[force]\ncoefficients = "aluminium_like_constant"\n'
CUTTER = JOB.replace("length_mm = 20", "length_mm = 20\nflutes = 2")


@pytest.fixture
def slots(tmp_path):
    path = tmp_path / "slots.csv"
    path.write_text(SLOTS, encoding="utf-8")
    return path


@pytest.mark.parametrize("method", ["joint", "layers"])
def test_identify_writes_a_coefficient_file(slots, method, tmp_path, capsys):
    """A flat end whose means are proportional to the depth: the coefficients do not change with the height."""
    out = tmp_path / "k.toml"
    words = ["force", "identify", str(slots), "--corner-radius", "0", "--teeth", "4", "--method", method]
    assert run([*words, "--out", str(out)]) == 0
    found = Coefficients.load(out)
    # Fy = N (Ktc f / 4 + Kte / pi) a
    assert found.at(2.0)[0] == pytest.approx(120.0, rel=1e-6) and found.at(5.0)[3] == pytest.approx(
        8 * 3.14159265 / 4, rel=1e-6
    )
    assert run([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["method"] == method and told["tests"] == 15


BAD = {
    "no file": (["none.csv"], ["none.csv"]),
    "method": (["SLOTS", "--method", "magic"], ["magic", "'joint', 'layers'"]),
    "weights": (["SLOTS", "--weights", "heavy"], ["heavy"]),
    "side": (["SLOTS", "--on", "table"], ["table", "'tool', 'workpiece'"]),
    "degree": (["SLOTS", "--degree", "7"], ["5 depths", "degree 7"]),
}


@pytest.mark.parametrize("case", BAD)
def test_identify_refuses(case, slots, capsys):
    words, wanted = BAD[case]
    words = [str(slots) if word == "SLOTS" else word for word in words]
    assert run(["force", "identify", *words, "--corner-radius", "0", "--teeth", "4"]) == 2
    err = capsys.readouterr().err
    assert all(word in err for word in wanted) and "Traceback" not in err


def test_predict_writes_tables_and_a_picture(tmp_path, capsys):
    job = write_job(tmp_path, job=CUTTER + FORCE)
    out = tmp_path / "forces"
    assert run(["force", "predict", str(job), "--block", "2", "--out", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    table = pl.read_parquet(out / "forces.parquet")
    assert told["rows"] == len(table) and set(table["block"]) == {2}
    assert pl.read_csv(out / "forces.csv").columns == table.columns
    stations = pl.read_csv(out / "force_stations.csv")
    assert stations["peak_n"].max() == pytest.approx(told["largest_force"]["peak_n"])
    assert (stations["time_s"].diff().drop_nulls() > 0).all()
    assert "Largest force of a revolution" in (out / "forces.html").read_text(encoding="utf-8")
    # one revolution takes 60 / n_s
    turn = table.filter(pl.col("at") == 0.5)
    assert turn["time_s"].max() - turn["time_s"].min() == pytest.approx(60 / 8000 * 71 / 72, rel=1e-6)


def test_predict_without_a_table_says_what_to_add(tmp_path, capsys):
    assert run(["force", "predict", str(write_job(tmp_path))]) == 2
    assert "[force]" in capsys.readouterr().err


def test_identify_validates_at_a_feed_that_was_not_fitted(slots, tmp_path, capsys):
    """Means in closed form: what is 5 % larger in y is told as that."""
    rows = SLOTS.splitlines()
    third, two = tmp_path / "third.csv", tmp_path / "two.csv"
    two.write_text("\n".join(r for r in rows if ",0.2," not in r), encoding="utf-8")
    changed = [r.split(",") for r in rows if ",0.2," in r]
    third.write_text(
        "\n".join([rows[0], *(",".join([*r[:3], repr(1.05 * float(r[3])), r[4]]) for r in changed)]),
        encoding="utf-8",
    )
    words = ["force", "identify", str(two), "--corner-radius", "0", "--teeth", "4", "--degree", "1", "--json"]
    assert run([*words, "--validate", str(third)]) == 0
    told = json.loads(capsys.readouterr().out)["validation"]
    assert told["tests"] == 5
    assert told["largest_percent"] == pytest.approx([0.0, 100.0 * 0.05 / 1.05, 0.0], abs=1e-6)
    third.write_text(rows[0] + "\n9,0.2,1,1,1\n", encoding="utf-8")
    assert run([*words, "--validate", str(third)]) == 2
    assert "a slot of 9 mm" in capsys.readouterr().err


def test_predict_lays_a_trace_over_its_forces(tmp_path, capsys):
    """A trace that was made from the revolution itself, a quarter of a turn later."""
    job, out = write_job(tmp_path, job=CUTTER + FORCE), tmp_path / "forces"
    assert run(["force", "predict", str(job), "--block", "2", "--out", str(out), "--json"]) == 0
    capsys.readouterr()
    turn = pl.read_csv(out / "forces.csv").filter(pl.col("at") == 0.5).sort("phi_deg")
    trace = tmp_path / "trace.csv"
    rows = [f"{90 + 360 * k + phi},{x},{y},{z}" for k in range(4) for phi, x, y, z in turn.select(
        "phi_deg", "fx_n", "fy_n", "fz_n").iter_rows()]  # fmt: skip
    trace.write_text("\n".join(["phi_deg,fx_n,fy_n,fz_n", *rows]), encoding="utf-8")
    words = ["force", "predict", str(job), "--block", "2", "--measured", str(trace), "--out", str(out)]
    assert run([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["measured"]["correlation"] > 0.99 and told["measured"]["axes"]["x"]["percent"] < 3.0
    table = pl.read_csv(out / "forces_measured.csv")
    assert len(table) == len(rows) and set(table["block"]) == {2}
    trace.write_text("time_s,fx_n,fy_n\n0,1,2\n", encoding="utf-8")
    assert run(words) == 2 and "'fz_n' is missing" in capsys.readouterr().err
