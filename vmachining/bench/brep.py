"""Cost of the B-rep ladder over a long program, and what a second worker brings."""

from __future__ import annotations

from collections.abc import Iterator
from statistics import median
from time import perf_counter, process_time
from typing import Any

from vmachining.engines.brep import Blank, Ladder, check_blocks
from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.geometry import Line
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, BullNose, FlatEnd

__all__ = ["brep"]

STEP, LONG, DEPTH, CHORD = 3.0, 20.0, 2.0, 0.02


def brep(blocks: int = 2000, part: int = 100) -> Iterator[dict[str, Any]]:
    """Overlapping passes, one block each, along a bar: every block has the same two or three neighbours.

    The first `part` blocks that have all their neighbours, and the last `part`, in turns and by processor time, so
    that a busy machine does not decide between them; then `part` blocks from the
    middle with one and with two workers (their start-up is told apart: a run of one block).
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
        engine = MeshEngine(box_stock(lo, hi), CHORD, certify=True)
        brackets = [engine.cut(sweep, block=k) for k, sweep in enumerate(sweeps)]
        stock = Blank("box", lo, hi)
        work = Ladder(stock, [[sweep] for sweep in sweeps])
        work.removed(5, brackets[5])  # compiles and loads
        times: dict[str, list[float]] = {}
        status: list[str] = []
        for number in range(part):
            for where, first in (("first", 10), ("last", blocks - part)):
                begin, k = process_time(), first + number
                status.append(str(work.removed(k, brackets[k]).status))
                times.setdefault(where, []).append(process_time() - begin)
        yield {
            "case": "brep",
            "tool": name,
            "blocks": blocks,
            "median_s": median(times["first"] + times["last"]),
            "last_to_first": sum(times["last"]) / sum(times["first"]),
            **{word: status.count(word) for word in ("agreed", "retried", "refused")},
        }
    middle = {k: brackets[k] for k in range(blocks // 2, blocks // 2 + part)}
    one = {blocks // 2: brackets[blocks // 2]}
    seconds = {}
    for count in (1, 2):
        for label, asked in (("start", one), ("all", middle)):
            begin = perf_counter()
            for _ in check_blocks(stock, [[sweep] for sweep in sweeps], asked, workers=count):
                pass
            seconds[label, count] = perf_counter() - begin
    yield {
        "case": "brep",
        "blocks": part,
        "start_s": seconds["start", 1],
        "one_worker_s": seconds["all", 1],
        "two_workers_s": seconds["all", 2],
        "speed_up": (seconds["all", 1] - seconds["start", 1])
        / max(seconds["all", 2] - seconds["start", 2], 1e-9),
    }
