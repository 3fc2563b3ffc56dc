# Forces on the edge, and what follows from them over a turn and over the feed.
#
# Legend: blade and hits as in engagement/along/kernels/margin_kernels.py. motion (n, 5) per angle: V along right, ahead, axis of
#   the tool frame, rate of the axis along right and ahead, per unit of the block. powers (6, d + 1): Ktc Krc Kac Kte Kre
#   Kae over the height, highest power first. out (n, 10): force per chip scale a (3), of the edge b (3), in the tool
#   frame (right, ahead, axis), on the tool; torque a, b; tangential force a, b. The force at scale c is c a + b, with
#   chip thickness h = c max(0, N . V).
# sl, cl sine and cosine of lam, the elevation of the normal: N = sl e_r - cl w.

import numpy as np

from vmachining.engagement.along.kernels.margin_kernels import edge_point
from vmachining.jit import kernel, leaf

NOTHING = 1e-12  # of the speed: thinner chips do not count, and leave no edge force


@leaf
def horner(powers, row, z):
    """Value of one coefficient at a height."""
    out = powers[row, 0]
    for k in range(1, powers.shape[1]):
        out = out * z + powers[row, k]
    return out


@kernel
def edge_forces(blade, hits, phi, motion, powers, chi, spin, node, weight, heights, out) -> None:
    """Sums over the stretches of every angle; node, weight of a rule on [-1, 1]. heights (2,): lowest and highest met."""
    out[:] = 0.0
    k, total = np.empty(6), np.empty((2, 5))
    sc, cc = np.sin(chi), np.cos(chi)
    constant = powers.shape[1] == 1
    for q in range(6):
        k[q] = powers[q, powers.shape[1] - 1]
    for h in range(len(hits)):
        i, piece = int(hits[h, 0]), int(hits[h, 1])
        half, middle = 0.5 * (hits[h, 3] - hits[h, 2]), 0.5 * (hits[h, 3] + hits[h, 2])
        v = motion[i]
        speed = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        sp, cp = np.sin(phi[i]), np.cos(phi[i])
        q = blade.rows[piece]
        line, lag = q[6] == 0.0, blade.twist != 0.0
        r, z, n_r, n_z = edge_point(blade, piece, middle)
        rise = -n_z  # of the radius with s on a line
        beta = q[7] + (middle - blade.joints[piece]) / q[6] if not line else 0.0
        low, high = heights[0], heights[1]
        m_v, m_w = sp * v[0] + cp * v[1], sp * v[3] + cp * v[4]
        for part in range(2):
            for c in range(5):
                total[part, c] = 0.0
        for j in range(len(node)):
            if line:
                rho, height = r + rise * half * node[j], z + n_r * half * node[j]
            else:
                n_r, n_z = np.cos(beta + half * node[j] / q[6]), np.sin(beta + half * node[j] / q[6])
                rho, height = q[4] + q[6] * n_r, q[5] + q[6] * n_z
            if lag:
                sp, cp = np.sin(phi[i] - height * blade.twist), np.cos(phi[i] - height * blade.twist)
                m_v, m_w = sp * v[0] + cp * v[1], sp * v[3] + cp * v[4]
            g = n_r * m_v + n_z * v[2] + (height * n_r - rho * n_z) * m_w
            if g <= NOTHING * speed:
                continue
            size = half * weight[j]
            low, high = min(low, height), max(high, height)
            if not constant:
                for c in range(6):
                    k[c] = horner(powers, c, height)
            for part in range(2):
                scale = size * g if part == 0 else size
                ft, fr, fa = scale * k[3 * part], scale * k[3 * part + 1], scale * k[3 * part + 2]
                # components along e_t, e_r and the axis of -Ft c1 - Fa c2 + Fr c3
                t = spin * (-ft * cc + (fa * n_r + fr * n_z) * sc)
                e = fa * n_z - fr * n_r
                if lag:
                    total[part, 0] += t * cp + e * sp
                    total[part, 1] += e * cp - t * sp
                else:
                    total[part, 0] += t
                    total[part, 1] += e
                total[part, 2] += -ft * sc - fa * cc * n_r - fr * cc * n_z
                total[part, 3] -= spin * rho * t
                total[part, 4] += ft
        heights[0], heights[1] = low, high
        for part in range(2):
            t, e = total[part, 0], total[part, 1]
            out[i, 3 * part] += t if lag else t * cp + e * sp
            out[i, 3 * part + 1] += e if lag else e * cp - t * sp
            out[i, 3 * part + 2] += total[part, 2]
            out[i, 6 + part] += total[part, 3]
            out[i, 8 + part] += total[part, 4]


@kernel
def over_turn(order, phi, cutting, value, grid) -> float:
    """Integral over a turn of a value at angles in rising order, 0 where nothing cuts: Simpson's rule between jumps.

    Two angles closer than 1e-5 are the sides of a jump. grid: widest step that may lie within an arc.
    """
    total = 0.0
    n = len(order)
    start = 0
    for k in range(n):  # begin where an arc does
        if not cutting[order[k - 1]]:
            start = k
            break
    at = 0
    while at < n:
        i = order[(start + at) % n]
        j = order[(start + at + 1) % n]
        a = (phi[j] - phi[i]) % (2.0 * np.pi)
        if not (cutting[i] and cutting[j]) or a > grid:
            at += 1
            continue
        k = order[(start + at + 2) % n]
        b = (phi[k] - phi[j]) % (2.0 * np.pi)
        if at + 1 < n and a > 1e-5 and b > 1e-5 and b <= grid and cutting[k] and 0.05 < a / b < 20.0:
            w = a + b
            total += (
                w / 6.0 * ((2.0 - b / a) * value[i] + w * w / (a * b) * value[j] + (2.0 - a / b) * value[k])
            )
            at += 2
        else:
            h = order[(start + at - 1) % n]
            c = (phi[i] - phi[h]) % (2.0 * np.pi)
            if (
                at > 0 and cutting[h] and c > 1e-5 and a > 1e-5 and c <= grid and 0.05 < a / c < 20.0
            ):  # parabola
                total += a * (2.0 * a + 3.0 * c) / (6.0 * (a + c)) * value[j]
                total += a * (a + 3.0 * c) / (6.0 * c) * value[i] - a**3 / (6.0 * c * (a + c)) * value[h]
            else:
                total += 0.5 * a * (value[i] + value[j])
            at += 1
    return total


@kernel
def envelope(rows, top, out) -> int:
    """Rows p, q, r of which p f^2 + 2 q f + r is the largest somewhere in [0, top]; how many, in rising f."""
    n = len(rows)
    best = 0
    for i in range(1, n):
        a, b = rows[i], rows[best]
        if a[2] > b[2] or (a[2] == b[2] and (a[1] > b[1] or (a[1] == b[1] and a[0] > b[0]))):
            best = i
    f, count = 0.0, 0
    while True:
        out[count] = rows[best]
        count += 1
        if count == len(out):
            return count
        b = rows[best]
        first, steep, winner = top, -np.inf, -1
        for i in range(n):
            p, q, r = rows[i, 0] - b[0], rows[i, 1] - b[1], rows[i, 2] - b[2]
            # smallest root above f at which the difference rises
            at = np.inf
            if p == 0.0:
                if q > 0.0:
                    at = -r / (2.0 * q)
            else:
                d = q * q - p * r
                if d > 0.0:
                    at = (-q + np.sqrt(d)) / p  # the root where p f^2 + 2 q f + r rises
            if at <= f or not at < top:
                continue
            slope = 2.0 * (p * at + q)
            if slope > 0.0 and (at < first or (at == first and slope > steep)):
                first, steep, winner = at, slope, i
        if winner < 0:
            return count
        f, best = first, winner


@kernel
def feasible(rows, first, last, level, out) -> None:
    """Largest x of every part at which its rows p x^2 + 2 q x + r, first to last, stay below its level; 0 if none, inf
    in air."""
    for k in range(len(first)):
        best = np.inf
        for i in range(first[k], last[k]):
            p, q, r = rows[i, 0], rows[i, 1], rows[i, 2] - level[k]
            if r >= 0.0:
                best = 0.0
                break
            if p > 0.0:
                root = np.sqrt(q * q - p * r)
                best = min(best, -r / (q + root) if q >= 0.0 else (root - q) / p)
            elif q > 0.0:
                best = min(best, -r / (2.0 * q))
        out[k] = best


@kernel
def peaks(rows, first, last, x, out) -> None:
    """Largest p x^2 + 2 q x + r of the rows of every part at its x; 0 in air."""
    for k in range(len(first)):
        best = 0.0
        for i in range(first[k], last[k]):
            best = max(best, (rows[i, 0] * x[k] + 2.0 * rows[i, 1]) * x[k] + rows[i, 2])
        out[k] = best
