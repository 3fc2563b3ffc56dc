"""The raw stock a job names, the facets of parts, and the files a finished workpiece leaves in."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines import engine_class
from vmachining.engines.protocol import Engine, Options
from vmachining.engines.settings import VectorSettings
from vmachining.errors import InputError, StockError
from vmachining.job.files import atomic_path
from vmachining.job.jobfile import Job
from vmachining.job.model import Vectors
from vmachining.job.twofold import twofold
from vmachining.stock import (
    BoxStock,
    CylinderStock,
    MeshStock,
    StepStock,
    Stock,
    Triangles,
    _kernels,
    closed_mesh,
    read_mesh,
)
from vmachining.tolerance import LENGTH_EPS_MM

if TYPE_CHECKING:
    from vmachining.engines.brep.occt.step import StepSolid
    from vmachining.toolpath.facets import FacetMesh

STOCK_FORMATS = ("stl", "3mf", "glb", "step")

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

    Raises StockError: Not a closed solid, or a file that cannot be read; names the file, or line and key of the job.
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
    assert path is not None  # the model needs exactly one of four
    try:
        return step_stock(path, chord) if keys.stl is None else _whole_mesh(path, scale)
    except StockError as exc:
        remedy = exc.remedy or "is it the right file? export the stock again, as one closed solid"
        raise StockError(exc.message, file=exc.file, remedy=remedy) from exc


def read_solid(path: Path, chord: float) -> StepSolid:
    """Triangles and volume of the solid of a STEP file."""
    from vmachining.engines.brep import read_step  # OCCT takes seconds to load: only for who asks

    return read_step(path, chord)


def step_stock(path: Path, chord: float) -> StepStock:
    """The solid of a STEP file, curved faces within `chord` (mm). Raises StockError where it holds no single solid."""
    solid = read_solid(path, chord)
    mesh = closed_mesh(solid.vertices, solid.triangles, source=str(path))
    corners = solid.vertices[solid.triangles[solid.curved]]
    return StepStock(mesh, file=str(path), exact_mm3=solid.volume, curved=corners, chord=chord)


def design_mesh(job: Job) -> MeshStock | None:
    """The part as designed, mm, None if the job names none; curved STEP faces within chord_mm.

    Raises StockError: Not a closed solid, or a file that cannot be read; names the file.
    """
    path, keys = job.design_path, job.keys.design
    if path is None or keys is None:
        return None
    try:
        if keys.stl is not None:
            return _whole_mesh(path, job.scale)
        solid = read_solid(path, job.keys.accuracy.chord_mm)
        return closed_mesh(solid.vertices, solid.triangles, source=str(path))
    except StockError as exc:
        message = exc.message.replace("no such stock file", "no such file")
        remedy = exc.remedy or "is it the right file? export the design again, as one closed solid"
        raise StockError(f"design: {message}", file=exc.file, remedy=remedy) from exc


def _whole_mesh(path: Path, scale: float) -> MeshStock:
    """The facets of an STL. A closed surface that passes through itself counts some space twice, and every volume with it.

    Seen from above, a solid is entered and left in turn. Rays through random points (fixed seed) count
    how often they are inside; no boolean is asked, because each kernel repairs such input in its own way.
    """
    stock = read_mesh(path, scale=scale)
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
            what = f"the surface passes through itself, or solids overlap, at x {x:.4g} y {y:.4g} mm"
            raise StockError(what, file=path, remedy="join the solids into one and export it again")
    return stock


def check_formats(text: str) -> tuple[str, ...]:
    """Formats of `--stock stl,3mf,glb,step`.

    Raises InputError: A format this version does not write.
    """
    formats = tuple(part.strip().lower() for part in text.split(",") if part.strip())
    if unknown := [name for name in formats if name not in STOCK_FORMATS]:
        raise InputError(f"unknown stock format {unknown[0]!r}", remedy=f"take {', '.join(STOCK_FORMATS)}")
    return formats


def write_stock(mesh: Triangles, path: Path, block: Ints | None = None) -> float:
    """Write triangles (mm) as one closed solid, by suffix: .stl (binary, 32-bit), .3mf (to 1e-7 mm) or .glb (glTF, 32-bit).

    Every edge of a closed surface has two triangles in the file, see `twofold`. Returns the volume (mm^3) inside the
    triangles as they are written: 32 bits hold 1e4 mm to a thousandth, and a large face moves with its corners.

    block : (m,) that cut each triangle, -1 of the raw stock: its colour in the file, see `block_colors`; None: no colours.
    """
    if path.suffix == ".3mf":
        vertices, triangles, source = twofold(*mesh, lambda points: np.round(points, DECIMALS), 0.0)
    else:
        vertices, triangles, source = twofold(
            *mesh, lambda p: p.astype(np.float32).astype(np.float64), 2.0**-24
        )
    owner = None if block is None else block[source]
    with atomic_path(path) as temporary:
        if path.suffix == ".3mf":
            _write_3mf(temporary, vertices, triangles, owner)
        else:
            temporary.write_bytes((_stl if path.suffix == ".stl" else _glb)(vertices, triangles, owner))
    return Triangles(vertices, triangles).volume


def block_colors(block: Ints) -> Ints:
    """(m, 3) red, green, blue, 0 to 255: raw stock grey, blocks by turns of the golden section around the hues."""
    hue = np.mod(block * 0.6180339887498949, 1.0)
    tint = np.clip(np.abs(np.mod(hue[:, None] * 6.0 + [0.0, 4.0, 2.0], 6.0) - 3.0) - 1.0, 0.0, 1.0)
    rgb = np.where(block[:, None] < 0, 0.72, 0.35 + 0.55 * tint)
    return np.rint(255.0 * rgb).astype(np.int64)


def _stl(vertices: Floats, triangles: Ints, block: Ints | None = None) -> bytes:
    """Binary STL: 80 bytes of header, a count, and 50 bytes per facet; colours of 15 bits as VisCAM and MeshLab read them."""
    facets = np.zeros(len(triangles), dtype=[("normal and corners", "<f4", 12), ("attribute", "<u2")])
    numbers = np.empty((len(triangles), 12), dtype=np.float32)
    _kernels.facets(vertices, np.ascontiguousarray(triangles), numbers)
    facets["normal and corners"] = numbers
    if block is not None:
        red, green, blue = (block_colors(np.arange(-1, block.max(initial=-1) + 1)) >> 3).T
        facets["attribute"] = (0x8000 | red << 10 | green << 5 | blue)[block + 1]
    return b"vmachining, mm".ljust(80) + len(triangles).to_bytes(4, "little") + facets.tobytes()


def _glb(vertices: Floats, triangles: Ints, block: Ints | None) -> bytes:
    """Binary glTF 2.0: every triangle with its own corners, so that viewers shade it flat and faces have one colour.

    Its unit is the metre and its second axis stands upright; a node turns and scales the coordinates, which stay in mm.
    """
    corners = vertices[triangles].reshape(-1, 3).astype("<f4")
    color = np.full((len(triangles), 4), 255, dtype=np.uint8)
    color[:, :3] = block_colors(np.full(len(triangles), -1) if block is None else block)
    data = corners.tobytes() + np.repeat(color, 3, axis=0).tobytes()
    turn = [0.001, 0, 0, 0, 0, 0, -0.001, 0, 0, 0.001, 0, 0, 0, 0, 0, 1]  # columns: x, -z, y
    low, high = (corners.min(axis=0), corners.max(axis=0)) if len(corners) else (np.zeros(3), np.zeros(3))
    head = json.dumps(
        {
            "asset": {"version": "2.0", "generator": "vmachining"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "matrix": turn, "name": "workpiece"}], "buffers": [{"byteLength": len(data)}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.8}}],
            "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": corners.nbytes, "target": 34962},
                            {"buffer": 0, "byteOffset": corners.nbytes, "byteLength": 4 * len(corners), "target": 34962}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": len(corners), "type": "VEC3", "min": low.tolist(),
                 "max": high.tolist()},
                {"bufferView": 1, "componentType": 5121, "normalized": True, "count": len(corners), "type": "VEC4"},
            ],
        },
        separators=(",", ":"),
    ).encode()  # fmt: skip
    head += b" " * (-len(head) % 4)
    parts = ((b"JSON", head), (b"BIN\0", data))
    body = b"".join(len(part).to_bytes(4, "little") + kind + part for kind, part in parts)
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body


def _write_3mf(path: Path, vertices: Floats, triangles: Ints, block: Ints | None = None) -> None:
    """A 3MF package with one object, its triangles coloured by block. The same workpiece gives the same bytes."""
    points = "".join(f'<vertex x="{x:.15g}" y="{y:.15g}" z="{z:.15g}"/>\n' for x, y, z in vertices.tolist())
    colors, paint = "", [""] * len(triangles)
    if block is not None:
        blocks, which = np.unique(block, return_inverse=True)
        hues = (f"{r:02X}{g:02X}{b:02X}" for r, g, b in block_colors(blocks).tolist())
        rows = "".join(f'<m:color color="#{hue}"/>\n' for hue in hues)
        colors = f'<m:colorgroup id="2">\n{rows}</m:colorgroup>'
        paint = [f' pid="2" p1="{k}"' for k in which.reshape(-1).tolist()]
    faces = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"{color}/>\n'
        for (a, b, c), color in zip(triangles.tolist(), paint, strict=True)
    )
    model = MODEL.format(vertices=points, triangles=faces, colors=colors)
    parts = {"[Content_Types].xml": CONTENT_TYPES, "_rels/.rels": RELATIONSHIPS, "3D/3dmodel.model": model}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as package:
        for name, text in parts.items():
            package.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), text, zipfile.ZIP_DEFLATED)


def vector_settings(job: Job) -> VectorSettings:
    """What a job asks of discrete vectors.

    Raises InputError: Lengths or angles that do not go together, or an error above the radius of the smallest tool.
    """
    from vmachining.engines.vectors import spacing_for

    keys = job.keys.vectors or Vectors()
    spacing = keys.spacing_mm
    if keys.error_mm is not None:
        spacing = spacing_for(keys.error_mm, min(tool.profile.max_radius for tool in job.tools.values()))
    return VectorSettings(
        mode=keys.mode, pitch=keys.pitch_mm, spacing=spacing,
        theta_v=None if keys.theta_v_deg is None else radians(keys.theta_v_deg), theta_sharp=radians(keys.theta_sharp_deg),
        allowance=keys.allowance_mm, depth=keys.depth_mm, casting=keys.casting_mm,
    )  # fmt: skip


def raw_engine(job: Job, name: str, stock: Stock) -> Engine:
    """The workpiece before the first block, with what the job asks of the engine `name`.

    Raises InputError: No such engine, or it takes neither the stock nor what is asked.
    """
    keys = job.keys.accuracy
    asked = Options(
        chord=keys.chord_mm, width=keys.width, width_mm3=keys.width_mm3, spacing=keys.spacing_mm,
        directions=keys.directions,
    )  # fmt: skip
    if name != "vectors":
        return engine_class(name).of(stock, asked)
    try:
        asked = replace(asked, design=design_mesh(job), vectors=vector_settings(job))
        return engine_class(name).of(stock, asked)
    except InputError as exc:
        if exc.file is not None:
            raise
        # of the engine, which knows no files
        table = "vectors" if job.keys.vectors is not None and not isinstance(exc, StockError) else "design"
        place = job.where(table) if job.keys.design is not None else job.where()
        raise type(exc)(exc.message, **place, remedy=exc.remedy) from exc


def read_part(path: Path, *, chord_mm: float = 0.01, scale: float = 1.0) -> FacetMesh:
    """Facets of a part, mm; what is wrong with them is in `notes`.

    chord_mm : largest distance of the facets of a STEP file from its surfaces.
    scale : mm per unit of an STL or of points.
    Raises InputError: Neither STL nor STEP nor a table of points, or a damaged file; facets that are turned over, because
        nobody knows which side is outside.
    Raises StockError: A STEP file without a solid.
    """
    from vmachining.toolpath.facets import FacetMesh, read_cloud, read_stl

    suffix = path.suffix.lower()
    if suffix == ".stl":
        facets = read_stl(path, scale=scale)
        mesh = FacetMesh.of(facets.corners, notes=facets.notes)
    elif suffix in (".step", ".stp"):
        solid = read_solid(path, chord_mm)
        mesh = FacetMesh.of(solid.vertices[solid.triangles])
    elif suffix in (".csv", ".xyz"):
        mesh = read_cloud(path, scale=scale)
    else:
        raise InputError(
            f"{path.name}: expected a .stl or a .step file, or points as .csv or .xyz", file=path
        )
    turned = [text for text in mesh.notes if "turned over" in text or "disagree which side" in text]
    a, b, c = mesh.corners.transpose(1, 0, 2)
    if not turned and mesh.is_closed and float((a * np.cross(b, c)).sum()) < 0.0:
        turned = ["the part is inside out: all facets are turned over"]
    if turned:
        raise InputError(
            turned[0], file=path, remedy="turn them in the CAD system: normals point out of the part"
        )
    return mesh
