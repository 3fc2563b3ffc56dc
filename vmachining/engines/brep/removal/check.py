"""One block after the other: solids, judges, attempts, gate. Stateless between blocks but for solids that are kept."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from vmachining.engines.brep.blank import shape_of
from vmachining.engines.brep.occt.booleans import box_of
from vmachining.engines.brep.removal.attempts import ATTEMPTS, Attempt, Task, shapes
from vmachining.engines.brep.removal.gate import Status, Value, Verdict, error_of
from vmachining.engines.brep.removal.store import NOTHING_KEPT, Store
from vmachining.engines.judges import Judge, in_words, intersection
from vmachining.errors import EngineError, SweepError
from vmachining.stock import Blank
from vmachining.sweep import Sweep
from vmachining.sweep.near import SweepIndex
from vmachining.sweep.reach import meets, reaching

JUDGES, SOLIDS = "judges", "solids"
"""What is under way before any attempt."""

KEPT_SOLIDS = 300
"""Sweeps whose solids are remembered."""


class Witness(Protocol):
    """A further judge, asked where and when the block is checked. It travels to other processes as a pickle.

    name : under which it speaks.
    """

    name: str

    def __call__(self, block: int, again: bool) -> Judge:
        """What it says of a block. again : its first word is disputed; with other and more evidence."""
        ...


class BlockChecker:
    """The blocks of one program against one stock.

    stock : Blank
    blocks : what every block sweeps, in program order; an empty one removes nothing.
    store : of solids, for this stock and these blocks.
    witness : asked beside the judges of every block.
    """

    def __init__(
        self,
        stock: Blank,
        blocks: Sequence[Sequence[Sweep]],
        store: Store = NOTHING_KEPT,
        witness: Witness | None = None,
    ) -> None:
        self._stock = shape_of(stock)
        self._box = box_of(self._stock)
        self._sweeps = [reaching(sweep, self._box) for block in blocks for sweep in block]
        self._first = np.cumsum([0, *(len(block) for block in blocks)])
        self._index = SweepIndex(self._sweeps)
        self._store, self._witness = store, witness
        self._made: dict[int, list[Any] | SweepError | EngineError] = {}

    def warm(self) -> None:
        """Compile what blocks will need, so that no block pays for it with its time."""
        for sweep in {type(sweep.path): sweep for sweep in self._sweeps}.values():
            sweep.signed_distance(sweep.bounds)
            sweep.ray_intervals(sweep.bounds.mean(axis=0, keepdims=True), (0.0, 0.0, 1.0))

    def check(
        self, block: int, judges: Sequence[Judge] = (), attempts: Sequence[str] = tuple(ATTEMPTS)
    ) -> Verdict:
        """The verdict on a block.

        judges : who has judged already. attempts : names, in order.
        """
        *_, verdict = self.steps(block, judges, attempts)
        assert isinstance(verdict, Verdict)
        return verdict

    def steps(
        self, block: int, judges: Sequence[Judge], attempts: Sequence[str]
    ) -> Iterator[str | tuple[Judge, ...] | Verdict]:
        """What is under way: `JUDGES`, all of them once they have spoken, `SOLIDS`, and every attempt before it is made; at
        last the verdict."""
        yield (yield from self._judged(block, judges, attempts))

    def _judged(
        self, block: int, judges: Sequence[Judge], attempts: Sequence[str]
    ) -> Generator[str | tuple[Judge, ...], None, Verdict]:
        yield JUDGES
        judges = self._all_judges(block, judges)
        yield tuple(judges)
        verdict = partial(Verdict, judges=tuple(judges))
        truth = intersection(judges)
        if truth is None:
            return verdict(Status.DISPUTED, reason=f"{in_words(judges)}: at least one of them is wrong")
        yield SOLIDS
        try:
            tasks = self._tasks(block)
        except (SweepError, EngineError) as exc:
            return verdict(Status.REFUSED, reason=str(exc))
        used = sum(len(task.earlier) for task in tasks)
        reasons, tried = list[str](), list[tuple[str, float | None]]()
        for name in attempts:
            yield name
            try:
                value = _attempted(ATTEMPTS[name], tasks)
            except Exception as exc:  # OCCT raises whatever it meets
                text = (
                    str(exc)
                    if isinstance(exc, SweepError | EngineError)
                    else f"OCCT failed: {type(exc).__name__} {exc}"
                )
                reasons.append(f"{name}: {text}")
                tried.append((name, None))
                continue
            tried.append((name, value.volume))
            error = error_of(value, truth)
            if isinstance(error, float):
                number = list(ATTEMPTS).index(name) + 1
                status = Status.AGREED if number == 1 else Status.RETRIED
                volume = max(value.volume, 0.0)
                return verdict(status, volume, error, name, number, sweeps=used, tried=tuple(tried))
            reasons.append(f"{name}: {error}")
            if not tasks:
                break  # no boolean is asked, so no other one is either
        return verdict(Status.REFUSED, reason=_joined(reasons), sweeps=used, tried=tuple(tried))

    def _all_judges(self, block: int, judges: Sequence[Judge]) -> list[Judge]:
        """Those there are, and the witness; where they exclude each other it is asked once more."""
        if self._witness is None:
            return list(judges)
        mine = [judge for judge in judges if judge.name == self._witness.name]
        others = [judge for judge in judges if judge.name != self._witness.name]
        found = [*others, *(mine or [self._witness(block, False)])]
        if not mine and intersection(found) is None:
            found[-1] = self._witness(block, True)
        return found

    def _tasks(self, block: int) -> list[Task]:
        """What the block does that can meet the stock."""
        out = []
        for k in range(int(self._first[block]), int(self._first[block + 1])):
            if not meets(self._sweeps[k], self._box):
                continue
            near = self._index.needed(k, self._box)
            cut = [self._solids(j) for j in near]
            earlier = [self._sweeps[j] for j in near]
            out.append(Task(self._stock, self._sweeps[k], self._solids(k), earlier, cut))
        return out

    def _solids(self, k: int) -> list[Any]:
        """Solids of a sweep; booleans leave them as they are."""
        if k not in self._made:
            if len(self._made) > KEPT_SOLIDS:
                self._made.pop(next(iter(self._made)))
            try:
                self._made[k] = self._store.solids(k, partial(shapes, self._sweeps[k]))
            except (SweepError, EngineError) as exc:
                self._made[k] = exc
        found = self._made[k]
        if isinstance(found, (SweepError, EngineError)):
            raise found
        return found


def checker(
    stock: Blank, blocks: Sequence[Sequence[Sweep]], folder: Path, witness: Witness | None
) -> Callable[..., Iterator[object]]:
    """`BlockChecker.steps` for a separate process, warm; solids are kept in a folder."""
    work = BlockChecker(stock, blocks, Store(folder), witness)
    work.warm()
    return work.steps


def _attempted(attempt: Attempt, tasks: Sequence[Task]) -> Value:
    """Sum over the motions of a block."""
    values = [attempt(task) for task in tasks]
    return Value(sum(value.volume for value in values), sum(value.own for value in values))


def _joined(reasons: Sequence[str]) -> str:
    """Each reason once, with all attempts that gave it."""
    by_text: dict[str, list[str]] = {}
    for reason in reasons:
        name, _, text = reason.partition(": ")
        by_text.setdefault(text, []).append(name)
    return "; ".join(f"{', '.join(names)}: {text}" for text, names in by_text.items())
