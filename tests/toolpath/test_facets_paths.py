"""Paths on facets: closed forms of sphere, cylinder and box, an engine that cuts the program, brute force in the tool's frame."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import vmachining as vm
from vmachining.errors import InputError
from vmachining.job.engage import height_map
from vmachining.tool import BallNose, BullNose, FlatEnd
from vmachining.toolpath.clpath import CLPath, Mark, apt_file, iso_program, path_job, pose_table
from vmachining.toolpath.facets import (
    FacetMesh,
    Surface,
    five_axis_raster,
    normals_at,
    push_cutter,
    raster,
    upright_ridges,
    waterline,
    waterline_path,
)


def field(x, y, z):
    """Surface over a grid: z (n, m) at x (n,), y (m,)."""
    xx, yy = np.meshgrid(x, y, indexing="ij")
    p = np.stack([xx, yy, z], axis=-1)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    halves = [np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d))]
    return Surface(FacetMesh.of(np.concatenate(halves)))


def cylinder(radius, half, sign, count=160):
    """Cylinder along x, 6 mm long: convex from above (sign 1) or hollow (-1); the sagitta of its chords is 1e-4 mm at most."""
    y = np.linspace(-half, half, count + 1)
    z = sign * (np.sqrt(radius**2 - y**2) - radius)
    return field(np.array([0.0, 6.0]), y, np.stack([z, z]))


def wave(size=30.0, count=40, height=3.0):
    x = np.linspace(0.0, size, count + 1)
    return field(x, x, height * np.outer(np.sin(x / 6.0), np.cos(x / 7.0)))


def box_surface(*boxes):
    solids = [trimesh.creation.box(extents).apply_translation(at) for extents, at in boxes]
    return Surface(FacetMesh.of(np.concatenate([solid.triangles for solid in solids])))


def left_on_cylinder(path, tool, part, sign, folder):
    """y (n,) mm across, and what an engine leaves above the true cylinder, along the normal."""
    low, high = part.mesh.bounds
    upright = path.is_upright
    name, dialect = ("part.nc", "iso") if upright else ("part.csv", "poses")
    writer = iso_program if upright else pose_table
    (folder / name).write_text(writer(path, feed_mm_min=1000.0))
    job = path_job(name, tool, dialect=dialect, low=low - [0, 0, 5], high=high, home=path.tips[0] + [0, 0, 1])
    (folder / "job.toml").write_text(job)
    stock = height_map(vm.Job.load(folder / "job.toml"), pitch=0.01, region=[[3.0, -7.0], [3.03, 7.0]])
    y, z = cells(stock)
    true = sign * (np.sqrt(20.0**2 - y**2) - 20.0)
    return y, (z - true) * np.sqrt(1.0 - (y / 20.0) ** 2)


@pytest.mark.parametrize("sign", [1, -1], ids=["convex", "hollow"])
def test_an_engine_finds_the_scallops_that_were_asked_for_and_no_gouge(tmp_path, sign):
    part, asked, ball = cylinder(20.0, 8.0, sign), 0.04, 3.0
    path = raster(part, ball, ball, chord=0.002, scallop=asked).path
    _, left = left_on_cylinder(path, BallNose(diameter=2 * ball, length=40.0), part, sign, tmp_path)
    assert left.min() >= -0.002 - 1e-4  # chord tolerance and sagitta
    assert left.max() == pytest.approx(asked, rel=0.05)


@pytest.mark.parametrize("feed", [0.0, 0.7])
def test_ridges_of_planes(feed):
    radius, step, slope = 3.0, 1.3, 0.5
    offsets = np.linspace(0.0, step, 7)
    level, rising = (np.outer(tilt * offsets, np.ones(2)) for tilt in (0.0, slope))
    along = np.full((7, 2), feed)
    ball, up = upright_ridges(level, along, offsets, radius, radius)
    assert up == pytest.approx(1.0 / np.sqrt(1.0 + feed**2))
    assert ball == pytest.approx(radius - np.sqrt(radius**2 - step**2 / 4.0), rel=1e-9)
    assert upright_ridges(level, 0.0 * along, offsets, radius, 0.0)[0] == pytest.approx(0.0)
    # the end of the higher bottom stands over the lower one
    stairs, _ = upright_ridges(rising, 0.0 * along, offsets, radius, 0.0)
    assert stairs == pytest.approx(step * slope / np.sqrt(1.0 + slope**2))
    wide = np.linspace(0.0, 2.1 * radius, 7)
    assert np.isinf(upright_ridges(level, 0.0 * along, wide, radius, 0.0)[0]).all()


@pytest.mark.parametrize(("sign", "corner"), [(1, 0.0), (1, 1.0), (-1, 0.0), (-1, 1.0)])
def test_scallops_of_flat_bottoms_in_three_axes(tmp_path, sign, corner):
    part, asked, radius = cylinder(20.0, 8.0, sign), 0.04, 3.0
    tool = (
        BullNose(diameter=6.0, corner_radius=corner, length=40.0)
        if corner
        else FlatEnd(diameter=6.0, length=40.0)
    )
    path = raster(part, radius, corner, chord=0.002, scallop=asked).path
    y, left = left_on_cylinder(path, tool, part, sign, tmp_path)
    assert left.min() >= -0.002 - 1e-4
    # what no pass removes: in the hollow the bottom stands on both sides, at the border lines end over the part
    ends = np.linspace(-8.0, 8.0, 1601)
    rest = part.drop(np.column_stack([np.full(1601, 3.0), ends]), radius, corner).z
    off = np.abs(y[:, None] - ends)
    under = corner - np.sqrt(corner**2 - np.clip(off - (radius - corner), 0.0, corner) ** 2)
    least = np.where(off <= radius, rest + under, np.inf).min(axis=1)
    kept = (least - sign * (np.sqrt(20.0**2 - y**2) - 20.0)) * np.sqrt(1.0 - (y / 20.0) ** 2)
    # 0.01 mm between places, and the height of a step there; a cell of the engine is as wide
    assert (left - kept).max() == pytest.approx(asked, rel=0.05)


@pytest.mark.parametrize(
    ("sign", "corner", "lead", "tilt"),
    [
        (1, 3.0, 10.0, 5.0),
        (1, 1.0, 15.0, 5.0),
        (1, 0.0, 10.0, 0.0),
        (-1, 1.0, 15.0, 5.0),
        (-1, 1.0, 10.0, 0.0),
        (-1, 0.0, 10.0, 0.0),
        (-1, 0.0, 25.0, 0.0),
    ],
    ids=["ball", "bull", "flat", "bull hollow, tilted", "bull hollow", "flat hollow", "flat hollow, steep"],
)
def test_an_engine_finds_the_scallops_of_leaning_tools(tmp_path, sign, corner, lead, tilt):
    part, asked, radius = cylinder(20.0, 8.0, sign), 0.04, 3.0
    tool = {
        3.0: BallNose(diameter=6.0, length=40.0),
        1.0: BullNose(diameter=6.0, corner_radius=1.0, length=40.0),
        0.0: FlatEnd(diameter=6.0, length=40.0),
    }[corner]
    path = five_axis_raster(part, radius, corner, chord=0.002, scallop=asked, lead_deg=lead, tilt_deg=tilt)
    assert not path.notes
    _, left = left_on_cylinder(path, tool, part, sign, tmp_path)
    assert left.min() >= -0.002 - 1e-4
    assert left.max() == pytest.approx(asked, rel=0.05)


@pytest.mark.parametrize(("radius", "corner"), [(3.0, 3.0), (3.0, 1.0), (3.0, 0.0)])
def test_waterlines_of_opencamlib_lie_on_ours(radius, corner):
    ocl = pytest.importorskip("opencamlib.ocl", reason="opencamlib is not installed")
    one = trimesh.creation.icosphere(subdivisions=3, radius=8.0)
    one.apply_transform(trimesh.transformations.rotation_matrix(0.3, [1, 2, 3]))
    two = trimesh.creation.icosphere(subdivisions=3, radius=6.0).apply_translation([11, 3, -1.0])
    part, z, chord = Surface(FacetMesh.of(np.concatenate([one.triangles, two.triangles]))), 1.0, 0.002
    surface, theirs = ocl.STLSurf(), ocl.Waterline()
    for corners in part.mesh.corners.tolist():
        surface.addTriangle(ocl.Triangle(*(ocl.Point(*p) for p in corners)))
    kinds = {
        3.0: ocl.BallCutter(6.0, 20.0),
        1.0: ocl.BullCutter(6.0, 1.0, 20.0),
        0.0: ocl.CylCutter(6.0, 20.0),
    }
    theirs.setSTL(surface)
    theirs.setCutter(kinds[corner])
    theirs.setZ(z)
    theirs.setSampling(0.4)
    theirs.run()
    points = np.array([[p.x, p.y] for loop in theirs.getLoops() for p in loop])
    far = np.full(len(points), np.inf)
    for loop in waterline(part, z, radius, corner, chord=chord):
        a, way = loop[:-1, :2], np.diff(loop[:, :2], axis=0)
        share = np.clip(((points[:, None] - a) * way).sum(axis=2) / (way**2).sum(axis=1), 0.0, 1.0)
        far = np.minimum(
            far, np.linalg.norm(points[:, None] - a - share[..., None] * way, axis=2).min(axis=1)
        )
    assert len(points) > 200
    # theirs has single points where loops turn at the crease between the spheres
    assert np.sort(far)[:-3].max() <= chord + 1e-6


def cells(stock):
    """y and z of the middles of the cells of a height map."""
    y = 0.5 * (stock.y[1:] + stock.y[:-1])
    return np.broadcast_to(y, stock.top.shape).ravel(), stock.top.ravel()


@pytest.mark.parametrize(("radius", "corner"), [(4.0, 4.0), (4.0, 1.0), (4.0, 0.0)])
def test_no_chord_lies_below_the_dropped_tool(radius, corner):
    chord = 0.01
    part = wave()
    path = raster(part, radius, corner, chord=chord, step=3.0, direction_deg=25.0).path
    tips = path.tips[1:-1]
    share = np.linspace(0.0, 1.0, 23)[:, None, None]
    inner = (tips[:-1] + share * np.diff(tips, axis=0)).reshape(-1, 3)
    z = part.drop(inner[:, :2], radius, corner, floor=part.mesh.bounds[0, 2]).z
    assert (z - inner[:, 2]).max() <= chord
    upright = (
        np.abs(np.diff(tips[:, :2], axis=0)).max(axis=1) < 1e-3
    )  # moves up and down at the border of the part
    excess = (inner[:, 2] - z).reshape(len(share), -1)[1:-1, ~upright]  # ends may stand on a jump
    assert excess.max() <= 2.0 * chord


def test_a_flat_end_goes_upright_at_a_wall():
    part = box_surface(((20, 20, 2), (0, 0, -1)), ((6, 20, 4), (0, 0, 2)))
    path = raster(part, 2.0, 0.0, chord=0.01, step=4.0).path
    tips = path.tips[1:-1]
    level = np.abs(np.diff(tips[:, 2])) < 1e-9
    upright = np.linalg.norm(np.diff(tips[:, :2], axis=0), axis=1) < 1e-9
    assert (level | upright).all()  # no slanting move cuts into a wall
    assert set(np.round(tips[:, 2], 9)) == {0.0, 4.0}
    on_top = np.abs(tips[:, 0]) < 5.0 - 1e-9
    assert (tips[on_top, 2] == 4.0).all()


@pytest.mark.parametrize(("radius", "corner"), [(3.0, 3.0), (3.0, 1.0), (3.0, 0.0)])
def test_waterlines_of_a_sphere_are_circles(radius, corner):
    ball = trimesh.creation.icosphere(subdivisions=4, radius=10.0)
    part = Surface(FacetMesh.of(ball.triangles))
    chord, z = 0.005, 2.0
    (loop,) = waterline(part, z, radius, corner, chord=chord)
    # the torus of the corner touches the sphere where their middles are 10 + r apart
    true = np.sqrt((10.0 + corner) ** 2 - (z + corner) ** 2) + radius - corner
    far = np.linalg.norm(loop[:, :2], axis=1)
    sagitta = 10.0 - np.linalg.norm(ball.triangles.mean(axis=1), axis=1).min()  # facets lie inside the sphere
    assert far.max() <= true + 1e-9
    assert far.min() >= true - sagitta * 1.1  # a little more: the tool touches below the middle of the sphere
    assert np.array_equal(loop[0], loop[-1])
    x, y = loop[:-1, 0], loop[:-1, 1]
    assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() < 0.0  # clockwise: the part on the right


def test_waterlines_of_two_boxes():
    part = box_surface(((20, 10, 8), (0, 0, 0)), ((20, 10, 8), (40, 0, 0)))
    chord = 0.004
    loops = waterline(part, 0.0, 2.0, 0.0, chord=chord)
    assert len(loops) == 2
    for loop in loops:
        x, y = loop[:-1, 0], loop[:-1, 1]
        area = -(x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2.0
        true = 20 * 10 + 2 * 60 + 4 * np.pi
        assert true - chord * 60 <= area <= true + chord * 60
        assert np.ptp(loop, axis=0) == pytest.approx([24, 14, 0], abs=1e-9)
    found = push_cutter(part, 0.0, np.array([1.0, 100.0]), 2.0, 0.0)
    assert found.fibre.tolist() == [0, 0]
    assert found.low == pytest.approx([-12, 28], abs=1e-9) and found.high == pytest.approx([12, 52], abs=1e-9)
    with pytest.raises(InputError, match="no waterline"):
        waterline_path(part, np.array([9.0]), 2.0, 0.0, chord=chord)


def in_tool(points, tip, axis, radius, corner):
    """How deep points lie in a tool, along its axis; brute force."""
    rel = points - tip
    along = rel @ axis
    rho = np.linalg.norm(rel - along[:, None] * axis, axis=1)
    over = np.clip(rho - (radius - corner), 0.0, corner)
    return np.where(rho < radius, along - (corner - np.sqrt(corner**2 - over**2)), -np.inf)


def test_lift_is_the_drop_in_the_frame_of_the_tool():
    part = wave()
    rng = np.random.default_rng(3)
    xy = rng.uniform(0, 30, (100, 2))
    z = part.drop(xy, 4.0, 1.0).z
    up = np.tile([0.0, 0.0, 1.0], (100, 1))
    assert part.lift(np.column_stack([xy, z - 1.0]), up, 4.0, 1.0) == pytest.approx(np.ones(100), abs=1e-9)
    axes = up + rng.uniform(-0.4, 0.4, (100, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    tips = np.column_stack([xy, z])
    lift = part.lift(tips, axes, 4.0, 1.0)
    corners = part.mesh.corners
    share = np.array([(i, j, 6 - i - j) for i in range(7) for j in range(7 - i)]) / 6.0
    dense = np.einsum("sk,tkd->tsd", share, corners).reshape(-1, 3)
    brute = np.array([in_tool(dense, t, a, 4.0, 1.0).max() for t, a in zip(tips, axes, strict=True)])
    assert (lift >= brute - 1e-9).all()
    assert (
        lift <= np.maximum(brute, 0.0) + 0.25
    ).all()  # samples 0.125 mm apart, slopes of the cutter below 1 / 0.5


def test_five_axis_tips_touch_a_sphere():
    ball = trimesh.creation.icosphere(subdivisions=5, radius=10.0)
    part = Surface(FacetMesh.of(ball.slice_plane([0, 0, 5], [0, 0, 1]).triangles))
    path = five_axis_raster(part, 3.0, 3.0, chord=0.01, step=1.0, lead_deg=10.0, tilt_deg=-5.0)
    on = path.marks == Mark.CONTACT
    middle = path.tips + 3.0 * path.axes
    # vertices lie on the sphere, facets at most their sagitta inside it; chords and lifts within the tolerance
    assert np.linalg.norm(middle[on], axis=1) == pytest.approx(13.0, abs=0.03)
    lean = np.degrees(np.arccos((middle * path.axes).sum(axis=1) / np.linalg.norm(middle, axis=1)))
    asked = np.degrees(np.arccos(np.cos(np.radians(10)) * np.cos(np.radians(5))))
    inner = on & (middle[:, 2] > 8.0)  # normals at the border lean: half of their facets are missing
    assert lean[inner] == pytest.approx(asked, abs=0.2)


def test_a_tool_that_would_gouge_is_turned_or_lifted_and_says_so():
    part, radius, corner, chord = wave(), 4.0, 1.0, 0.02
    path = five_axis_raster(part, radius, corner, chord=chord, step=5.0, lead_deg=10.0)
    assert (np.isin(path.marks, [Mark.TURNED, Mark.RAISED])).any() and path.notes
    share = np.array([(i, j, 6 - i - j) for i in range(7) for j in range(7 - i)]) / 6.0
    dense = np.einsum("sk,tkd->tsd", share, part.mesh.corners).reshape(-1, 3)
    for k in np.flatnonzero(path.marks != Mark.LINK)[::7]:
        near = dense[np.linalg.norm(dense - path.tips[k], axis=1) < 12.0]
        assert in_tool(near, path.tips[k], path.axes[k], radius, corner).max() <= chord


def lying_cylinder(facets, radius=20.0, length=60.0):
    """The upper part of a cylinder along x, z from 10 mm, of facets as long as it; with its ends and bottom."""
    rod = trimesh.creation.cylinder(radius=radius, height=length, sections=facets)
    rod.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (0, 1, 0)))
    return FacetMesh.of(trimesh.intersections.slice_mesh_plane(rod, [0, 0, 1], [0, 0, 10.001]).triangles)


def test_corner_normals_of_a_cylinder_of_long_facets_are_upright_to_its_axis():
    mesh = lying_cylinder(96)
    shell = np.abs(mesh.normals[:, 0]) < 1e-9
    corners, normals = mesh.corners[shell], mesh.corner_normals(sharp_deg=30.0)[shell]
    true = corners * [0, 1, 1]
    true /= np.linalg.norm(true, axis=2, keepdims=True)
    inner = corners[:, :, 2] > 11.5  # at the border half of the facets are missing
    # a corner between facets of one width, one of which may have its diagonal there: within half of their angle
    turn = np.degrees(np.arccos(np.clip((normals * true).sum(axis=2)[inner], -1, 1)))
    assert np.abs(normals[:, :, 0]).max() < 1e-12 and turn.max() <= 360 / 96 / 2
    assert (mesh.corner_normals(sharp_deg=30.0)[~shell] == mesh.normals[~shell][:, None]).all()
    every = mesh.corner_normals(sharp_deg=180.0)
    assert every == pytest.approx(mesh.vertex_normals()[mesh.triangles], abs=1e-12)
    assert np.abs(every[shell][:, :, 0]).max() > 0.3  # what the ends did to them
    assert mesh.corner_normals(sharp_deg=0.0) == pytest.approx(
        np.repeat(mesh.normals[:, None], 3, 1), abs=1e-6
    )


@pytest.mark.parametrize("direction", [0, 90])
@pytest.mark.parametrize("corner", [3.0, 1.0])
def test_no_point_on_a_cylinder_of_long_facets_is_tilted_or_lifted(corner, direction):
    mesh = lying_cylinder(96)
    path = five_axis_raster(
        Surface(mesh), 3.0, corner, chord=0.01, step=4.0, lead_deg=5.0, direction_deg=direction
    )
    assert not np.isin(path.marks, [Mark.TURNED, Mark.RAISED]).any() and not path.notes
    if corner == 3.0:  # a ball: its centre is 3 mm outside of facets whose sagitta is 20 (1 - cos(180 / 96))
        middle = (path.tips + 3.0 * path.axes)[path.marks == Mark.CONTACT]
        away = np.hypot(middle[:, 1], middle[:, 2])
        assert 23.0 - 20.0 * (1 - np.cos(np.pi / 96)) - 0.01 <= away.min() and away.max() <= 23.0 + 0.01


def test_normals_of_the_specification():
    corner = FacetMesh.of(
        np.array(
            [
                [(0, 0, 0), (-1, 0, 0), (-1, -1, 0)], [(0, 0, 0), (-1, -1, 0), (0, -1, 0)],
                [(0, 0, 0), (0, -1, 0), (0, 0, -1)], [(0, 0, 0), (0, 0, -1), (-1, 0, 0)],
            ],
            dtype=float,
        )
    )  # fmt: skip
    at = np.zeros((1, 3))
    for kind, true in (
        ("resultant", (0.408248, 0.408248, 0.816497)),
        ("area", (0.408248, 0.408248, 0.816497)),
        ("angle", (0.577350, 0.577350, 0.577350)),
    ):
        assert normals_at(corner, at, np.array([0]), kind)[0] == pytest.approx(true, abs=1e-6)
    assert normals_at(corner, at, np.array([0]), "facet")[0] == pytest.approx((0, 0, 1))


def path_of_five():
    tips = np.array([[0, 0, 5], [1, 0.5, 2], [2, 0.25, 1.5], [4, -1, 3], [4, -1, 9]], dtype=float)
    axes = np.array([[0, 0, 1], [0.1, 0, 1], [0.2, 0.1, 1], [0, 0, 1], [0, 0, 1]], dtype=float)
    return tips, axes / np.linalg.norm(axes, axis=1)[:, None], np.array([True, False, False, False, True])


@pytest.mark.parametrize("dialect", ["iso", "poses", "apt"])
def test_files_read_back(tmp_path, dialect):
    tips, axes, rapid = path_of_five()
    if dialect == "iso":
        axes = np.tile([0.0, 0.0, 1.0], (5, 1))
    path = CLPath(tips, axes, rapid, np.zeros(5, dtype=np.int64))
    write = {"iso": iso_program, "poses": pose_table, "apt": apt_file}[dialect]
    file = tmp_path / "path"
    file.write_text(write(path, feed_mm_min=800.0))
    program = vm.read_program(file, dialect=dialect)
    assert not [f for f in program.findings if f.severity != "I"], program.findings
    ends = np.array([move.end for move in program.moves])[-4:]
    assert ends == pytest.approx(tips[1:], abs=1e-5)
    assert [move.motion is vm.nc.Motion.RAPID for move in program.moves[-4:]] == rapid[1:].tolist()
    assert {move.feed_mm_min for move in program.moves[-4:-1]} == {800.0}
    if dialect != "iso":
        assert np.array([move.axis_end for move in program.moves[-4:]]) == pytest.approx(axes[1:], abs=1e-8)


def test_a_tilted_tool_is_no_iso_program():
    tips, axes, rapid = path_of_five()
    with pytest.raises(InputError, match="no tool axis"):
        iso_program(CLPath(tips, axes, rapid, np.zeros(5, dtype=np.int64)), feed_mm_min=800.0)


def test_steep_faces_are_told():
    cone = Surface(FacetMesh.of(trimesh.creation.cone(3.0, 30.0).triangles))
    area = np.pi * 3.0 * np.hypot(3.0, 30.0)
    (note,) = raster(cone, 2.0, 2.0, chord=0.1, step=3.0).path.notes
    told = float(note.split("(")[1].split(" mm2")[0])
    assert "steep" in note and told == pytest.approx(area, rel=0.01)  # 32 sides


def test_overhangs_and_sizes_are_told():
    part = box_surface(((10, 10, 2), (0, 0, 0)), ((4, 4, 2), (8, 0, 5)))
    assert any("overhang" in text for text in raster(part, 1.0, 1.0, chord=0.1, step=3.0).path.notes)
    for bad in ({"step": 0.0}, {"step": 1.0, "scallop": 0.1}, {}, {"scallop": 5.0}):
        with pytest.raises(InputError):
            raster(part, 1.0, 1.0, chord=0.1, **bad)
