"""How narrow a bracket is requested, of a block and of what several processes each find of it."""

from __future__ import annotations

from vmachining.engines.columns._kernels import Goal, part_of
from vmachining.engines.protocol import Removal


def goal_of(relative: float, absolute: float, share: float = 1.0) -> Goal:
    r"""What one of those that cut a block together has to reach, so that the sum is as narrow as was asked.

    relative, absolute : of the whole block: its width is to be at most max(relative * volume, absolute), mm^3.
    share : part of the block's tiles that are its own; those of all add up to 1.

    With $w$ = relative times its own volume, $A$ = absolute, $s$ = share: $g = max(w - A (1 - s) / 2, (w + s A) / 2)$. The sum is
    at most max(sum w, A): where all take the second, it is half the sum of both; where one takes the first, the others
    are at most $(w + s A) / 2$ each or $w$, and it has left room for all their $s A / 2$. Where $s = 1$ it is max(w, A).
    """
    return part_of(Goal(relative, 0.0, 0.0, absolute), share)


def judged(found: Removal, relative: float, absolute: float) -> Removal:
    """A block as it is reported: its note says that it is wider than was requested and why, or nothing."""
    if found.width <= max(absolute, relative * found.estimate):
        return found._replace(note=None)
    asked = f"{100.0 * relative:.3g} % or {absolute:.3g} mm3"
    share = 100.0 * found.width / found.estimate if found.estimate > 0.0 else 100.0
    return found._replace(
        note=f"removed volume known to {share:.3g} %, not to {asked} as requested: {found.note}"
    )
