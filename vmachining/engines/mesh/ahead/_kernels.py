"""How far behind a straight motion can still remove something, by height."""

import numpy as np

from vmachining.engines.mesh.gap._kernels import ALONG
from vmachining.jit import leaf


@leaf
def rear_limits(seg, level, rise, bottom, top, low, step, out):
    """Least way along the heading of what a motion (level, rise) leaves a body of a meridian for.

    out (k,): for heights from `low` up, in steps; inf where there is nothing.
    """
    k = out.shape[0]
    size = (top - bottom) / k
    out[:] = np.inf
    for i in range(k):
        a, b = bottom + (i - 1e-9) * size, bottom + (i + 1 + 1e-9) * size
        least = np.inf
        for row in range(seg.shape[0]):
            z0, z1 = max(a, seg[row, 1]), min(b, seg[row, 3])
            if z0 > z1:
                continue
            narrow, wide, bend = np.inf, 0.0, np.inf
            for end in range(2):
                z = z0 if end == 0 else z1
                if seg[row, 6] > 0.0:
                    n_z = min(max((z - seg[row, 5]) / seg[row, 6], -1.0), 1.0)
                    n_r = np.sqrt(max(1.0 - n_z * n_z, 0.0))
                    r = seg[row, 4] + seg[row, 6] * n_r
                else:
                    n_r, n_z = seg[row, 7], seg[row, 8]
                    share = 1.0 if end == 1 else 0.0
                    if seg[row, 3] > seg[row, 1]:
                        share = (z - seg[row, 1]) / (seg[row, 3] - seg[row, 1])
                    r = seg[row, 0] + share * (seg[row, 2] - seg[row, 0])
                narrow, wide = min(narrow, r), max(wide, r)
                if n_r < 1e-9:
                    bend = min(bend, -np.inf if n_z * rise > 0.0 else np.inf)
                else:
                    bend = min(bend, -n_z * rise / (n_r * level))
            if seg[row, 6] > 0.0 and z0 <= seg[row, 5] <= z1:
                wide = seg[row, 4] + seg[row, 6]
            if bend <= 1.0 + 1e-9:
                bend = min(max(bend - 1e-9, -1.0), 1.0)
                least = min(least, bend * (wide if bend < 0.0 else narrow))
        if least == np.inf:
            continue
        for j in range(k):  # from which part of the way can a height be reached?
            c, d = low + (j - 1e-9) * step, low + (j + 1 + 1e-9) * step
            first, last = 0.0, 1.0
            if rise != 0.0:
                s, t = (c - b) / rise, (d - a) / rise
                if rise < 0.0:
                    s, t = (d - a) / rise, (c - b) / rise
                first, last = max(s, 0.0), min(t, 1.0)
            elif d < a or c > b:
                continue
            if first <= last:
                out[j] = min(out[j], least + first * level)


@leaf
def front_limits(points, triangles, normals, first, boxes, d, low, step, out):
    """Lower the limits of `rear_limits` to those of the facets: what they leave where they have been, moved by d.

    In the frame of the cutter the heading is +x; a cluster that begins behind no limit has nothing to tell.
    """
    k = out.shape[0]
    level, rise = np.hypot(d[0], d[1]), d[2]
    along = ALONG * np.hypot(level, rise)
    for c in range(boxes.shape[0]):
        z0, z1 = boxes[c, 0, 2] + min(rise, 0.0), boxes[c, 1, 2] + max(rise, 0.0)
        j0, j1 = int(np.floor((z0 - low) / step - 1e-9)), int(np.floor((z1 - low) / step + 1e-9))
        tells = False
        for j in range(max(j0, 0), min(j1, k - 1) + 1):
            tells = tells or boxes[c, 0, 0] < out[j]
        if not tells:
            continue
        for t in range(first[c, 0], first[c + 1, 0]):
            if normals[t, 0] * level + normals[t, 2] * rise <= along:
                continue
            u, v, w = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
            least = min(u[0], v[0], w[0])
            z0, z1 = min(u[2], v[2], w[2]) + min(rise, 0.0), max(u[2], v[2], w[2]) + max(rise, 0.0)
            j0, j1 = int(np.floor((z0 - low) / step - 1e-9)), int(np.floor((z1 - low) / step + 1e-9))
            for j in range(max(j0, 0), min(j1, k - 1) + 1):
                out[j] = min(out[j], least)
