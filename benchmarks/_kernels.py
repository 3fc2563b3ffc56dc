# A Z-map as the analytic engagement is compared with it in the literature: heights on a square grid, the edge in elements.

import numpy as np

from vmachining.jit import kernel, leaf


@leaf
def element(held, s, step, lower, upper, many, row, was):
    """Book an element from s to s + step in the intervals of a row; whether it is in the material."""
    if held:
        n = many[row]
        if was:
            if n <= lower.shape[1]:
                upper[row, n - 1] = s + step
        else:
            if n < lower.shape[1]:
                lower[row, n] = s
                upper[row, n] = s + step
            many[row] = n + 1
    return held


@kernel
def zmap_intervals(
    tip, frame, velocity, sin, cos, rm, r, flute, x0, y0, pitch, heights, highest, lower, upper, many
) -> None:
    """Engaged intervals of the edge at every position and angle: elements of `pitch` mm whose middle is below its cell.

    tip (n, 3), frame (n, 3, 3), velocity (n, 3); sin, cos (m,) of phi. heights (a, b): of square cells from (x0, y0).
    lower, upper (n m, k) mm of s, NaN behind the last; many (n m,), zero. Only what faces the feed is looked at, and nothing
    above the highest cell.
    """
    inverse = 1.0 / pitch
    a_cells, b_cells = heights.shape
    for i in range(len(tip)):
        wx, wy, wz = frame[i, 0, 2], frame[i, 1, 2], frame[i, 2, 2]
        sink = velocity[i, 0] * wx + velocity[i, 1] * wy + velocity[i, 2] * wz
        for j in range(len(sin)):
            row = i * len(sin) + j
            ex = sin[j] * frame[i, 0, 0] + cos[j] * frame[i, 0, 1]
            ey = sin[j] * frame[i, 1, 0] + cos[j] * frame[i, 1, 1]
            ez = sin[j] * frame[i, 2, 0] + cos[j] * frame[i, 2, 1]
            along = velocity[i, 0] * ex + velocity[i, 1] * ey + velocity[i, 2] * ez
            first, last = 0.0, 0.5 * np.pi
            if along > 0.0:
                if sink > 0.0:
                    first = np.arctan2(sink, along)
            elif sink < 0.0:
                last = np.arctan2(-sink, -along)
            else:
                last = 0.0
            if r > 0.0 and last > first:
                n = int(np.ceil((last - first) * r * inverse))
                step = (last - first) / n
                s, c = np.sin(first + 0.5 * step), np.cos(first + 0.5 * step)
                ds, dc = np.sin(step), np.cos(step)
                ox, oy, oz = (
                    tip[i, 0] + rm * ex + r * wx,
                    tip[i, 1] + rm * ey + r * wy,
                    tip[i, 2] + rm * ez + r * wz,
                )
                was = False
                for k in range(n):
                    x, y = ox + r * (s * ex - c * wx), oy + r * (s * ey - c * wy)
                    a, b = int((x - x0) * inverse), int((y - y0) * inverse)
                    held = x >= x0 and y >= y0 and a < a_cells and b < b_cells
                    if held:
                        held = oz + r * (s * ez - c * wz) <= heights[a, b]
                    was = element(held, r * (first + k * step), r * step, lower, upper, many, row, was)
                    s, c = s * dc + c * ds, c * dc - s * ds
            if along > 0.0 and flute > 0.0:
                big = rm + r
                x, y, z = (
                    tip[i, 0] + big * ex + r * wx,
                    tip[i, 1] + big * ey + r * wy,
                    tip[i, 2] + big * ez + r * wz,
                )
                top = min(flute, (highest - z) / wz)
                n = int(np.ceil(top * inverse))
                if n > 0:
                    step = top / n
                    x, y, z = x + 0.5 * step * wx, y + 0.5 * step * wy, z + 0.5 * step * wz
                    was = False
                    for k in range(n):
                        a, b = int((x - x0) * inverse), int((y - y0) * inverse)
                        held = x >= x0 and y >= y0 and a < a_cells and b < b_cells
                        if held:
                            held = z <= heights[a, b]
                        was = element(held, r * 0.5 * np.pi + k * step, step, lower, upper, many, row, was)
                        x, y, z = x + step * wx, y + step * wy, z + step * wz
            for k in range(many[row], lower.shape[1]):
                lower[row, k] = np.nan
                upper[row, k] = np.nan


@kernel
def zmap_lowered(tip, frame, rm, r, x0, y0, pitch, heights) -> None:
    """Lower a Z-map under the tool at every position, as its owner must before it can be asked about the next pass.

    Every cell in the box around the tool is looked at. The upright line through its middle enters the tool where its
    distance to the rod with a round bottom, which is convex along the line, is zero: Newton's method from the plane of the
    bottom disc stays below that height, so it ends as soon as it is above the cell.
    """
    a_cells, b_cells = heights.shape
    highest = heights.max()
    big = rm + r
    for i in range(len(tip)):
        kx, ky, kz = frame[i, 2, 0], frame[i, 2, 1], frame[i, 2, 2]
        wx, wy = frame[i, 0, 2], frame[i, 1, 2]
        pad = big + max(highest - tip[i, 2], 0.0) * np.sqrt(wx * wx + wy * wy) / kz
        a0, a1 = int((tip[i, 0] - pad - x0) / pitch), int((tip[i, 0] + pad - x0) / pitch) + 1
        b0, b1 = int((tip[i, 1] - pad - y0) / pitch), int((tip[i, 1] + pad - y0) / pitch) + 1
        for a in range(max(a0, 0), min(a1, a_cells)):
            dx = x0 + (a + 0.5) * pitch - tip[i, 0]
            for b in range(max(b0, 0), min(b1, b_cells)):
                dy = y0 + (b + 0.5) * pitch - tip[i, 1]
                h0 = dx * wx + dy * wy
                top = heights[a, b] - tip[i, 2]
                z = -h0 / kz
                if z >= top:
                    continue
                px = dx * frame[i, 0, 0] + dy * frame[i, 1, 0]
                py = dx * frame[i, 0, 1] + dy * frame[i, 1, 1]
                for _ in range(30):
                    qx, qy, h = px + z * kx, py + z * ky, h0 + z * kz
                    rho = np.sqrt(qx * qx + qy * qy)
                    if rho <= rm and h <= 1e-9:
                        break
                    rise = (qx * kx + qy * ky) / max(rho, 1e-300)
                    out, below = rho - rm, r - h
                    if below <= 0.0:
                        gap, slope = rho - big, rise
                    else:
                        aside = max(out, 0.0)
                        away = np.sqrt(aside * aside + below * below)
                        gap, slope = away - r, (aside * rise - below * kz) / max(away, 1e-300)
                    if gap <= 1e-9:
                        break
                    if slope >= 0.0:
                        z = top
                        break
                    z -= gap / slope
                    if z >= top:
                        break
                if z < top:
                    heights[a, b] = tip[i, 2] + z
