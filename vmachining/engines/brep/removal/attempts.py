"""Ways of asking OCCT for the removed volume of a block: pure functions, all of them booleans of solids.

((S_0 and W_k) minus W_j) minus ..., with those earlier sweeps W_j that reach W_k. Tangent solids make some of these fail
that others get right, and nobody knows in advance which.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from vmachining.engines.brep.occt.booleans import apart, common, is_empty, minus
from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.primitives import oddly_turned
from vmachining.engines.brep.removal.gate import GROWTH_MM, Value
from vmachining.engines.brep.swept import solids
from vmachining.sweep import Sweep


class Task(NamedTuple):
    """A motion of a block.

    stock : TopoDS_Shape. sweep, parts : what it sweeps, and the solids whose union that is.
    earlier, cut : the sweeps that reach it, those that take most first, and the solids of each.
    """

    stock: Any
    sweep: Sweep
    parts: Sequence[Any]
    earlier: Sequence[Sweep]
    cut: Sequence[Sequence[Any]]

    @property
    def tools(self) -> list[Any]:
        """All solids to subtract."""
        return [part for each in self.cut for part in each]


Attempt: TypeAlias = Callable[[Task], Value]


def one_by_one(task: Task, fuzzy: float = 0.0) -> Value:
    """The stock first, then one earlier solid after the other. fuzzy : mm, OCCT may take points that close for one."""
    return Value(_cut(task.stock, task.parts, task.tools, fuzzy))


def rotated(task: Task) -> Value:
    """Everything turned by an odd angle first, so that no face is aligned with an axis."""
    parts, tools = ([oddly_turned(shape) for shape in shapes] for shapes in (task.parts, task.tools))
    return Value(_cut(oddly_turned(task.stock), parts, tools))


def stock_last(task: Task) -> Value:
    """Earlier solids leave the sweep first, the stock is met last."""
    total = 0.0
    for number, part in enumerate(task.parts):
        rest = _without(part, [*task.tools, *task.parts[:number]], 0.0)
        total += volume(rest if is_empty(rest) else common(rest, task.stock, 0.0))
    return Value(total)


def halves(task: Task) -> Value:
    """The motion in two halves, the second after the first."""
    first, second = (shapes(half) for half in task.sweep.split([0.5]))
    return Value(_cut(task.stock, first, task.tools) + _cut(task.stock, second, [*first, *task.tools]))


def grown(task: Task) -> Value:
    """Earlier sweeps of cutters that are larger by `GROWTH_MM`: tangent faces are apart then."""
    tools = []
    for sweep in task.earlier:
        larger = sweep.profile.scaled(1.0 + GROWTH_MM / sweep.profile.max_radius).shifted(-GROWTH_MM)
        tools += shapes(Sweep.along(larger, sweep.path))
    moved = GROWTH_MM * sum(_area(sweep) for sweep in task.earlier)
    return Value(_cut(task.stock, task.parts, tools), moved)


ATTEMPTS: Mapping[str, Attempt] = {
    "plain": one_by_one,
    "fuzzy 1e-05": partial(one_by_one, fuzzy=1e-5),
    "fuzzy 1e-04": partial(one_by_one, fuzzy=1e-4),
    "fuzzy 1e-03": partial(one_by_one, fuzzy=1e-3),
    "rotated": rotated,
    "stock last": stock_last,
    "halves": halves,
    "grown": grown,
}
"""By name, in the order they are made; blocks that each has won: `docs/measured/gate.md`."""


def shapes(sweep: Sweep) -> list[Any]:
    """TopoDS_Shapes whose union is a sweep.

    Raises SweepError, EngineError: It has none.
    """
    return [part.shape for part in solids(sweep)]


def _cut(stock: Any, parts: Sequence[Any], tools: Sequence[Any], fuzzy: float = 0.0) -> float:
    """mm^3 of the parts in the stock, without tools and without the parts before."""
    return sum(
        volume(_without(common(part, stock, fuzzy), [*tools, *parts[:number]], fuzzy))
        for number, part in enumerate(parts)
    )


def _without(rest: Any, tools: Sequence[Any], fuzzy: float) -> Any:
    for tool in tools:
        if is_empty(rest):
            break
        if not apart(rest, tool):
            rest = minus(rest, [tool], fuzzy)
    return rest


def _area(sweep: Sweep) -> float:
    """mm^2, more than the surface that a growth of the cutter moves, times how far at most, in growths."""
    profile = sweep.profile
    stretch = 1.0 + float(np.abs(profile.points[:, 1]).max()) / profile.max_radius
    around = 2.0 * sweep.path.length * (2.0 * profile.max_radius + np.ptp(profile.points[:, 1]))
    return stretch * (profile.area + float(around))
