"""Engines: stock minus sweeps, each with its own kernel, so that each can referee the others.

| engine | stock is | kernel |
|---|---|---|
| `mesh` | three closed triangle meshes per tile | manifold3d |
| `brep` | read from STEP; the oracle itself comes later | OCCT |

Engines never import each other.
"""
