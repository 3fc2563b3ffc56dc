"""Supports of a convex body of revolution, and how high its surface is over facets inside it.

Legend
    seg           meridian of the true cutter, rows (r0, z0, r1, z1, cr, cz, R, ...); R = 0 is a line
    n (3,)        unit normal of a facet
    most, mean (m,)   mm, largest and mean distance from a facet to the true cutter along its normal
    bulk (m,)     mm^3, bound of the integral of that distance, by tangents of at most the
    slope (m, 2)  in the directions of `across`
    plumb (m,)    mm, height of a facet of a cylinder, 0 for others
    cos, sin, d   of sweeps, as in the kernels of straight ones
    lift (3,)     mm, mean distance of the true path from the straight one
"""

import numpy as np

from vmachining.engines.mesh.clusters._kernels import toward
from vmachining.jit import kernel, leaf
from vmachining.sweep._kernels import meridian

ALONG = 1e-12
"""A facet whose normal is that square to the motion lies along it: it stays, with all others in its plane. Did rounding
decide, neighbours would part, and the mesh would fold over itself."""

PARTS = 3  # of the edges of a facet, for the integral over it


@leaf
def support(seg, n_r, n_z):
    """Largest r n_r + z n_z of a convex meridian, n_r >= 0."""
    best = -np.inf
    for i in range(seg.shape[0]):
        best = max(best, seg[i, 0] * n_r + seg[i, 1] * n_z, seg[i, 2] * n_r + seg[i, 3] * n_z)
        if seg[i, 6] > 0.0:
            a_r, a_z = seg[i, 0] - seg[i, 4], seg[i, 1] - seg[i, 5]
            b_r, b_z = seg[i, 2] - seg[i, 4], seg[i, 3] - seg[i, 5]
            if a_r * n_z - a_z * n_r >= 0.0 and n_r * b_z - n_z * b_r >= 0.0:
                size = np.sqrt(n_r * n_r + n_z * n_z)
                best = max(best, seg[i, 4] * n_r + seg[i, 5] * n_z + seg[i, 6] * size)
    return best


@leaf
def across(n_x, n_y, n_z):
    """Two directions in the plane with normal n: a level one, and the one that rises most."""
    size = np.sqrt(n_x * n_x + n_y * n_y)
    if size < 1e-9:
        return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0
    x, y = -n_y / size, n_x / size
    return x, y, 0.0, -n_z * y, n_z * x, n_x * y - n_y * x


@leaf
def _rise(x, y, z, n, seg, most):
    """From a point of a facet along its normal to the surface, and the slopes there (`_across`); by Newton."""
    s = 0.0
    for _ in range(30):
        q_x, q_y, q_z = x + s * n[0], y + s * n[1], z + s * n[2]
        rho = np.sqrt(q_x * q_x + q_y * q_y)
        gap, n_r, n_z = meridian(seg, 0, seg.shape[0], rho, q_z)
        n_x, n_y = (n_r * q_x / rho, n_r * q_y / rho) if rho > 0.0 else (0.0, 0.0)
        up = n_x * n[0] + n_y * n[1] + n_z * n[2]
        step = -gap / max(up, 0.5)
        s = min(max(s + step, 0.0), most)
        if abs(step) <= 1e-12:
            a_x, a_y, a_z, b_x, b_y, b_z = across(n[0], n[1], n[2])
            up = max(up, 1e-3)
            return (
                s,
                abs(n_x * a_x + n_y * a_y + n_z * a_z) / up,
                abs(n_x * b_x + n_y * b_y + n_z * b_z) / up,
            )
    return most, np.inf, np.inf


@kernel
def gauge(points, triangles, normals, seg, most, mean, bulk, slope, plumb):
    """Fill what is known about the gap between the facets of a polyhedron and the body of a meridian around it.

    The mean is a quadrature of second degree (the gap is quadratic to leading order). The bulk is a bound of the
    integral: the gap is concave, so that of a triangle is at most its area times the gap over its centroid; of
    PARTS^2 small ones. slope (m, 2): the largest at those places. plumb: the height of a triangle on a cylinder.
    """
    for t in range(triangles.shape[0]):
        n = normals[t]
        a, b, c = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
        top = support(seg, np.sqrt(n[0] * n[0] + n[1] * n[1]), n[2])
        reach = max(n[0] * a[0] + n[1] * a[1] + n[2] * a[2], n[0] * b[0] + n[1] * b[1] + n[2] * b[2])
        reach = max(reach, n[0] * c[0] + n[1] * c[1] + n[2] * c[2])
        most[t] = max(0.0, top - reach)
        total = 0.0
        for k in range(3):
            w_a = 2.0 / 3.0 if k == 0 else 1.0 / 6.0
            w_b = 2.0 / 3.0 if k == 1 else 1.0 / 6.0
            w_c = 2.0 / 3.0 if k == 2 else 1.0 / 6.0
            q = w_a * a + w_b * b + w_c * c
            total += _rise(q[0], q[1], q[2], n, seg, most[t])[0] / 3.0
        mean[t] = total
        total = 0.0
        slope[t] = 0.0
        for i in range(PARTS):
            for j in range(2 * (PARTS - i) - 1):
                # the triangles between two lines across: upright ones, and the overturned ones between them
                w_a = (i + (1.0 if j % 2 == 0 else 2.0) / 3.0) / PARTS
                w_b = (j // 2 + (1.0 if j % 2 == 0 else 2.0) / 3.0) / PARTS
                q = w_a * a + w_b * b + (1.0 - w_a - w_b) * c
                gap, level, steep = _rise(q[0], q[1], q[2], n, seg, most[t])
                total += gap
                slope[t, 0], slope[t, 1] = max(slope[t, 0], level), max(slope[t, 1], steep)
        bulk[t] = 0.5 * np.linalg.norm(np.cross(b - a, c - a)) * (total / PARTS**2 + 1e-12)
        low, high = min(a[2], b[2], c[2]), max(a[2], b[2], c[2])
        plumb[t] = 0.0
        for i in range(seg.shape[0]):
            upright = n[2] == 0.0 and seg[i, 6] == 0.0 and seg[i, 0] == seg[i, 2]
            if upright and seg[i, 1] <= low and high <= seg[i, 3]:
                plumb[t] = high - low


@leaf
def _least(seg, n, c, x, q):
    """Least h(n + q c) - q x over q: how far the shadow rises over a place x. Convex in q, which is where to begin."""
    low, high = q - 1.0, q + 1.0
    best, at = np.inf, q
    for _ in range(40):
        one, two = low + 0.382 * (high - low), low + 0.618 * (high - low)
        first, second = _line(seg, n, c, x, one), _line(seg, n, c, x, two)
        if first <= second:
            high = two
            if first < best:
                best, at = first, one
        else:
            low = one
            if second < best:
                best, at = second, two
    return best, at


@leaf
def _line(seg, n, c, x, q):
    """Where the line that supports the shadow in direction n + q c meets the normal n over a place x along c."""
    u, v, w = n[0] + q * c[0], n[1] + q * c[1], n[2] + q * c[2]
    return support(seg, np.sqrt(u * u + v * v), w) - q * x


@leaf
def shadow_gap(seg, reach, a, b, n, c):
    """From the edge a b (3,) along n to the true cutter's shadow: mean, a bound of it, slope of its tangents.

    reach: of the edge along n, c (3,): unit vector in the plane of the shadow, across n. Near the point of contact of
    the tangent with normal n the shadow is usually a parabola of radius h + h'', h its support over the angle. It
    is convex, so in the mean it is below lines over the middles of equal parts that support it anywhere.
    """
    h = support(seg, np.sqrt(n[0] * n[0] + n[1] * n[1]), n[2])
    gap = max(0.0, h - reach)
    step = 1e-3
    cos, tan = np.cos(step), np.tan(step)
    more, less = cos * _line(seg, n, c, 0.0, tan), cos * _line(seg, n, c, 0.0, -tan)
    slope = (more - less) / (2.0 * step)  # h', the place of contact along c
    radius = h + (more - 2.0 * h + less) / (step * step)
    from_, to = 0.0, 0.0
    for i in range(3):
        from_ += c[i] * a[i]
        to += c[i] * b[i]
    x, y = from_ - slope, to - slope
    bound, steep, round_ = 0.0, 0.0, radius > 1e-6
    if round_:
        for k in range(PARTS):
            middle = from_ + (to - from_) * (k + 0.5) / PARTS
            q = (middle - slope) / radius
            value = _line(seg, n, c, middle, q) - reach
            round_ = round_ and abs(value - gap + 0.5 * q * (middle - slope)) <= 0.02 * gap
            bound, steep = bound + value / PARTS, max(steep, abs(q))
    if round_:
        mean = gap - (x * x + x * y + y * y) / (6.0 * radius)
    else:  # an edge of the cutter, or a cone
        bound, steep = 0.0, 0.0
        for k in range(2 * PARTS):
            middle = from_ + (to - from_) * (k + 0.5) / (2 * PARTS)
            value, q = _least(seg, n, c, middle, 0.0)
            bound, steep = bound + (value - reach) / (2 * PARTS), max(steep, abs(q))
        mean = bound
    bound = min(max(bound, 0.0) + 1e-12, gap)
    return min(max(mean, 0.0), bound), bound, steep


@leaf
def strip(seg, u, v, d, n):
    """Of the parallelogram v, u, u + d, v + d, from the start: area, distance, gap to the truth.

    Its outward normal goes into n (3,). Along the motion an edge has no normal and no area.
    """
    e_x, e_y, e_z = u[0] - v[0], u[1] - v[1], u[2] - v[2]
    n[0], n[1], n[2] = e_y * d[2] - e_z * d[1], e_z * d[0] - e_x * d[2], e_x * d[1] - e_y * d[0]
    area = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    far = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) * (abs(e_x) + abs(e_y) + abs(e_z))
    if area <= 1e-12 * far:
        return 0.0, 0.0, 0.0
    for i in range(3):
        n[i] /= area
    reach = max(n[0] * u[0] + n[1] * u[1] + n[2] * u[2], n[0] * v[0] + n[1] * v[1] + n[2] * v[2])
    return area, reach, max(0.0, support(seg, np.sqrt(n[0] * n[0] + n[1] * n[1]), n[2]) - reach)


@leaf
def along_shadow(n, d, length, c):
    """d x n, into c (3,): runs along an edge with normal n in the plane across d."""
    c[0] = (d[1] * n[2] - d[2] * n[1]) / length
    c[1] = (d[2] * n[0] - d[0] * n[2]) / length
    c[2] = (d[0] * n[1] - d[1] * n[0]) / length


@kernel
def facet_means(points, normals, edges, mean, seg, cos, sin, d, lift, source):
    """Mean distance (k,) of the truth from facets of a sweep: source (k,) tells which they are, see `swept_facets`."""
    out = np.zeros(source.shape[0])
    _fill_means(points, normals, edges, mean, seg, cos, sin, d, lift, source, np.empty((4, 3)), out)
    return out


@leaf
def _fill_means(points, normals, edges, mean, seg, cos, sin, d, lift, source, work, out):
    """The same, into `out`, which is zero."""
    m = normals.shape[0]
    u, v, n, c = work[0], work[1], work[2], work[3]
    length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    for k in range(source.shape[0]):
        if source[k] < 0:
            continue
        if k > 0 and source[k] == source[k - 1]:
            out[k] = out[k - 1]
            continue
        e = source[k] - m
        t = edges[e, 3] if e >= 0 else source[k]
        n[0] = cos * normals[t, 0] - sin * normals[t, 1]
        n[1] = sin * normals[t, 0] + cos * normals[t, 1]
        n[2] = normals[t, 2]
        if e < 0:
            gap = mean[t]
        else:
            right = toward(normals[t], cos, sin, d) > ALONG * length
            q, r = points[edges[e, 0 if right else 1]], points[edges[e, 1 if right else 0]]
            u[0], u[1], u[2] = cos * q[0] - sin * q[1], sin * q[0] + cos * q[1], q[2]
            v[0], v[1], v[2] = cos * r[0] - sin * r[1], sin * r[0] + cos * r[1], r[2]
            area, reach, _ = strip(seg, u, v, d, n)
            if area == 0.0:
                continue
            along_shadow(n, d, length, c)
            gap = shadow_gap(seg, reach, v, u, n, c)[0]
        out[k] = max(0.0, gap + n[0] * lift[0] + n[1] * lift[1] + n[2] * lift[2])
