"""`run --engine dexel` with a [design]: gouge and excess in the tables that vectors write, against depths that are known."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import vmachining as vm
from tests.report.pagedata import unpacked
from tests.tinyjob import JOB, PROGRAM
from vmachining.cli.main import run as command
from vmachining.job.stock import write_stock
from vmachining.stock import BoxStock


def test_gouge_and_excess_have_their_depth_and_their_block(tmp_path: Path) -> None:
    """The design is 0.3 mm higher than the floor of the slot (z = -1), and 0.7 mm lower than the stock; STL has 32 bits."""
    write_stock(BoxStock((0, 0, -4), (10, 18, -0.7)).mesh(0.1)[0], tmp_path / "part.stl")
    (tmp_path / "tiny.nc").write_text(PROGRAM)
    (tmp_path / "job.toml").write_text(
        JOB + 'spacing_mm = 0.2\n[design]\nstl = "part.stl"\ntolerance_mm = 0.05\n'
    )
    result = vm.run(tmp_path / "job.toml", engine="dexel", out=tmp_path / "out")
    rows = pl.read_parquet(tmp_path / "out" / "deviation.parquet")
    assert result.summary["max_overcut_mm"] == pytest.approx(0.3, abs=1e-6)
    assert result.summary["max_undercut_mm"] == pytest.approx(0.7, abs=1e-6)
    slot = int(result.blocks.filter(pl.col("line") == 7)["block"].item())
    over = rows.filter(pl.col("state") == "over", pl.col("kind") == "ray along z")
    over = over.filter(pl.col("block") == slot, pl.col("nz") > 0.5)
    for name, value in (("deviation_mm", -0.3), ("z_mm", -0.7), ("nz", 1.0)):
        assert np.allclose(over[name], value)
    farther = 4.0 * 9.4  # mm^2 of the floor that is not nearer to the sides of the design than to its top
    assert over.height * 0.2**2 == pytest.approx(farther, rel=0.02)
    result.write(tmp_path / "out", stock=("3mf", "stl"))
    page = (tmp_path / "out" / "deviation.html").read_text()
    head, arrays = unpacked(page)
    assert "deviation from the design" in page and head["scene"][1]["kind"] == "points"
    # told where it is measured: 0.3 mm too much on the floor of the slot
    assert np.isclose(arrays["values_1"], -0.3, atol=1e-6).sum() >= over.height and slot in arrays["blocks_1"]


def test_files_of_the_workpiece_are_coloured_by_block(tmp_path: Path) -> None:
    """Two blocks of triangles and the raw stock: three colours of the 3MF, and three attributes of the STL."""
    mesh = BoxStock((0, 0, 0), (3, 2, 1)).mesh(0.1)[0]
    block = np.array([-1, -1, 5, 5, 5, 5, 7, 7, 7, 7, 7, 7])
    for name in ("part.stl", "part.3mf"):
        assert write_stock(mesh, tmp_path / name, block) == pytest.approx(6.0)
    facets = np.frombuffer(
        (tmp_path / "part.stl").read_bytes()[84:], dtype=[("f", "<f4", 12), ("color", "<u2")]
    )
    assert sorted(np.unique(facets["color"], return_counts=True)[1].tolist()) == [2, 4, 6]
    with zipfile.ZipFile(tmp_path / "part.3mf") as package:
        model = package.read("3D/3dmodel.model").decode()
    assert model.count("<m:color ") == 3 and model.count('p1="1"') == 4 and 'color="#B8B8B8"' in model


def test_the_command_that_measures_has_the_depths_of_a_gouge(tmp_path: Path) -> None:
    """`measure` asks the discrete vectors, here upright ones; heights in an STL file have 32 bits."""
    write_stock(BoxStock((0, 0, -4), (10, 18, -0.7)).mesh(0.1)[0], tmp_path / "part.stl")
    (tmp_path / "tiny.nc").write_text(PROGRAM)
    (tmp_path / "job.toml").write_text(
        JOB + '[design]\nstl = "part.stl"\n[vectors]\nmode = "dvv"\npitch_mm = 1.0\n'
    )
    out = tmp_path / "out"
    assert command(["measure", str(tmp_path / "job.toml"), "--out", str(out), "--quiet"]) == 0
    summary = json.loads((out / "summary.json").read_text())
    assert summary["max_overcut_mm"] == pytest.approx(0.3, abs=1e-6)
    assert summary["max_undercut_mm"] == pytest.approx(0.7, abs=1e-6)
    assert pl.read_parquet(out / "blocks.parquet")["engine"].unique().to_list() == ["vectors"]
    assert (out / "deviation.csv").is_file()


def test_measuring_needs_a_design(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "tiny.nc").write_text(PROGRAM)
    (tmp_path / "job.toml").write_text(JOB)
    assert command(["measure", str(tmp_path / "job.toml"), "--out", str(tmp_path / "out")]) == 2
    assert "[design]" in capsys.readouterr().err
