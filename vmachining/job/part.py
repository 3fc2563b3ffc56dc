"""`read_part`: the facets of a part from an STL or STEP file, or through a cloud of points."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vmachining.errors import InputError
from vmachining.toolpath.facets import FacetMesh, read_cloud, read_stl


def read_part(path: Path, *, chord_mm: float = 0.01, scale: float = 1.0, recover: bool = False) -> FacetMesh:
    """Facets of a part, mm; what is wrong with them is in `notes`.

    chord_mm : largest distance of the facets of a STEP file from its surfaces.
    scale : mm per unit of an STL or of points.
    Raises InputError: Neither STL nor STEP nor a table of points, or a damaged file; facets that are turned over, because
        nobody knows which side is outside.
    Raises StockError: A STEP file without a solid.
    """
    suffix = path.suffix.lower()
    if suffix == ".stl":
        facets = read_stl(path, scale=scale, recover=recover)
        mesh = FacetMesh.of(facets.corners, notes=facets.notes)
    elif suffix in (".step", ".stp"):
        from vmachining.engines.brep import read_step  # OCCT takes seconds to load: only for who asks

        solid = read_step(path, chord_mm)
        mesh = FacetMesh.of(solid.vertices[solid.triangles])
    elif suffix in (".csv", ".xyz"):
        mesh = read_cloud(path, scale=scale)
    else:
        raise InputError(
            f"{path.name}: expected a .stl or a .step file, or points as .csv or .xyz", file=path
        )
    turned = [text for text in mesh.notes if "turned over" in text or "disagree which side" in text]
    if turned:
        raise InputError(
            turned[0], file=path, remedy="turn them in the CAD system: normals point out of the part"
        )
    a, b, c = mesh.corners.transpose(1, 0, 2)
    if mesh.is_closed and float((a * np.cross(b, c)).sum()) < 0.0:
        raise InputError(
            "the part is inside out: all facets are turned over", file=path,
            remedy="turn them in the CAD system: normals point out of the part",
        )  # fmt: skip
    return mesh
