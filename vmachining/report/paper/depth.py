"""Triangles seen along a direction: nearest face in every pixel, by a depth buffer, and a shaded picture of them."""

from __future__ import annotations

import struct
import zlib

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.report.paper._kernels import nearest

LIGHT = np.array([-0.45, -0.55, 0.70])
VIEW = np.array([-0.62, -1.0, 0.85])

PAINT = np.array([0.80, 0.85, 0.92])

SEEN_PX = 700
"""Pixels along the longer side of a view of the stock."""


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
