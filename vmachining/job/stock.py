"""The raw stock a job names, and the files a finished workpiece leaves in."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.errors import InputError, StockError
from vmachining.job.files import atomic_path
from vmachining.job.jobfile import Job
from vmachining.job.twofold import twofold_from
from vmachining.stock import (
    BoxStock,
    CylinderStock,
    MeshStock,
    StepStock,
    Stock,
    Triangles,
    closed_mesh,
    read_mesh,
)
from vmachining.tolerance import LENGTH_EPS_MM

__all__ = [
    "STOCK_FORMATS",
    "check_formats",
    "design_mesh",
    "raw_stock",
    "volume_of",
    "write_stock",
]

STOCK_FORMATS = ("stl", "3mf", "step")

XML = '<?xml version="1.0" encoding="UTF-8"?>\n'
CONTENT_TYPES = (
    XML + '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>"
)
RELATIONSHIPS = (
    XML + '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="rel0" Target="/3D/3dmodel.model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
MODEL = (
    XML + '<model unit="millimeter" xml:lang="en" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02">'
    '<resources>{colors}<object id="1" type="model"><mesh>'
    "<vertices>\n{vertices}</vertices><triangles>\n{triangles}</triangles></mesh></object></resources>"
    '<build><item objectid="1"/></build></model>'
)


DECIMALS = 7
"""Of the mm of a 3MF file."""

RAYS = 64
"""Vertical rays that look for surfaces passing through themselves."""


def raw_stock(job: Job) -> Stock:
    """The stock of a job, mm.

    Raises
    ------
    StockError
        Not a closed solid, or a file that cannot be read; names the file, or line and key of the job.
    """
    keys, scale = job.keys.stock, job.scale
    chord = job.keys.accuracy.chord_mm
    try:
        if keys.box is not None:
            lo, hi = ([scale * v for v in corner] for corner in (keys.box.min, keys.box.max))
            return BoxStock(lo, hi)
        if keys.cylinder is not None:
            bar = keys.cylinder
            (x, y), (low, high) = ((scale * a, scale * b) for a, b in (bar.center, bar.z))
            return CylinderStock((x, y), scale * bar.radius, (low, high))
    except StockError as exc:
        raise StockError(exc.message, **job.where("stock"), remedy=exc.remedy) from exc
    path = job.stock_path
    assert path is not None  # the model wants exactly one of four
    try:
        if keys.stl is not None:
            mesh = read_mesh(path, scale=scale)
            _refuse_overlap(mesh, path)
            return mesh
        from vmachining.engines.brep import read_step  # OCCT takes seconds to load: only for who asks

        solid = read_step(path, chord)
        mesh = closed_mesh(solid.vertices, solid.triangles, source=str(path))
    except StockError as exc:
        remedy = exc.remedy or "is it the right file? export the stock again, as one closed solid"
        raise StockError(exc.message, file=exc.file, remedy=remedy) from exc
    corners = solid.vertices[solid.triangles[solid.curved]]
    return StepStock(mesh, file=str(path), exact_mm3=solid.volume, curved=corners, chord=chord)


def design_mesh(job: Job) -> MeshStock | None:
    """The part that a job wants, mm, None if it names none; curved STEP faces within chord_mm.

    Raises
    ------
    StockError
        Not a closed solid, or a file that cannot be read; names the file.
    """
    path, keys = job.design_path, job.keys.design
    if path is None or keys is None:
        return None
    try:
        if keys.stl is not None:
            mesh = read_mesh(path, scale=job.scale)
            _refuse_overlap(mesh, path)
            return mesh
        from vmachining.engines.brep import read_step  # OCCT takes seconds to load: only for who asks

        solid = read_step(path, job.keys.accuracy.chord_mm)
        return closed_mesh(solid.vertices, solid.triangles, source=str(path))
    except StockError as exc:
        message = exc.message.replace("no such stock file", "no such file")
        remedy = exc.remedy or "is it the right file? export the design again, as one closed solid"
        raise StockError(f"design: {message}", file=exc.file, remedy=remedy) from exc


def _refuse_overlap(stock: MeshStock, path: Path) -> None:
    """A closed surface that passes through itself counts some space twice, and every volume with it.

    Seen from above, a solid is entered and left in turn. Rays through random points (fixed seed) count
    how often they are inside; no boolean is asked, because each kernel repairs such input in its own way.
    """
    corners = stock.corners
    lo, hi = corners.min(axis=1), corners.max(axis=1)
    low, high = stock.bounds
    for x, y in np.random.default_rng(0).uniform(low[:2], high[:2], (RAYS, 2)).tolist():
        near = corners[(lo[:, 0] <= x) & (hi[:, 0] >= x) & (lo[:, 1] <= y) & (hi[:, 1] >= y)]
        a, b, c = (near[:, k] - [x, y, 0.0] for k in range(3))
        u, v, w = (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((b, c), (c, a), (a, b)))
        hit = ((u > 0) & (v > 0) & (w > 0)) | ((u < 0) & (v < 0) & (w < 0))
        area = (u + v + w)[hit]
        height = (u[hit] * a[hit, 2] + v[hit] * b[hit, 2] + w[hit] * c[hit, 2]) / area
        order = np.argsort(height, kind="stable")
        inside = np.cumsum(-np.sign(area[order]))  # a face that looks down is an entry
        # solids that touch swap exit and entry at one height: only intervals of a length count
        real = inside[:-1][np.diff(height[order]) > LENGTH_EPS_MM]
        if len(real) and (real.max() > 1 or real.min() < 0):
            raise StockError(
                f"the surface passes through itself, or solids overlap, at x {x:.4g} y {y:.4g} mm",
                file=str(path),
                remedy="join the solids into one and export it again",
            )


def check_formats(text: str) -> tuple[str, ...]:
    """Formats of `--stock stl,3mf,step`.

    Raises
    ------
    InputError
        A format this version does not write.
    """
    formats = tuple(part.strip().lower() for part in text.split(",") if part.strip())
    for name in formats:
        if name not in STOCK_FORMATS:
            raise InputError(f"unknown stock format {name!r}", remedy=f"take {', '.join(STOCK_FORMATS)}")
    return formats


def write_stock(mesh: Triangles, path: Path, block: Ints | None = None) -> float:
    """Write triangles (mm) as one closed solid, by suffix: .stl (binary, 32-bit) or .3mf (to 1e-7 mm).

    Every edge of a closed surface has two triangles in the file, see `twofold`. Returns the volume (mm^3) inside the
    triangles as they are written: 32 bits hold 1e4 mm to a thousandth, and a large face moves with its corners.

    block : (m,) that cut each triangle, -1 of the raw stock: its colour in the file, see `block_colors`; None: no colours.
    """
    rounded, ulp = (_single, 2.0**-24) if path.suffix == ".stl" else (_decimal, 0.0)
    vertices, triangles, source = twofold_from(*mesh, rounded, ulp)
    owner = None if block is None else block[source]
    with atomic_path(path) as temporary:
        if path.suffix == ".stl":
            temporary.write_bytes(_stl(vertices, triangles, owner))
        else:
            _write_3mf(temporary, vertices, triangles, owner)
    return volume_of(Triangles(vertices, triangles))


def block_colors(block: Ints) -> Ints:
    """(m, 3) red, green, blue, 0 to 255: raw stock grey, blocks by turns of the golden section around the hues."""
    hue = np.mod(block * 0.6180339887498949, 1.0)
    tint = np.clip(np.abs(np.mod(hue[:, None] * 6.0 + [0.0, 4.0, 2.0], 6.0) - 3.0) - 1.0, 0.0, 1.0)
    rgb = np.where(block[:, None] < 0, 0.72, 0.35 + 0.55 * tint)
    return np.rint(255.0 * rgb).astype(np.int64)


def volume_of(mesh: Triangles) -> float:
    """mm^3 inside closed triangles."""
    corners = mesh.vertices[mesh.triangles]
    a, b, c = (corners - mesh.vertices.mean(axis=0)).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def _single(points: Floats) -> Floats:
    return points.astype(np.float32).astype(np.float64)


def _decimal(points: Floats) -> Floats:
    return np.round(points, DECIMALS)


def _stl(vertices: Floats, triangles: Ints, block: Ints | None = None) -> bytes:
    """Binary STL: 80 bytes of header, a count, and 50 bytes per facet; colours of 15 bits as VisCAM and MeshLab read them."""
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    facets = np.zeros(
        len(triangles), dtype=[("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")]
    )
    facets["normal"] = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0)
    facets["corner"] = corners
    if block is not None:
        red, green, blue = (block_colors(block) >> 3).T
        facets["attribute"] = 0x8000 | red << 10 | green << 5 | blue
    return b"vmachining, mm".ljust(80) + len(triangles).to_bytes(4, "little") + facets.tobytes()


def _write_3mf(path: Path, vertices: Floats, triangles: Ints, block: Ints | None = None) -> None:
    """A 3MF package with one object, its triangles coloured by block. The same workpiece gives the same bytes."""
    points = "".join(f'<vertex x="{x:.15g}" y="{y:.15g}" z="{z:.15g}"/>\n' for x, y, z in vertices.tolist())
    colors, paint = "", [""] * len(triangles)
    if block is not None:
        blocks, which = np.unique(block, return_inverse=True)
        rows = "".join(
            f'<m:color color="#{r:02X}{g:02X}{b:02X}"/>\n' for r, g, b in block_colors(blocks).tolist()
        )
        colors = f'<m:colorgroup id="2">\n{rows}</m:colorgroup>'
        paint = [f' pid="2" p1="{k}"' for k in which.reshape(-1).tolist()]
    faces = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"{color}/>\n'
        for (a, b, c), color in zip(triangles.tolist(), paint, strict=True)
    )
    parts = {
        "[Content_Types].xml": CONTENT_TYPES,
        "_rels/.rels": RELATIONSHIPS,
        "3D/3dmodel.model": MODEL.format(vertices=points, triangles=faces, colors=colors),
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as package:
        for name, text in parts.items():
            package.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), text, zipfile.ZIP_DEFLATED)
