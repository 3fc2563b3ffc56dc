"""A half-cut workpiece for a checkpoint: the tree of tiles as JSON, its meshes as arrays.

It holds the triangles that there are and nothing of those that were cut away, so it grows with the surface of the
workpiece and not with the program; see `docs/files.md`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from manifold3d import Manifold, Mesh64

from vmachining.arrays import Ints
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import checked
from vmachining.engines.mesh.tiles import SIDES, Tile

RAW = -1


def packed_tiles(root: Tile, blocks: dict[int, int]) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Nodes of the tree in pre-order, and arrays by name. `blocks`: block of each run id."""
    arrays: dict[str, Any] = {}
    nodes: list[dict[str, Any]] = []

    def visit(tile: Tile) -> None:
        node: dict[str, Any] = {"box": tile.box.tolist(), "place": tile.place, "color": tile.color}
        node["halved"] = tile.halves is not None
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
    return nodes, arrays


def _alive(runs: Ints, owners: Ints) -> tuple[Ints, Ints]:
    """Runs of triangles that are not empty. A mesh remembers every block that ever cut it, by an empty run of those
    whose triangles are all gone."""
    keep = runs[1:] > runs[:-1]
    if not keep.any():
        return runs[[0, -1]], owners[:1]
    return np.append(runs[:-1][keep], runs[-1]), owners[keep]


def tiles_of(nodes: Sequence[Mapping[str, Any]], arrays: Mapping[str, Any]) -> tuple[Tile, dict[int, int]]:
    """The tree and the block of each run id, of what `packed_tiles` gave.

    Raises EngineError: A mesh in it is broken.
    """
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

    numbered = iter(enumerate(nodes))

    def build() -> Tile:
        k, node = next(numbered)
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
    return root, {run: block for block, run in ids.items() if block != RAW}
