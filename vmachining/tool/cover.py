"""Convex pieces grown into each other, so that a union of signed distances has no seams."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from vmachining.tool.profile import Profile, Segment


@lru_cache(maxsize=256)
def convex_cover(profile: Profile) -> tuple[Profile, ...]:
    """Convex bodies whose union is the body and whose interiors overlap across every split.

    Each run of `profile.convex_pieces()` is prolonged along its end tangents as far as it stays inside its
    neighbours. A union of signed distances then has no false zero on the discs between the runs.


    Where the meridian turns outward, the tangent of either side continues inside the other one; at a step
    only the narrower side continues into the wider one. The neighbour's radius is a concave function of z,
    so radius minus tangent has at most one sign change, and a bisection finds how far the tangent is good.
    """
    pieces = profile.convex_pieces()
    out = []
    for k, piece in enumerate(pieces):
        segments = list(piece.segments)
        if k + 1 < len(pieces):
            top = _prolong(segments[-1], pieces[k + 1], up=True)
            segments += [top] if top else []
        if k > 0:
            bottom = _prolong(segments[0], pieces[k - 1], up=False)
            segments = ([bottom] if bottom else []) + segments
        out.append(Profile.of(segments))
    return tuple(out)


def _prolong(s: Segment, host: Profile, *, up: bool) -> Segment | None:
    """Line that continues a segment's end into `host`, or None where it leaves it at once."""
    r, z = (s.r1, s.z1) if up else (s.r0, s.z0)
    beta = s.beta[1 if up else 0]
    if np.cos(beta) < 1e-6 or r > float(host.radius_at(z)) * (1.0 + 1e-12):
        return None  # a horizontal end has no height to grow; the wider side of a step has no room to
    slope = -float(np.tan(beta))  # dr/dz
    far = host.z_max if up else host.z_min

    def fits(height: float) -> bool:
        line = r + slope * (height - z)
        return 0.0 <= line <= float(host.radius_at(height))

    good, bad = z, far
    if fits(far):
        good = far
    else:
        for _ in range(60):
            middle = 0.5 * (good + bad)
            good, bad = (middle, bad) if fits(middle) else (good, middle)
    if abs(good - z) < 1e-9 * max(1.0, abs(far - z)):
        return None
    end = max(r + slope * (good - z), 0.0)
    nan = float("nan")
    return Segment(r, z, end, good, nan, nan, 0.0) if up else Segment(end, good, r, z, nan, nan, 0.0)
