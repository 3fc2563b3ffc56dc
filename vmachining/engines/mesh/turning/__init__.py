"""Sweeps of a tool whose axis turns, as closed meshes that lie inside, around or on the truth.

The engine cuts by hulls of neighbouring poses (`hulls.py`, proven on both sides) wherever they are few. What follows is for
the rest, for whole sweeps and for unbiased meshes.

Goal: second order in space and time, rigorous on the inside, at the cost of a straight sweep's few pieces.

Symbols: K the convex body, K(t) its pose, T_t the rigid motion that makes it; u angle about the axis, x place
on the meridian; P(u, x, t) the surface point and f its velocity along the outward normal N.

1. A point of the sweep that K(0) does not hold is entered through the surface, at a point with f > 0. So
   sweep = K(0) + P(front), front = {(u, x, t): f > 0}, and P keeps its orientation there (det dP = f dA).
2. f = c + a cos u + b sin u on every circle, a closed form. Its zeros on the edges of a grid in (u, x, t) give
   the boundary of `front` as marching cells do: closed and oriented whatever loops, chords or arcs appear,
   merge or vanish inside the block. A sharp edge is one circle with two normals; tips and edges are cells
   that collapse. P takes the vertices to the envelope, exactly where they lie on an instant of the grid.
3. Closed at t = 1 by the front part of K(1), at t = 0 by the rest of K(0), that is one mesh for K(0) + P(front)
   if no point is entered twice (`chained`: by the cone of 4). It is used when no facet of the envelope faces
   against N: where one does, the envelope runs inside the sweep (phi_tt < 0), as under nearly every flat face
   that tilts.
4. Otherwise the block is cut in time so that nothing moves farther than half the radius, and each part is
   P(front) closed by the cone from a point of the axis over the grazing curve of its first instant. With
   K(0) as a piece of its own their union is the sweep; what is entered twice merely overlaps. After a block
   that ended at this pose K(0) is left out (`chained`).

Inside, proved: every facet joins points of K(t_j) and K(t_j+1) of one cell, so a point of it is
(1 - s) T_j p + s T_j+1 q with p, q in K. With o = (1 - s) p + s q its distance to T_t o is at most

    e = dt^2/8 max|d2(T_t o)/dt2| + s (1 - s) |T_j - T_j+1| |p - q| <= dt^2/8 b2 + angle |p - q| / 4

(o is in K, |p - q| at most the diagonal of a cell). The mesh can thus be drawn, moving by at most e, onto a
closed surface that is the image of one in the convex set K x [0, 1]; that shrinks to a point inside the
sweep. Hence a point farther than e from the sweep is outside the mesh, whatever f, and a body narrowed by e
gives a mesh inside the sweep: `inner`. No fold, no missed chord and no wrong sign of f can break this.

Around: a body grown by e and by the depth of its facets enters each point of the true sweep and gets deeper
than the mesh's distance from its own envelope, so its mesh winds round that point: `outer`. This half is not
a proof where a point is entered twice within one part: there the envelope folds inside the sweep, and beside
a fold the mesh may leave crevices of the order of f^2, 2e-5 mm wide where they were measured. One part is used
for a block only if no facet faces the wrong way; in several parts the way is short. Facets of a grown body fold
by themselves, if by little, and a chained block leaves out a layer beside the grazing curve of its first
instant; so nothing that is cut by these meshes is called proven (docs/measured/turning_proof.md).

| file | holds |
|---|---|
| `hulls.py` | `turning_hulls`: hulls of neighbouring poses, proven |
| `pieces.py` | `turning_pieces`: steps, offsets, parts in time |
| `rows.py` | circles of a body, moved inward or outward |
| `_kernels.py` | marching cells of the front and its closures |

Source: front, grazing curve and the sign of phi_tt from the theory of swept volumes (envelope condition
N . V = 0); the grid in parameter space and the bound are derived here. Departure: no grazing loop is ever
traced or trimmed.

Known limits: what is entered twice within one part overlaps itself, so that its volume counts twice (up to 3e-6
of the sweep in the reference rows) and crevices may stay in `outer`; both are found where a flat face that
tilts meets its rim, mostly at the top of a cutter. Every convex piece of a profile is swept alone; `inner`
pieces may leave a gap of 2 e between them.
"""

from vmachining.engines.mesh.turning.pieces import turning_pieces

__all__ = ["turning_pieces"]
