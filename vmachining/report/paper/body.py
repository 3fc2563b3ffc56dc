"""Bodies as pictures: triangles seen along a direction, by a depth buffer, with their shades; the surface of a workpiece, the
volume that one block sweeps."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.report.paper._kernels import nearest
from vmachining.report.paper.style import BLUE, ORANGE, RED, WIDTH_MM, canvas, look, shades
from vmachining.sweep.regions import REGIONS, grazing_points, regions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vmachining.engines.protocol import StockSurface
    from vmachining.sweep import Sweep

LIGHT = np.array([-0.45, -0.55, 0.70])
VIEW = np.array([-0.62, -1.0, 0.85])

PAINT = np.array([0.80, 0.85, 0.92])

SEEN_PX = 700
"""Pixels along the longer side of a view of the stock."""

COARSE_MM = 0.05
"""A picture needs no finer facets."""

PLACES = 65
"""Of the tip path."""

TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Fractions of a motion whose grazing curves are drawn unless others are requested."""

SHOWN = (BLUE, "#d9d9d9", ORANGE)
"""Colours of `REGIONS`."""

HIDDEN_PX = 4.0
"""A curve that lies this much deeper than what is seen is hidden: it lies on facets."""


def nearest_faces(
    points: Floats, triangles: Ints, corner: Floats, pixel: float, shape: tuple[int, int]
) -> tuple[Floats, Ints]:
    """What an orthographic camera sees.

    points : (n, 3) mm; the first two coordinates lie in the picture, the third points at the camera.
    triangles : (m, 3) rows of `points`.
    corner : (2,) mm, lower left corner of the picture. pixel : mm, side of a pixel. shape : rows and columns.
    Returns depth : (rows, columns) mm, third coordinate at the middle of each pixel, -inf where nothing is. face :
        (rows, columns) triangle that is seen, -1 where nothing is.
    """
    depth, face = np.full(shape, -np.inf), np.full(shape, -1, dtype=np.int64)
    corners = np.array(points[triangles], dtype=np.float64)
    corners[:, :, :2] = (corners[:, :, :2] - corner) / pixel - 0.5  # the middle of pixel (i, j) is at (j, i)
    nearest(corners, depth, face)
    return depth, face


def view_frame(toward: Floats = VIEW) -> Floats:
    """(3, 3): right, up, and towards the eye of a picture that `viewed` makes."""
    toward = toward / np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


def viewed(
    points: Floats, triangles: Ints, colours: Floats | None = None, toward: Floats = VIEW
) -> tuple[Floats, tuple[float, float, float, float]]:
    """Shaded picture (rows, columns, RGBA) of triangles seen from the front left above, and its extent in mm.

    colours : (m, 3) of the triangles, 0 to 1. toward : (3,) from the body to the eye.
    A picture of nothing, where no stock is left, is one clear pixel.
    """
    if not len(triangles):
        return np.zeros((1, 1, 4)), (0.0, 1.0, 0.0, 1.0)
    turned = points @ view_frame(toward).T
    low, high = turned[:, :2].min(axis=0), turned[:, :2].max(axis=0)
    pixel = (float((high - low).max()) or 1.0) / (2 * SEEN_PX)  # twice as fine, then averaged: smooth borders
    shape = tuple(int(2 * np.ceil(v / 2)) for v in np.maximum(np.ceil((high - low)[::-1] / pixel), 1))
    depth, face = nearest_faces(turned, triangles, low, pixel, shape)  # type: ignore[arg-type]
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    light = LIGHT * np.sign(VIEW * toward)  # it comes from behind the eye
    lit = 0.42 + 0.58 * np.maximum(normal @ (light / np.linalg.norm(light)), 0.0)
    there = face >= 0
    shade = np.where(there, lit[face], 0.0)
    behind = depth[there].min(initial=0.0) - 1e3
    far = np.where(there, depth, behind)
    edge = np.zeros(shape, dtype=bool)  # a step in depth is an outline
    edge[:-1] |= np.abs(far[1:] - far[:-1]) > 12.0 * pixel
    edge[:, :-1] |= np.abs(far[:, 1:] - far[:, :-1]) > 12.0 * pixel
    shade = np.where(edge, 0.35 * shade, shade)
    seen = _halved(shade)[..., None] * PAINT if colours is None else _halved(shade[..., None] * colours[face])
    alpha = _halved(there.astype(np.float64))[..., None]
    fine = np.concatenate([np.clip(seen / np.maximum(alpha, 1e-9), 0.0, 1.0), alpha], axis=2)
    return fine, (low[0], low[0] + shape[1] * pixel, low[1], low[1] + shape[0] * pixel)


def _halved(fine: Floats) -> Floats:
    """Means of two by two pixels."""
    return np.asarray(0.25 * (fine[::2, ::2] + fine[::2, 1::2] + fine[1::2, ::2] + fine[1::2, 1::2]))


def png(points: Floats, triangles: Ints) -> bytes:
    """The same as a PNG file (8 bits, RGBA), without matplotlib, which takes longer to load than this to draw."""
    pixels = np.rint(255.0 * viewed(points, triangles)[0][::-1]).astype(np.uint8)
    tall, wide = pixels.shape[:2]
    filtered = np.concatenate([np.zeros((tall, 1), np.uint8), pixels.reshape(tall, -1)], axis=1)
    header = struct.pack(">IIBBBBB", wide, tall, 8, 6, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(filtered.tobytes(), 6)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


def draw_surface(surface: StockSurface, *, width_mm: float = WIDTH_MM) -> Figure:
    """A workpiece seen from the front left above, to scale; see `vmachining.engines.protocol.StockSurface`."""
    return _view(surface.vertices, surface.triangles, None, width_mm)


def draw_sweep(sweep: Sweep, *, width_mm: float = WIDTH_MM) -> Figure:
    """The swept volume of one block as facets of 0.05 mm, with the path of the tool tip drawn over it."""
    corners, triangles = facets(sweep)
    tip = np.array([sweep.path.position(float(t)) for t in np.linspace(0.0, 1.0, PLACES)])
    return _view(corners, triangles, tip, width_mm)


def draw_regions(sweep: Sweep, *, times: Sequence[float] = TIMES, width_mm: float = WIDTH_MM) -> Figure:
    """The swept volume from two sides: what the tool left behind at the start, its envelope, what leads at the end.

    times : in [0, 1] of the block, at which the grazing curve is drawn; dotted where the body hides it.
    """
    from matplotlib.colors import to_rgb
    from matplotlib.patches import Patch

    corners, triangles = facets(sweep)
    a, b, c = corners[triangles].transpose(1, 0, 2)
    of = regions(sweep, corners[triangles].mean(axis=1))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    paint = np.array([to_rgb(colour) for colour in SHOWN])
    curves = [(t, grazing_points(sweep, t)) for t in times]
    with look():
        figure = canvas(width_mm, 0.52 * width_mm)
        sides = figure.subplots(1, 2)
        views = ((VIEW, "from the front"), (VIEW * [-1.0, -1.0, 1.0], "from behind"))
        for axes, (toward, name) in zip(sides, views, strict=True):
            picture, box = viewed(corners, triangles, paint[of], toward)
            axes.imshow(picture, origin="lower", extent=box, interpolation="antialiased")
            _curves(axes, corners @ view_frame(toward).T, triangles, box, curves, view_frame(toward))
            axes.set(title=name)
            axes.set_axis_off()
        keys = [
            Patch(color=colour, label=f"{name}, {area[of == k].sum():.0f} mm²")
            for k, (name, colour) in enumerate(zip(REGIONS, SHOWN, strict=True))
        ]
        keys += sides[0].get_legend_handles_labels()[0]
        figure.legend(handles=keys, loc="outside lower center", ncols=4)
    return figure


def _curves(
    axes: Any, seen: Floats, triangles: Ints, box: tuple[float, ...], curves: Any, frame: Floats
) -> None:
    """Grazing curves, those in front of the body as lines."""
    pixel = max(box[1] - box[0], box[3] - box[2]) / SEEN_PX
    shape = int((box[3] - box[2]) / pixel) + 1, int((box[1] - box[0]) / pixel) + 1
    depth, _ = nearest_faces(seen, triangles, np.array([box[0], box[2]]), pixel, shape)
    for (t, branches), colour in zip(curves, shades(len(curves)), strict=True):
        for k, branch in enumerate(branches):
            x, y, z = (branch @ frame.T).T
            i = np.clip(((y - box[2]) / pixel).astype(int), 0, shape[0] - 1)
            j = np.clip(((x - box[0]) / pixel).astype(int), 0, shape[1] - 1)
            front = z > depth[i, j] - HIDDEN_PX * pixel
            label = f"curve at t = {t:.3g}" if k == 0 else None
            axes.plot(np.where(front, x, np.nan), y, color=colour, lw=1.3, label=label)
            axes.plot(np.where(front, np.nan, x), y, ":", color=colour, lw=0.7)


def facets(sweep: Sweep, chord: float = COARSE_MM) -> tuple[Floats, Ints]:
    """Corners (n, 3) mm and triangles (m, 3) of a swept volume within a chord."""
    from vmachining.engines.mesh import solid

    mesh = solid(sweep, chord=chord, side="fair").to_mesh()
    corners = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    return corners, np.asarray(mesh.tri_verts, dtype=np.int64)


def _view(points: Floats, triangles: Ints, tip: Floats | None, width_mm: float) -> Figure:
    with look():
        picture, box = viewed(points, triangles)
        high = (box[3] - box[2]) / (box[1] - box[0])
        figure = canvas(width_mm, width_mm * min(high, 1.5))
        axes = figure.subplots()
        axes.imshow(picture, origin="lower", extent=box, interpolation="antialiased")
        if tip is not None:
            seen = tip @ view_frame().T
            axes.plot(seen[:, 0], seen[:, 1], color=RED, label="path of the tool tip")
            axes.legend(loc="lower right")
        axes.set_axis_off()
    return figure
