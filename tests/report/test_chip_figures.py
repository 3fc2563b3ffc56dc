"""Pictures of the chips of a pass hold the numbers of the table."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vmachining.engagement import chip_table, frames
from vmachining.engagement.analytic import Corner, HeightStock, Records, engaged
from vmachining.errors import InputError
from vmachining.report import chip_figure, write_chips


def a_pass(positions=8):
    stock = HeightStock.staircase((0, 20, 40), (3, 5), y=(-30, 30), floor=-10)
    path = Records(np.array([[-9, 0, 0.5], [40, 3, 0.5]]), 0.0, np.radians([8.0, 10.0]))
    where = np.linspace(0, 1, positions)
    poses = path.at(where, feed_mm_min=600)
    phi = np.radians(np.arange(2.5, 360, 5))
    found = engaged(
        Corner(5, 5), stock, poses.tip, poses.frame, phi, poses.velocity, axis_rate=poses.axis_rate
    )
    return chip_table(found, feed_per_tooth=0.1), where * path.lengths[0] / 10


def test_the_figure_holds_the_numbers():
    table, time = a_pass()
    figure = chip_figure(table, time)
    shapes, chart, length, area = (figure.data[k] for k in (0, -3, -2, -1))
    by = table.group_by("position", maintain_order=True).max()
    assert length.y == pytest.approx(by["length_mm"].to_numpy(), rel=0.02)  # drawn at the angles of the first
    assert area.y == pytest.approx(by["area_mm2"].to_numpy(), rel=0.02)
    assert tuple(length.x) == tuple(time) and np.shape(chart.z) == (72, 8)
    first = table.filter(pl.col("position") == 0).sort("phi_feed_deg")
    assert shapes.y == pytest.approx(first["length_mm"].to_numpy())


def test_files_are_written_and_open_offline(tmp_path):
    table, time = a_pass()
    paths = write_chips(table, tmp_path, time=time, name="pass")
    assert [path.name for path in paths][:2] == ["pass.csv", "pass.html"]
    assert pl.read_csv(paths[0]).height == len(table)
    assert 'src="http' not in paths[1].read_text(encoding="utf-8")
    if len(paths) == 3:
        from PIL import Image

        assert min(Image.open(paths[2]).size) > 500
    axial = frames.rotation(0.0, 0.0)
    slab = HeightStock.staircase((-50, 50), (3,))
    plunge = chip_table(engaged(Corner(5, 0), slab, (0, 0, 0), axial, np.radians([0.0, 90, 180]), (0, 0, -1)))
    assert "time" not in str(chip_figure(plunge).layout.xaxis3.title.text)


def test_bad_tables_are_refused():
    table, time = a_pass()
    with pytest.raises(InputError, match="as many angles"):
        chip_figure(table.head(0))
    with pytest.raises(InputError, match="8 positions want as many times"):
        chip_figure(table, time[:3])
