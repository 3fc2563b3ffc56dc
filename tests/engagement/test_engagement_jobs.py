"""`vm.engage` and `vmachining engage`: the tool at a fraction of a block of a program, and all refusals."""

from __future__ import annotations

import json
import struct
from math import acos, pi, sqrt

import numpy as np
import polars as pl
import pytest
from tinyjob import JOB, PROGRAM, write_job

import vmachining as vm
from tests.models.shipped import MODELS
from vmachining.cli.main import run
from vmachining.errors import InputError, ToolError
from vmachining.job import Scene
from vmachining.sweep import Stance
from vmachining.tool import Edge

MM = 1e-6
# blocks of the tiny program: 0, 1 rapids, 2 the slot X-4..14 at z -1 (stock X0..10), 3, 4 rapids,
# 5 plunge, 6 arc, 7 line, 8 rapid
SLOT, PLUNGE, ARC, LINE = 2, 5, 6, 7


def load(folder, **change):
    return vm.Job.load(write_job(folder, **change))


def test_a_slot_is_engaged_over_half_a_turn_once_the_tool_is_in(tmp_path):
    scene = Scene.of(load(tmp_path))
    middle = vm.engage(scene, SLOT)
    assert middle.stance.tip == pytest.approx([5, 4, -1]) and (middle.block, middle.line) == (SLOT, 7)
    assert middle.summary["arcs_feed_deg"] == [pytest.approx([0, 180], abs=1e-6)]
    assert (middle.ap, middle.ae) == pytest.approx((1.0, 4.0), abs=MM)
    # tip at x = -1: the rim R2 reaches x = 0 within acos(1 / 2) of straight ahead
    entering = vm.engage(scene, SLOT, at=3 / 18)
    assert entering.summary["arcs_feed_deg"] == [pytest.approx([30, 150], abs=1e-6)]
    assert entering.ae == pytest.approx(2 * sqrt(3), abs=MM)
    assert vm.engage(scene, SLOT, at=0.0).is_air and vm.engage(scene, SLOT, at=1.0).is_air
    # the rate of removal is ap times ae; trapezia over 1 degree
    assert middle.removal_per_mm == pytest.approx(4.0, rel=1e-4)


def test_a_block_of_an_arc_and_its_neighbours(tmp_path):
    """Arc of radius 2 with a tool of radius 2, after a plunge: entry where the plunged hole ends."""
    job = load(tmp_path)
    scene = Scene.of(job)
    start = vm.engage(scene, ARC, at=0.0)  # the tool stands in the hole it has made
    assert start.summary["arcs_feed_deg"] == [pytest.approx([0, 180], abs=1e-3)]
    late = vm.engage(scene, ARC, at=0.9)
    assert 0 < np.ptp(late.arcs) <= pi + 1e-9
    told = set(late.table().drop_nulls("upper_by")["upper_by"])
    assert told == {"stock"}
    line = vm.engage(scene, LINE, at=0.5)
    assert line.ap == pytest.approx(0.5, abs=MM) and line.feed_angle == pytest.approx(-pi / 2)  # to -y
    sunk = vm.engage(scene, PLUNGE, bottom=True, at=1.0)
    assert sunk.ap == pytest.approx(0.0, abs=MM) and sunk.removal_per_mm == pytest.approx(4 * pi, rel=1e-9)
    assert (
        vm.engage(scene, PLUNGE, at=1.0).is_air and "bottom disc" in vm.engage(scene, PLUNGE, at=1.0).notes[0]
    )


def test_solids_say_the_same(tmp_path):
    scene = Scene.of(load(tmp_path))
    rays, solids = (vm.engage(scene, ARC, at=0.4, method=m, angles=36) for m in ("dexel", "brep"))
    a, b = rays.table(), solids.table()
    assert a["phi_deg"].to_list() == b["phi_deg"].to_list()
    for name in ("lower_mm", "upper_mm", "length_mm", "ue_x_mm"):
        assert a[name].fill_null(-1).to_numpy() == pytest.approx(b[name].fill_null(-1).to_numpy(), abs=1e-6)
    assert a["upper_by"].to_list() == b["upper_by"].to_list()
    assert rays.arcs == pytest.approx(solids.arcs, abs=1e-5)


def test_the_rate_along_a_block_adds_up_to_its_volume(tmp_path):
    """Gauss points over the slot's block: the integral of removed volume per mm is the 40 mm3 it removes.

    The front half of the circle enters between tips at x = -2 and 0 and leaves between 8 and 10; the rate is a
    root at the outer ends of these pieces, which 6 nodes integrate to 3e-3 of a quarter circle.
    """
    scene = Scene.of(load(tmp_path))
    x, w = np.polynomial.legendre.leggauss(6)
    total = 0.0
    for a, b in ((-2, 0), (0, 8), (8, 10)):
        tips = 0.5 * (a + b) + 0.5 * (b - a) * x
        rates = [vm.engage(scene, SLOT, at=(tip + 4) / 18).removal_per_mm for tip in tips]
        total += 0.5 * (b - a) * float(w @ rates)
    assert total == pytest.approx(40.0, rel=1e-3)


def test_stock_files_and_cylinders_are_met(tmp_path):
    box = "box = { min = [0, 0, -4], max = [10, 18, 0] }"
    bar = load(tmp_path / "bar", swap={box: "cylinder = { center = [5, 4], radius = 5, z = [-4, 0] }"})
    found = vm.engage(bar, SLOT, at=4 / 18)  # tip at x = 0, on the circle of the bar
    half = acos((25 + 4 - 25) / (2 * 5 * 2))
    assert found.arcs == pytest.approx(np.array([[pi / 2 - half, pi / 2 + half]]), abs=1e-7)
    corners = np.array([(x, y, z) for x in (0, 10) for y in (0, 18) for z in (-4, 0)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    facets = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    data = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[list(t)].ravel(), 0) for t in facets)
    (tmp_path / "box.stl").write_bytes(b" " * 80 + struct.pack("<I", len(facets)) + data)
    stl = load(tmp_path, swap={box: 'stl = "box.stl"'})
    plain = vm.engage(load(tmp_path / "plain"), SLOT, at=0.3)
    assert vm.engage(stl, SLOT, at=0.3).lengths == pytest.approx(plain.lengths, abs=MM)
    assert vm.engage(stl, SLOT, method="brep", at=0.3).lengths == pytest.approx(plain.lengths, abs=MM)


POSES = """\
x_mm,y_mm,z_mm,i,j,k,feed_mm_min,tool
-10,0,-1,0,0,1,600,1
0,0,-1,0,0,1,600,1
20,0,-1,0.17364818,0,0.98480775,600,1
"""


def test_five_axes(tmp_path):
    """A ball in a plane: its depth over the lowest point of the sphere, whatever the axis; and the axis turns."""
    (tmp_path / "poses.csv").write_text(POSES)
    keys = {
        "program": {"file": "poses.csv", "dialect": "poses", "home": [-10, 0, -1]},
        "tools": [{"number": 1, "type": "ball", "diameter_mm": 10, "length_mm": 40}],
        "stock": {"box": {"min": [-50, -50, -20], "max": [50, 50, 0]}},
    }
    found = vm.engage(vm.Job.from_mapping(keys, tmp_path), 1, at=0.5)
    tilt = np.radians(5)
    assert found.stance.axis == pytest.approx([np.sin(tilt), 0, np.cos(tilt)], abs=1e-7)
    # the ball's centre stands 5 along the axis; straight ahead and behind, the sphere meets z = 0
    centre = found.stance.tip + 5 * found.stance.axis
    ends = found.points(found.intervals, upper=True)
    assert np.allclose(ends[:, 2], 0.0, atol=MM)
    assert np.allclose(np.linalg.norm(ends - centre, axis=1), 5.0, atol=MM)
    # what faces forward is the side of the centre's velocity: the front of a ball is a half ball
    velocity = found.stance.velocity + 5 * found.stance.axis_rate
    parts = found.intervals
    low = found.points(parts, upper=False)[parts.lower_by == -2]
    assert np.allclose((low - centre) @ velocity, 0.0, atol=1e-6 * np.linalg.norm(velocity))


def test_a_helix_is_wound_as_the_tool_says(tmp_path):
    job = load(tmp_path, swap={"length_mm = 20": "length_mm = 20\nhelix_deg = 45"})
    found = vm.engage(job, SLOT, edge="helix")
    # 1 mm deep with lead 45 degrees on R2: the highest point lags by 0.5 rad, so contact ends that much later
    assert np.ptp(found.arcs) == pytest.approx(pi + 0.5, abs=1e-6)
    assert found.lengths.max() == pytest.approx(sqrt(2), abs=MM)


REFUSED = {
    "no such block": ({"block": 9}, "there is no block 9: the program has blocks 0 to 8"),
    "negative": ({"block": -1}, "there is no block -1"),
    "rapid": ({"block": 1}, r"tiny\.nc:6: block 1 is a rapid and cuts nothing.*take a block with a feed"),
    "fraction": ({"at": 1.5}, r"fraction 1\.5 of the block is not between 0 and 1"),
    "nan": ({"at": float("nan")}, "fraction nan"),
    "method": ({"method": "nx"}, "unknown method 'nx'; one of dexel, brep, analytic"),
    "wound": (
        {"method": "analytic", "edge": "helix"},
        "'analytic' works with the straight edge only; take dexel or brep",
    ),
    "pitch": ({"method": "analytic", "pitch": 0.0}, "pitch of 0 mm"),
    "angles": ({"angles": 2}, "2 angles: expected 4 to"),
    "edge": ({"edge": "wavy"}, "unknown edge 'wavy'; one of straight, helix"),
    "helix": ({"edge": "helix"}, "tool 1 has no helix angle; give helix_deg"),
    "phase": ({"phase": 1.0}, "phase 1 of the angles"),
    "seconds": ({"seconds": 0.0}, "expected a positive number"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals(tmp_path, case):
    options, words = REFUSED[case]
    with pytest.raises(InputError, match=words):
        vm.engage(load(tmp_path), **{"block": SLOT, **options})


def test_a_cut_without_a_tool_is_refused(tmp_path):
    with pytest.raises(InputError, match="tool"):
        vm.engage(load(tmp_path, program=PROGRAM.replace("T1 M6", "T7 M6")), SLOT)
    with pytest.raises((InputError, ToolError)):
        vm.engage(load(tmp_path, job=JOB.replace("length_mm = 20", "length_mm = 20\nhelix_deg = 95")), SLOT)


# -- command line ------------------------------------------------------------------------------------------


def test_json_is_all_of_it_and_alone(tmp_path, capsys):
    job = write_job(tmp_path)
    words = ["--block", "2", "--at", "0.25", "--angles", "72", "--phase", "0.5", "--json"]
    assert run(["engage", str(job), *words]) == 0
    out, err = capsys.readouterr()
    record = json.loads(out)
    assert err == "" and record["block"] == 2 and record["at"] == 0.25 and record["method"] == "dexel"
    found = vm.engage(vm.Job.load(job), 2, at=0.25, angles=72, phase=0.5)
    assert record == json.loads(json.dumps(found.to_dict()))
    assert len({row["phi_deg"] for row in record["intervals"]}) == 72
    assert record["tip_mm"] == [0.5, 4.0, -1.0]


def test_a_second_opinion_that_fails_is_a_finding(tmp_path, capsys):
    job = write_job(tmp_path)
    assert run(["engage", str(job), "--block", "2", "--method", "brep", "--seconds", "1e-6"]) == 1
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert "no answer within 1e-06 s of a processor; take --method dexel, or more --seconds" in err


def test_files_hold_the_same_numbers(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    from PIL import Image

    job, out = write_job(tmp_path), tmp_path / "out"
    assert run(["engage", str(job), "--block", "2", "--out", str(out)]) == 0
    text = capsys.readouterr().out
    assert "0.000000 to 180.000000 degrees" in text
    assert "axial     1.000000 mm" in text and "radial    4.000000 mm" in text
    assert {path.name for path in out.iterdir()} == {
        "engagement.csv", "engagement.parquet", "engagement.html", "engagement.png", "engagement_map.csv",
        "engagement_chips.csv", "engagement.json",
    }  # fmt: skip
    found = vm.engage(vm.Job.load(job), 2)
    assert pl.read_parquet(out / "engagement.parquet").equals(found.table())
    assert pl.read_csv(out / "engagement.csv")["length_mm"].sum() == pytest.approx(found.lengths.sum())
    chips = pl.read_csv(out / "engagement_chips.csv")
    assert chips["area_mm2"].max() == pytest.approx(1.0, abs=1e-4) and len(chips) == 360
    chart = pl.read_csv(out / "engagement_map.csv")
    assert chart.shape == (360, 201) and chart["phi_deg"][90] == pytest.approx(90.0)
    page = (out / "engagement.html").read_text(encoding="utf-8")
    assert "tiny: block 2 at 0.5" in page and 'src="http' not in page
    picture = np.asarray(Image.open(out / "engagement.png").convert("RGB")).reshape(-1, 3)
    yellow = (picture[:, 0] > 220) & (picture[:, 1] > 200) & (picture[:, 2] < 80)
    assert yellow.sum() > 1000  # the thickest chip, straight ahead


BAD = {
    "no block": (["--block", "99"], "there is no block 99"),
    "block missing": ([], "--block"),
    "rapid": (["--block", "0"], "is a rapid"),
    "fraction": (["--block", "2", "--at", "2"], "not between 0 and 1"),
    "analytic": (["--block", "2", "--method", "analytic", "--pitch", "-1"], "pitch of -1 mm"),
    "no job": (["--block", "2"], "none.toml"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_usage_is_one_message_and_exit_2(case, tmp_path, capsys):
    job = write_job(tmp_path)
    words, message = BAD[case]
    name = str(tmp_path / "none.toml") if case == "no job" else str(job)
    assert run(["engage", name, *words]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and message in err


def test_a_page_escapes_foreign_names(tmp_path):
    found = vm.engage(load(tmp_path), SLOT, angles=24)
    from vmachining.report.engagement import write_engagement_page

    write_engagement_page(found, tmp_path / "a.html", name="<script>alert(1)</script>")
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "<script>alert(1)" not in text and "&lt;script&gt;alert(1)" in text


# -- a model whose blocks are known --------------------------------------------------------------------------


def test_the_rate_of_a_ball_on_a_half_cylinder_adds_up():
    """models/half_cylinder: every steady chord removes 3.042724 mm3 (closed form of its readme), meshes as stock.

    Rate over the chord by 4 Gauss nodes; trapezia over 3 degree steps are good to some 1e-4.
    """
    scene = Scene.of(vm.Job.load(MODELS / "half_cylinder" / "job.toml"))
    x, w = np.polynomial.legendre.leggauss(4)
    found = [vm.engage(scene, 120, at=0.5 + 0.5 * node, angles=120) for node in x]
    chord = 110 * np.sin(pi / 428)
    total = 0.5 * chord * float(w @ [one.removal_per_mm for one in found])
    assert total == pytest.approx(3.042724, rel=1e-3)
    # across the feed the ball cuts to w = 3.001975 mm on both sides
    assert found[0].ae == pytest.approx(2 * 3.001975, abs=0.005)


def test_straight_edges_are_rays():
    """The edge of a cylinder is a line: its ends at an earlier sweep are those of `Sweep.ray_intervals`."""
    tool = vm.FlatEnd(diameter=10, length=30)
    before = vm.Sweep(vm.BallNose(diameter=12, length=40), (-20, -3, -2.5), (20, 1, -1.0))
    swept, now = vm.engagement.Past(0, before), Stance.on(vm.Line((0, 0, -4), (9, 2, -4)), 0.3)
    cutting = Edge(tool)
    phi = np.radians(np.arange(25, 100, 5.0))
    stock = vm.engagement.BoxStock((-50, -50, -20), (50, 50, 0))
    work = vm.engagement.RayWorkpiece(stock, [swept])
    parts = vm.engagement.engaged_parts(cutting, now, phi, work)
    foot = now.points(cutting, phi, np.zeros(len(phi), dtype=np.int64), np.zeros(len(phi)))
    inside = before.ray_intervals(foot, now.axis)
    assert inside.counts.tolist() == [1] * len(phi)
    mine = parts.take(parts.upper_by == 0)
    assert len(mine.row) > 5
    assert mine.upper == pytest.approx(inside.enter[mine.row], abs=1e-7)
