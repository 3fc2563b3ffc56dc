"""Facets of a cutter, turned to the heading of a motion and put where it is.

Legend
    cos, sin      turn of the cutter about its axis, to the heading
    p (3,)        start of the tip                  d (3,)        displacement
"""

from vmachining.jit import leaf


@leaf
def put(point, cos, sin, p, out):
    """Where a point of the cutter is, into `out` (3,)."""
    out[0] = p[0] + cos * point[0] - sin * point[1]
    out[1] = p[1] + sin * point[0] + cos * point[1]
    out[2] = p[2] + point[2]


@leaf
def toward(normal, cos, sin, d):
    """n . d of a facet."""
    return (
        (cos * normal[0] - sin * normal[1]) * d[0]
        + (sin * normal[0] + cos * normal[1]) * d[1]
        + normal[2] * d[2]
    )


@leaf
def extent(box, i, cos, sin, p, d):
    """Lowest and highest place along axis i of what facets in a box (2, 3) of the cutter sweep."""
    middle, half = 0.5 * (box[0, 2] + box[1, 2]), 0.5 * (box[1, 2] - box[0, 2])
    if i < 2:
        mid_x, mid_y = 0.5 * (box[0, 0] + box[1, 0]), 0.5 * (box[0, 1] + box[1, 1])
        half_x, half_y = box[1, 0] - mid_x, box[1, 1] - mid_y
        if i == 0:
            middle, half = cos * mid_x - sin * mid_y, abs(cos) * half_x + abs(sin) * half_y
        else:
            middle, half = sin * mid_x + cos * mid_y, abs(sin) * half_x + abs(cos) * half_y
    return p[i] + middle - half + min(d[i], 0.0), p[i] + middle + half + max(d[i], 0.0)
