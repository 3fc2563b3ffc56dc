"""Shares of a workpiece, and the life of a process that cuts some of them: it loads an engine and what that takes, no more.

Who asks is `job/executor.py`; what it asks are orders, answered in their order.
"""

from __future__ import annotations

import gc
import signal
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import groupby
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, cast

from vmachining.disk import scribbling
from vmachining.engines import engine_class
from vmachining.engines.protocol import NOTHING, Batched, Divisible, Engine, Removal, Request, Share
from vmachining.errors import EngineError, VMachiningError
from vmachining.memory import peak_mb
from vmachining.sweep import Sweep
from vmachining.tool import Profile


def shares_of(name: str, start: Path, shares: Iterable[int], count: int) -> list[Engine]:
    """Some of `count` shares of the workpiece in a file of `Engine.save`."""
    kind = cast("type[Divisible]", engine_class(name))
    return [kind.load(start, share=Share(share, count)) for share in shares]


def joined(name: str, files: Sequence[Path]) -> Divisible:
    """The workpiece whose shares lie in files, in their order. What is of use to others no share knows: `forget_others`."""
    kind = cast("type[Divisible]", engine_class(name))
    return kind.join(map(kind.load, files))


def told_by(engines: Iterable[Engine], orders: Sequence[Request]) -> Iterator[list[Removal]]:
    """What each of several shares says to every order."""

    def of(engine: Engine) -> Iterable[Removal]:
        if hasattr(engine, "answer"):
            return cast("Batched", engine).answer(orders)
        return (
            engine.cut(order.sweep, order.block) if order.cuts else engine.touch(order.sweep, order.within)
            for order in orders
        )  # fmt: skip

    return map(list, zip(*map(of, engines), strict=True))


def serve(descriptor: int) -> None:
    """Life of a worker: orders in, answers out, until the line is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    line = Connection(descriptor)
    profiles: dict[int, Profile] = {}
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        name, start, own, shares = line.recv()
        engines: dict[int, Engine] = {}
        failed: VMachiningError | None = None
        try:
            engines = dict(zip(own, shares_of(name, Path(start), own, shares), strict=True))
        except EngineError as error:
            failed = error
        gc.collect()
        gc.freeze()  # what is there stays: no need to look through it again and again
        while True:
            told: list[Any] = []
            for asked, orders in groupby(line.recv(), key=lambda order: order[0] == "ask"):
                try:
                    if failed is not None:  # the first failure is the one to report
                        raise failed
                    if not asked:
                        told.extend(filter(None, (_done(engines, profiles, order) for order in orders)))
                        continue
                    some = [
                        Request(Sweep.along(profiles[tool], path), *more) for _, tool, path, *more in orders
                    ]
                    told.extend(told_by(engines.values(), some))
                except VMachiningError as error:
                    failed = error
                    told.append(error)
                except Exception as error:  # whatever it is, it must reach the one who asked
                    failed = EngineError(f"{type(error).__name__}: {error}", engine=name)
                    told.append(failed)
            line.send(told)


def _done(engines: dict[int, Engine], profiles: dict[int, Profile], order: tuple[Any, ...]) -> list[Removal]:
    """Carry out an order other than to cut with every share of this process; what each of them answers."""
    match order:
        case ("profile", number, profile):
            profiles[number] = profile
            return []
        case ("save", folder):
            with scribbling(Path(folder)):
                for share, engine in engines.items():
                    engine.save(Path(folder) / f"{share}.npz")
        case ("forget others", blocks):
            for engine in engines.values():
                cast("Divisible", engine).forget_others(blocks)
        case ("peak",):
            peak = peak_mb()
            return [Removal(peak, peak, peak)] * len(engines)
        case _:
            raise EngineError(f"unknown order {order[0]!r}", engine=next(iter(engines.values())).name)
    return [NOTHING] * len(engines)
