"""Many positions at once: closed form of a slot, the same numbers as one at a time, refusals."""

from __future__ import annotations

import json
import time
from multiprocessing import active_children

import numpy as np
import polars as pl
import pytest
import trimesh
from tinyjob import JOB, write_job

import vmachining as vm
from vmachining.cli.main import run
from vmachining.engagement import MeshStock
from vmachining.errors import InputError
from vmachining.job import Scene, Stopped
from vmachining.job.engage_many import engage_many, positions

SLOT, RAPID = 2, 0  # tiny program: block 2 is the slot X-4..14 at z -1 in a stock from X0 to X10, 18 mm long


def load(folder):
    return vm.Job.load(write_job(folder))


def test_positions_lie_in_the_middle_of_equal_parts(tmp_path):
    scene = Scene.of(load(tmp_path))
    found = positions(scene, str(SLOT), every_mm=6.0)
    assert [p.block for p in found] == [SLOT] * 3
    assert [p.at for p in found] == pytest.approx([1 / 6, 3 / 6, 5 / 6], abs=1e-15)
    assert len(positions(scene, str(SLOT), every_mm=5.9)) == 4
    assert {p.block for p in positions(scene, "all")} == {
        b.number for b in scene.blocks if b.motion != "rapid"
    }


def test_a_slot_by_its_closed_form_and_as_one_at_a_time(tmp_path):
    job = load(tmp_path)
    asked = positions(Scene.of(job), str(SLOT), every_mm=1.0)
    table = engage_many(job, asked, tmp_path, angles=72)
    radius = job.tools[1].cutter.max_radius
    whole = table.filter((pl.col("tip_x_mm") >= radius) & (pl.col("tip_x_mm") + radius < 10.0))
    assert len(whole)
    for column, truth in (("ap_mm", 1.0), ("ae_mm", 2.0 * radius), ("removal_mm3_per_mm", 2.0 * radius)):
        # trapezia of sin over a half turn in 36 steps: pi^2 / (12 x 36^2) = 6.3e-4
        assert whole[column].to_numpy() == pytest.approx(truth, rel=7e-4), column
    assert np.abs(whole["entry_deg"].to_numpy()) == pytest.approx(0.0, abs=1e-6)
    assert whole["exit_deg"].to_numpy() == pytest.approx(180.0, abs=1e-6)
    rows = pl.read_parquet(tmp_path / "engagement.parquet")
    single = vm.engage(job, SLOT, at=asked[7].at, angles=72).table()
    assert rows.filter(pl.col("at") == asked[7].at).equals(single)
    assert pl.read_parquet(tmp_path / "positions.parquet").equals(table)


def test_what_was_asked_before_a_stop_is_kept(tmp_path):
    """Ctrl-C lost all positions."""
    job = load(tmp_path)
    asked = positions(Scene.of(job), str(SLOT), every_mm=0.2)

    def stop(stage, done, total):
        raise KeyboardInterrupt

    words = (
        rf"stopped after position \d+ of 90 \(engagement\); they are in .*positions.csv; .* block {SLOT}: "
    )
    with pytest.raises(Stopped, match=words):
        engage_many(job, asked, tmp_path, angles=24, progress=stop)
    kept = pl.read_parquet(tmp_path / "positions.parquet")
    assert 0 < len(kept) < len(asked)
    rows = pl.read_parquet(tmp_path / "engagement.parquet")
    assert rows["at"].unique().sort().equals(kept["at"].unique().sort())


@pytest.mark.slow  # starts two interpreters
def test_two_processes_say_the_same(tmp_path):
    job = load(tmp_path)
    asked = positions(Scene.of(job), "all", every_mm=0.7)
    tables = []
    for workers in (1, 2):
        (folder := tmp_path / str(workers)).mkdir()
        engage_many(job, asked, folder, workers=workers, angles=24)
        tables.append(pl.read_parquet(folder / "engagement.parquet"))
    assert tables[0].equals(tables[1])


@pytest.mark.slow  # 4 s: two interpreters start
def test_a_failure_ends_the_other_processes_at_once(tmp_path):
    """Errands under way, and those that had been handed out, were waited for: minutes."""
    job = load(tmp_path)
    asked = positions(Scene.of(job), str(SLOT), every_mm=0.01)
    with pytest.raises(InputError):
        engage_many(job, asked, tmp_path, workers=2, angles=-1)
    until = time.monotonic() + 10.0
    while active_children() and time.monotonic() < until:
        time.sleep(0.1)
    assert not active_children() and not list(tmp_path.glob(".vmachining*"))


def test_command(tmp_path, capsys):
    job = write_job(tmp_path)
    words = ["--block", "2,5-7", "--angles", "24", "--out", str(tmp_path / "out"), "--json"]
    assert run(["engage", str(job), *words]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["positions"] == 4 and record["unanswered"] == 0
    assert all((tmp_path / "out" / name).is_file() for name in record["files"])


@pytest.mark.parametrize(
    ("blocks", "every", "words"),
    [
        (str(RAPID), None, "rapids"),
        ("2-99", None, "no block 99"),
        ("two", None, "not understood"),
        ("2", 0.0, "positive"),
        ("all", 1e-7, "a step of"),
    ],
)
def test_refusals(tmp_path, blocks, every, words):
    with pytest.raises(InputError, match=words):
        positions(Scene.of(load(tmp_path)), blocks, every_mm=every)


def test_distances_to_a_torus_of_triangles_and_to_all_its_triangles():
    mesh = trimesh.creation.torus(30.0, 10.0, major_sections=60, minor_sections=30)
    points = np.random.default_rng(3).uniform(-45.0, 45.0, (500, 3))
    found = MeshStock(mesh.vertices, mesh.faces).signed_distance(points)
    # the round torus: its facets lie inside by at most R (1 - cos(pi / n)) in both directions
    exact = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 30.0, points[:, 2]) - 10.0
    sag = 40.0 * (1 - np.cos(np.pi / 60)) + 10.0 * (1 - np.cos(np.pi / 30))
    assert np.abs(found - exact).max() <= sag
    # every triangle asked, as another program projects points on triangles
    near = [
        np.linalg.norm(
            trimesh.triangles.closest_point(mesh.triangles, np.tile(p, (len(mesh.faces), 1))) - p, axis=1
        ).min()
        for p in points[:60]
    ]
    assert np.abs(found[:60]) == pytest.approx(np.array(near), abs=1e-10)


def test_chips_over_time_of_a_slot(tmp_path, capsys):
    write_job(tmp_path, job=JOB.replace("length_mm = 20", "length_mm = 20\nflutes = 2"))
    words = [
        "engage",
        str(tmp_path / "job.toml"),
        "--block",
        str(SLOT),
        "--every",
        "1",
        "--angles",
        "36",
        "--phase",
        "0.5",
    ]
    assert run([*words, "--chips", "--out", str(tmp_path / "chips"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert {"chips.csv", "chip_points.parquet", "figure_chips.png"} <= set(told["files"])
    table = pl.read_parquet(tmp_path / "chips" / "chips.parquet")
    feed = 600 / (2 * 8000)  # mm per tooth, F600 S8000 of the program
    assert len(table) == 18 * 36 and table["feed_per_tooth_mm"].unique().to_list() == [feed]
    inside = table.filter(
        pl.col("at").is_between(0.4, 0.6)
    )  # a slot 1 mm deep: A = f sin(phi) a, h = f sin(phi)
    truth = feed * np.maximum(np.sin(np.radians(inside["phi_feed_deg"].to_numpy())), 0.0)
    np.testing.assert_allclose(inside["area_mm2"], truth, atol=1e-8)
    np.testing.assert_allclose(inside["thickness_mm"], truth, atol=1e-8)
    # 1 mm of the path takes 60 / 600 s
    steps = table.group_by("position", maintain_order=True).agg(pl.col("time_s").first())["time_s"].diff()
    np.testing.assert_allclose(steps[1:], 0.1, rtol=1e-9)
    assert run([*words[:5], "0.001", "--chips"]) == 2
    assert "2000 at most" in capsys.readouterr().err
