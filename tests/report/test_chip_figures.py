"""Pictures of the chips of a pass hold the numbers of the tables."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

import vmachining as vm
from vmachining.engagement import chip_points, chip_table
from vmachining.errors import InputError
from vmachining.report.paper import ChipTable, draw_chips

FEED = 0.1


@pytest.fixture(scope="module")
def slot():
    """A flat cutter D10 in a full slot 3 mm deep: h = f sin(phi) over its whole depth."""
    data = {
        "name": "slot",
        "program": {"file": "slot.csv", "dialect": "poses"},
        "tools": [{"number": 1, "type": "flat", "diameter_mm": 10, "length_mm": 30, "flutes": 2}],
        "stock": {"box": {"min": [0, -20, -20], "max": [80, 20, 3]}},
    }
    return data


@pytest.fixture(scope="module")
def tables(slot, tmp_path_factory):
    folder = tmp_path_factory.mktemp("slot")
    rows = ["x_mm,y_mm,z_mm,i,j,k,feed_mm_min,rapid,tool", "-10,0,0,0,0,1,600,1,1", "60,0,0,0,0,1,600,0,1"]
    (folder / "slot.csv").write_text("\n".join(rows) + "\n", encoding="ascii")
    job = vm.Job.from_mapping(slot, folder)
    found, points = [], []
    for k, at in enumerate((0.05, 0.5, 0.8)):  # the first is in air
        one = next(e for b in (1, 0) if (e := _engage(job, b, at)) is not None)
        found.append(one)
        points.append(chip_points(one, feed_per_tooth=FEED).select(pl.lit(k).alias("position"), pl.all()))
    table = chip_table(found, feed_per_tooth=FEED).with_columns(
        time_s=pl.col("position") * 1.5, path_mm=pl.col("position") * 25.0, feed_per_tooth_mm=pl.lit(FEED)
    )
    return table, pl.concat(points)


def _engage(job, block, at):
    try:
        return vm.engage(job, block, at=at)
    except InputError:
        return None


def test_points_are_those_of_a_slot(tables):
    """On the wall: radius 5 about the axis, z from 0 to 3, normal radial, thickness f times its part along the feed."""
    points = tables[1].filter(pl.col("position") == 1)
    x, y, z, nx, ny, nz, h = (
        points[n].to_numpy() for n in ("x_mm", "y_mm", "z_mm", "nx", "ny", "nz", "thickness_mm")
    )
    assert np.hypot(x - 25.0, y) == pytest.approx(5.0, abs=1e-5)  # -10 + 0.5 * 70 mm
    assert (z.min(), z.max()) == pytest.approx((0.0, 3.0), abs=1e-5)
    np.testing.assert_allclose(np.column_stack([nx, ny]), np.column_stack([x - 25.0, y]) / 5.0, atol=1e-5)
    assert np.abs(nz).max() < 1e-6
    np.testing.assert_allclose(h, FEED * nx, atol=1e-6)


def test_the_surface_that_is_drawn_is_half_a_cylinder(tables):
    d = ChipTable.of(*tables)
    corners, normal, h, s, phi = d.patches(1)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    area = np.linalg.norm(np.cross(a, b), axis=1).sum()
    assert area == pytest.approx(np.pi * 5.0 * 3.0, rel=0.05)  # chords, and an angle at either end
    assert normal.shape == corners.shape and h.max() == pytest.approx(FEED, rel=1e-3)
    assert d.among(6) == [1, 2]  # the first position is in air
    assert not len(d.patches(0).corners)
    # over angle and edge: h = f sin(phi), s from 0 to 3, from the feed
    np.testing.assert_allclose(h, FEED * np.sin(np.radians(phi)), atol=1e-6)
    assert (
        (s.min(), s.max()) == pytest.approx((0.0, 3.0), abs=1e-6)
        and 0.0 <= phi.min() < 3.5
        and 176.5 < phi.max() <= 180.0
    )


def test_the_figure_holds_the_numbers(tables):
    table, points = tables
    figure = draw_chips(ChipTable.of(table, points))
    lines = [line for axes in figure.axes for line in axes.lines if len(line.get_xdata()) == 3]
    by = table.group_by("position", maintain_order=True).max()
    assert lines[0].get_ydata() == pytest.approx(by["length_mm"].to_numpy(), rel=1e-3)
    assert lines[1].get_ydata() == pytest.approx(by["area_mm2"].to_numpy(), rel=1e-3)


def test_bad_tables_are_refused(tables, tmp_path):
    with pytest.raises(InputError, match="as many angles"):
        ChipTable.of(tables[0].head(0), tables[1])
    with pytest.raises(InputError, match="no chips"):
        ChipTable.load(tmp_path)
    tables[0].drop("path_mm").write_parquet(tmp_path / "chips.parquet")
    tables[1].write_parquet(tmp_path / "chip_points.parquet")
    with pytest.raises(InputError, match="earlier version"):
        ChipTable.load(tmp_path)
