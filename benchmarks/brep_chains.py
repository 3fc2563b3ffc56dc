"""Random chains of blocks through the B-rep gate: how often it agrees, and whether it is ever silently wrong.

Chains of 5 to 20 blocks, each on a plot of its own; a batch of them shares one long bar. Every value is held
against the bracket of the mesh engine and exact rays (these are the judges of the gate), and against counted points
(`referee.py`), which share no code with any engine: wrong is a value that they exclude, silently wrong one that is farther
off than its own error says. The same blocks go through plain successive booleans as a baseline.

    python -m benchmarks.brep_chains RECORD [--chains 200] [--only bore,helix] [--again 4,11] [--plain | --base]

keeps one line per chain in a file: what is there is not run again, so a long run can be done in portions, and
the table is printed from the file. `--again` runs chains once more; the last line of a chain counts. `--plain` leaves the
baseline out, `--base` runs nothing but what of it is missing.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from benchmarks.chains import DEEP, FAMILIES, PLOT, families, tools
from benchmarks.referee import referee
from vmachining.arrays import Floats
from vmachining.engines.brep import check_blocks, isolated, shape_of, solids, volume
from vmachining.engines.judges import Judge
from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.engines.protocol import Removal
from vmachining.errors import EngineError, SweepError, VMachiningError
from vmachining.geometry import Arc, Line
from vmachining.interval import Interval
from vmachining.job.brep import RayWitness
from vmachining.stock import BoxStock
from vmachining.sweep import Motion, Pose, Sweep, Turn
from vmachining.tolerance import BREP_SECONDS

__all__ = ["Chain", "bar_of", "brep_chains", "chain_of", "main", "recorded", "table"]

CHORD = 0.02
"""mm, of the brackets."""

FEW, MANY = 2, 4
"""Parts of a cell along an axis that the referee counts points in."""

ROUND_MM3 = 1e-6
"""What a boolean may be off by rounding alone."""

BASE_S = 60.0
"""s of a processor per chain of the baseline."""


class Chain(NamedTuple):
    """One chain on its plot: the sweeps and their brackets."""

    number: int
    family: str
    tool: str
    sweeps: list[Sweep]
    brackets: list[Interval]


def brep_chains(
    chains: int | Collection[int] = 21,
    seed: int = 1,
    workers: int = 1,
    batch: int = 7,
    baseline: bool = True,
    seconds: float = BREP_SECONDS,
) -> Iterator[dict[str, Any]]:
    """One record per chain as it is done, and the table after every batch.

    chains : how many, or which ones; the family of a chain is its number modulo their count.
    seconds : limit of a block, see `check_blocks`.
    """
    todo = list(range(chains)) if isinstance(chains, int) else list(chains)
    done: list[dict[str, Any]] = []
    for first in range(0, len(todo), batch):
        numbers = todo[first : first + batch]
        bar = bar_of(numbers)
        engine = MeshEngine(box_stock(tuple(bar[0]), tuple(bar[1])), CHORD)
        made = [chain_of(seed, number, engine) for number in numbers]
        for record in _held(made, bar, workers, baseline, seconds):
            done.append({"case": "brep-chains", "seed": seed, **record})
            yield done[-1]
        yield from table(done)


def table(records: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Counts per family and in total; the median and the largest time of a block, s of a processor."""
    families_of: dict[str, list[dict[str, Any]]] = {}
    for record in records:
        families_of.setdefault(record["family"], []).append(record)
        families_of.setdefault("all", []).append(record)
    for family in (*FAMILIES, "all"):
        found = families_of.get(family, [])
        blocks = [block for record in found for block in record["blocks"]]
        if not blocks:
            continue
        counts = Counter(block["status"] for block in blocks)
        plain = Counter(word for record in found for word in record["baseline"])
        seconds = np.array([block["seconds"] for block in blocks])
        yield {
            "case": "brep-chains", "family": family, "chains": len(found), "asked": len(blocks),
            **{word: counts[word] for word in ("agreed", "retried", "refused", "disputed")},
            "agreed_or_retried": (counts["agreed"] + counts["retried"]) / len(blocks),
            "wrong": sum(block["wrong"] for block in blocks),
            "silently_wrong": sum(block["silent"] for block in blocks),
            "median_s": round(float(np.median(seconds)), 3), "max_s": round(float(seconds.max()), 1),
            "attempts": dict(Counter(block["attempt"] for block in blocks if block["attempt"])),
            "baseline": dict(plain),
        }  # fmt: skip


def recorded(file: Path) -> dict[int, dict[str, Any]]:
    """Chain number -> its last record in a file, which a cut may have ended in the middle of a line."""
    found: dict[int, dict[str, Any]] = {}
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        try:
            record = json.loads(line)
        except ValueError:
            continue
        found[record["chain"]] = record
    return dict(sorted(found.items()))


def bar_of(numbers: Sequence[int]) -> tuple[Floats, Floats]:
    """Corners of the stock of some chains: plots with as much left between them."""
    low = np.array([2.0 * PLOT * min(numbers), 0.0, -DEEP])
    return low, np.array([2.0 * PLOT * max(numbers) + PLOT, PLOT, 0.0])


def chain_of(seed: int, number: int, engine: MeshEngine) -> Chain:
    """A chain and its brackets, by cutting the stock of `engine`."""
    family = FAMILIES[number % len(FAMILIES)]
    rng = np.random.default_rng([seed, number])
    kind, tool = tools(rng)
    at = np.array([2.0 * PLOT * number, 0.0, 0.0])
    paths = families(family, rng, tool.profile.radius_at(2.0).item())
    sweeps = [Sweep.along(tool, _shifted(path, at)) for path in paths]
    return Chain(
        number, family, kind, sweeps, [engine.cut(sweep, block=k).bracket for k, sweep in enumerate(sweeps)]
    )


def _held(
    made: Sequence[Chain], bar: tuple[Floats, Floats], workers: int, baseline: bool, seconds: float
) -> Iterator[dict[str, Any]]:
    """Every block of some chains by the gate and by plain booleans, held against counted points."""
    stock = BoxStock(*bar).solid()
    where = [(chain, k) for chain in made for k in range(len(chain.sweeps))]
    blocks = [[chain.sweeps[k]] for chain, k in where]
    asked = {number: [Judge("mesh", Removal(*chain.brackets[k]))] for number, (chain, k) in enumerate(where)}
    points = {chain.number: _Points(chain, bar) for chain in made}
    open_blocks: dict[int, dict[int, Any]] = {
        chain.number: dict.fromkeys(range(len(chain.sweeps))) for chain in made
    }
    witness = RayWitness(BoxStock(*bar), blocks)
    for number, verdict in check_blocks(
        stock, blocks, asked, witness=witness, workers=workers, seconds=seconds
    ):
        chain, k = where[number]
        known = open_blocks[chain.number]
        known[k] = {
            "status": str(verdict.status), "attempt": verdict.attempt, "value": verdict.removed_mm3,
            "error": verdict.error_mm3, "judges": [[name, *removal] for name, removal in verdict.judges],
            "seconds": round(verdict.seconds, 3), "sweeps": verdict.sweeps, "reason": verdict.reason,
            "tried": list(verdict.tried), **points[chain.number].of(k, verdict.removed_mm3, verdict.error_mm3 or 0.0),
        }  # fmt: skip
        if all(known.values()):
            yield {
                "chain": chain.number, "family": chain.family, "tool": chain.tool, "blocks": list(known.values()),
                "baseline": _base(chain, bar, points[chain.number]) if baseline else [],
            }  # fmt: skip


class _Points:
    """Counted points of the blocks of a chain, over any value of one; those of a block are counted once."""

    def __init__(self, chain: Chain, bar: tuple[Floats, Floats]) -> None:
        self._chain, self._bar = chain, np.array(bar)
        self._known: dict[tuple[int, int], tuple[float, float]] = {}

    def of(self, k: int, value: float | None, error: float) -> dict[str, Any]:
        """Whether a value is wrong, and silently so: farther off than points and its own error allow; more points where
        few of them say so."""
        if value is None:
            return {"wrong": False, "silent": False}
        volume, bar = self._counted(k, FEW)
        if abs(value - volume) > bar:
            volume, bar = self._counted(k, MANY)
        miss = abs(value - volume) - bar
        return {
            "points": volume,
            "bar": bar,
            "wrong": bool(miss > ROUND_MM3),
            "silent": bool(miss > error + ROUND_MM3),
        }

    def _counted(self, k: int, across: int) -> tuple[float, float]:
        if (k, across) not in self._known:
            self._known[k, across] = referee(self._chain.sweeps, k, self._bar, across)
        return self._known[k, across]


def _base(chain: Chain, bar: tuple[Floats, Floats], points: _Points) -> list[str]:
    """What plain successive booleans make of every block of a chain."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "values"
        file.touch()
        with suppress(EngineError, SweepError):  # what was written before the end counts
            isolated(_successive, bar, chain.sweeps, BASE_S, file, seconds=1.5 * BASE_S)
        found = [json.loads(line) for line in file.read_text().splitlines() if line.endswith(("]", "null"))]
    found += [None] * (len(chain.sweeps) - len(found))
    out = []
    for k, plain in enumerate(found):
        if plain is None:
            out.append("failed")
        elif not points.of(k, plain[0], 0.0)["wrong"]:
            out.append("right")
        else:
            out.append("silently wrong" if plain[1] else "wrong, not valid")
    return out


def _shifted(path: Motion, move: Floats) -> Motion:
    if isinstance(path, Line):
        return Line(path.start + move, path.end + move)
    if isinstance(path, Arc):
        return Arc(path.start + move, path.center + move, path.axis, angle=path.angle, rise=path.rise)
    return Turn.great_circle(Pose(path.start + move, path.axis(0.0)), Pose(path.end + move, path.axis(1.0)))


def _based(record: dict[str, Any]) -> dict[str, Any]:
    """A record with the baseline it lacks."""
    bar = bar_of([record["chain"]])
    engine = MeshEngine(box_stock(tuple(bar[0]), tuple(bar[1])), CHORD)
    chain = chain_of(record["seed"], record["chain"], engine)
    return {**record, "baseline": _base(chain, bar, _Points(chain, bar))}


def _successive(stock: tuple[Floats, Floats], sweeps: Sequence[Sweep], seconds: float, file: Path) -> None:
    """Cut one solid by all sweeps, as a plain script would; one line of JSON per block into a file.

    [removed volume, whether OCCT calls what is left valid]; null: a sweep without solid, or no answer.
    """
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepCheck import BRepCheck_Analyzer

    begin = process_time()
    current = shape_of(BoxStock(*stock).solid())
    before = volume(current)
    with file.open("a") as out:
        for sweep in sweeps:
            if process_time() - begin > seconds:
                return
            try:
                for part in solids(sweep):
                    current = BRepAlgoAPI_Cut(current, part.shape).Shape()
                after = volume(current)
                answer = [before - after, bool(BRepCheck_Analyzer(current).IsValid())]
                before = after
            except VMachiningError:
                answer = None
            out.write(json.dumps(answer) + "\n")
            out.flush()


def main() -> None:
    """Run what a file of records lacks, in batches, and print the table of all it holds."""
    parser = argparse.ArgumentParser(description="The chain gauntlet, resumable.")
    parser.add_argument("record", type=Path, help="file of one JSON line per chain, appended to")
    parser.add_argument("--chains", type=int, default=200)
    parser.add_argument("--only", default=",".join(FAMILIES), help="families, comma-separated")
    parser.add_argument("--again", default="", help="chains to run once more, comma-separated")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--plain", action="store_true", help="without the baseline")
    which.add_argument("--base", action="store_true", help="the baseline of recorded chains that lack it")
    parser.add_argument("--batch", type=int, default=7)
    parser.add_argument(
        "--seconds", type=float, default=BREP_SECONDS, help="of a processor, limit of a block"
    )
    given = parser.parse_args()
    again = [int(word) for word in given.again.split(",") if word]
    known = recorded(given.record)
    only = given.only.split(",")
    records: Iterator[dict[str, Any]]
    if given.base:
        records = (
            _based(record) for record in known.values() if not record["baseline"] and record["family"] in only
        )
    else:
        todo = again or [
            n for n in range(given.chains) if n not in known and FAMILIES[n % len(FAMILIES)] in only
        ]
        records = brep_chains(todo, batch=given.batch, baseline=not given.plain, seconds=given.seconds)
    with given.record.open("a", encoding="utf-8") as out:
        out.write("\n" if given.record.stat().st_size else "")  # what a cut left
        for record in records:
            if "chain" not in record:
                continue
            out.write(json.dumps(record) + "\n")
            out.flush()
            words = Counter(block["status"] for block in record["blocks"])
            wrong = sum(block["wrong"] for block in record["blocks"])
            print(
                record["chain"], record["family"], record["tool"], dict(words), f"{wrong} wrong", flush=True
            )
    for row in table(recorded(given.record).values()):
        print(json.dumps(row))


if __name__ == "__main__":
    from benchmarks import brep_chains as itself  # workers find functions there, not in __main__

    itself.main()
