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
