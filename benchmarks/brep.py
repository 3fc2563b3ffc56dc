"""Cost of the B-rep gate over a long program, and what a second worker brings."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from statistics import median
from time import perf_counter, process_time
from typing import Any

from vmachining.engines.brep import Blank, BlockChecker, check_blocks
from vmachining.engines.judges import Judge
from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.engines.protocol import Removal
from vmachining.geometry import Line
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, BullNose, FlatEnd

__all__ = ["brep", "brep_workers"]

STEP, LONG, DEPTH, CHORD = 3.0, 20.0, 2.0, 0.02


def brep(blocks: int = 2000, part: int = 100) -> Iterator[dict[str, Any]]:
    """Overlapping passes, one block each, along a bar: every block has the same two or three neighbours.

    The first `part` blocks that have all their neighbours, and the last `part`, in turns and by processor time, so
    that a busy machine does not decide between them.
    """
    for name, tool in (
        ("flat", FlatEnd(diameter=10, length=40)),
        ("ball", BallNose(diameter=10, length=40)),
        ("bull", BullNose(diameter=10, corner_radius=2, length=40)),
    ):
        lo, hi = (-10.0, -5.0, -10.0), (STEP * blocks + 10.0, LONG + 5.0, 0.0)
        sweeps = []
        for k in range(blocks):
            a, b = (STEP * k, 0.0, -DEPTH), (STEP * k, LONG, -DEPTH)
            sweeps.append(Sweep.along(tool, Line(b, a) if k % 2 else Line(a, b)))
        engine = MeshEngine(box_stock(lo, hi), CHORD)
        brackets = [engine.cut(sweep, block=k).bracket for k, sweep in enumerate(sweeps)]
        judges = [[Judge("mesh", Removal(*bracket))] for bracket in brackets]
        stock = Blank("box", lo, hi)
        work = BlockChecker(stock, [[sweep] for sweep in sweeps])
        work.check(5, judges[5])  # compiles and loads
        times: dict[str, list[float]] = {}
        status: list[str] = []
        for number in range(part):
            for where, first in (("first", 10), ("last", blocks - part)):
                begin, k = process_time(), first + number
                status.append(str(work.check(k, judges[k]).status))
                times.setdefault(where, []).append(process_time() - begin)
        yield {
            "case": "brep",
            "tool": name,
            "blocks": blocks,
            "median_s": median(times["first"] + times["last"]),
            "last_to_first": sum(times["last"]) / sum(times["first"]),
            **{word: status.count(word) for word in ("agreed", "retried", "refused")},
        }


def brep_workers(blocks: int = 400, rounds: int = 2) -> Iterator[dict[str, Any]]:
    """What a second worker brings: the same blocks with one and with two, in turns.

    Times by the clock compare only where nobody else is at work. So the processor seconds of the workers per second
    of the clock stand beside (busy: 2 would be no serial part and a machine for ourselves), the share of the
    clock that is start-up (a run of one block), and the processor seconds of the parent, which are all that is
    serial; speed_up_by_processor is what these seconds allow. peak_mb: of the largest worker.
    """
    lo, hi = (-10.0, -5.0, -10.0), (STEP * blocks + 10.0, LONG + 5.0, 0.0)
    tool = BallNose(diameter=10, length=40)
    ends = [((STEP * k, 0.0, -DEPTH), (STEP * k, LONG, -DEPTH)) for k in range(blocks)]
    sweeps = [[Sweep.along(tool, Line(b, a) if k % 2 else Line(a, b))] for k, (a, b) in enumerate(ends)]
    engine = MeshEngine(box_stock(lo, hi), CHORD)
    brackets = {k: engine.cut(sweep, block=k).bracket for k, (sweep,) in enumerate(sweeps)}
    stock, one = Blank("box", lo, hi), {blocks - 1: brackets[blocks - 1]}
    best: dict[tuple[str, int], tuple[float, float, float]] = {}
    for _ in range(rounds):
        for label, asked in (("start", one), ("all", brackets)):
            for count in (1, 2):
                begin, own, theirs = perf_counter(), process_time(), _workers_seconds()
                good = [
                    verdict.removed_mm3 for _, verdict in check_blocks(stock, sweeps, asked, workers=count)
                ]
                assert None not in good
                spent = perf_counter() - begin, _workers_seconds() - theirs, process_time() - own
                best[label, count] = min(best.get((label, count), spent), spent)
    for count in (1, 2):
        clock, theirs, own = best["all", count]
        yield {
            "case": "brep-workers", "workers": count, "blocks": blocks, "seconds": clock,
            "start_s": best["start", count][0], "busy": theirs / clock, "parent_s": own,
            "peak_mb": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0,
        }  # fmt: skip
    yield {
        "case": "brep-workers", "blocks": blocks, "speed_up": best["all", 1][0] / best["all", 2][0],
        "speed_up_running": (best["all", 1][0] - best["start", 1][0])
        / max(best["all", 2][0] - best["start", 2][0], 1e-9),
        "speed_up_by_processor": (best["all", 1][1] + best["all", 1][2])
        / (best["all", 2][1] / 2.0 + best["all", 2][2]),
    }  # fmt: skip


def _workers_seconds() -> float:
    """s of a processor that processes which have ended took."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
