"""A half-cut workpiece on disk: the tree of tiles with its meshes, in one deflated `.npz` file.

It holds the triangles that there are and nothing of those that were cut away, so it grows with the surface of the
workpiece and not with the program; see `docs/files.md`.
"""

from __future__ import annotations

import json
import zlib
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, BadZipFile, ZipFile

import numpy as np
from manifold3d import Manifold, Mesh64

from vmachining.arrays import Ints
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import checked
from vmachining.engines.mesh.tiles import SIDES, Tile
from vmachining.errors import EngineError

__all__ = ["read_tiles", "write_tiles"]

RAW = -1


def write_tiles(path: Path, root: Tile, blocks: dict[int, int], state: dict[str, Any]) -> None:
    """Write the tree in pre-order. `blocks`: block of each run id; `state` must be plain JSON."""
    arrays: dict[str, Any] = {}
    nodes: list[dict[str, Any]] = []

    def visit(tile: Tile) -> None:
        node: dict[str, Any] = {
            "box": tile.box.tolist(),
            "halved": tile.halves is not None,
            "place": tile.place,
            "color": tile.color,
        }
        nodes.append(node)
        if tile.halves is not None:
            for half in tile.halves:
                visit(half)
            return
        node["one"] = tile.solids[Side.OUTER] is tile.solids[Side.INNER]
        for side in SIDES[: 1 if node["one"] else 2]:
            mesh = tile.solids[side].to_mesh64()
            name = f"{len(nodes) - 1}.{side}"
            arrays[f"{name}.points"] = np.array(mesh.vert_properties[:, :3])
            arrays[f"{name}.triangles"] = np.array(mesh.tri_verts)
            runs, owners = _alive(np.array(mesh.run_index), np.array(mesh.run_original_id))
            arrays[f"{name}.runs"] = runs
            arrays[f"{name}.blocks"] = np.array([blocks.get(int(run), RAW) for run in owners])
            arrays[f"{name}.faces"] = np.array(mesh.face_id)
            arrays[f"{name}.merge"] = np.stack([np.array(mesh.merge_from_vert), np.array(mesh.merge_to_vert)])

    visit(root)
    header = json.dumps({"nodes": nodes, "state": state})
    arrays["header"] = np.array(header)
    with ZipFile(
        path, "w", ZIP_DEFLATED, compresslevel=1
    ) as package:  # numpy deflates at level 6: four times slower
        for name, values in arrays.items():
            with package.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, values, allow_pickle=False)


def _alive(runs: Ints, owners: Ints) -> tuple[Ints, Ints]:
    """Runs of triangles that are not empty. A mesh remembers every block that ever cut it, by an empty run of those
    whose triangles are all gone."""
    keep = runs[1:] > runs[:-1]
    if not keep.any():
        return runs[[0, -1]], owners[:1]
    return np.append(runs[:-1][keep], runs[-1]), owners[keep]


def read_tiles(path: Path) -> tuple[Tile, dict[int, int], dict[str, Any]]:
    """The tree, the block of each run id, and the state that `write_tiles` was given.

    Raises
    ------
    EngineError
        The file cannot be read or a mesh in it is broken.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            header = json.loads(str(data["header"]))
            arrays = {name: data[name] for name in data.files}
    except (OSError, ValueError, KeyError, BadZipFile, zlib.error) as error:
        raise EngineError(f"checkpoint {path} cannot be read ({error})", engine="mesh") from error
    ids: dict[int, int] = {}

    def solid(name: str) -> Manifold:
        owners = [int(b) for b in arrays[f"{name}.blocks"]]
        for block in owners:
            if block not in ids:
                ids[block] = int(Manifold.reserve_ids(1))
        merge = arrays[f"{name}.merge"].astype(np.uint64)
        mesh = Mesh64(
            np.array(arrays[f"{name}.points"]),
            np.array(arrays[f"{name}.triangles"]),
            merge_from_vert=np.array(merge[0]),
            merge_to_vert=np.array(merge[1]),
            run_index=np.array(arrays[f"{name}.runs"]),
            run_original_id=np.array([ids[block] for block in owners], dtype=np.uint32),
            face_id=np.array(arrays[f"{name}.faces"]),
        )
        return checked(Manifold(mesh))

    nodes = iter(enumerate(header["nodes"]))

    def build() -> Tile:
        k, node = next(nodes)
        if node["halved"]:
            first = build()
            halves = first, build()
            return Tile({}, {}, np.array(node["box"]), halves, tuple(node["place"]), node["color"])
        inner = solid(f"{k}.{Side.INNER}")
        tile = Tile({}, {}, np.array(node["box"]), place=tuple(node["place"]), color=node["color"])
        tile.put(Side.INNER, inner)
        tile.put(Side.OUTER, inner if node["one"] else solid(f"{k}.{Side.OUTER}"))
        return tile

    root = build()
    return root, {run: block for block, run in ids.items() if block != RAW}, header["state"]
