"""Programs of the Fanuc family against ncplot7py, a reader of macro B by others: random programs of fixed seeds.

What it reads reliably is compared: straight moves, arcs by I J K in three planes, variables, IF, WHILE and GOTO. Of offsets,
units, cycles and arcs by R its mill knows nothing; functions in sums, subprograms and labels before assignments mislead it.
"""

from __future__ import annotations

import logging
import random
from typing import Any

import pytest

from vmachining.nc import Motion, parse_program

WHY = "the second reader of Fanuc programs is not installed: pip install ncplot7py"
execution = pytest.importorskip("ncplot7py.application.nc_execution", reason=WHY)
from ncplot7py.domain.cnc_state import CNCState  # noqa: E402
from ncplot7py.domain.machines import get_machine_config  # noqa: E402
from ncplot7py.infrastructure.machines.base_stateful_control import (  # noqa: E402
    UniversalConfigDrivenControl,
)

Step = tuple[str, tuple[float, float, float]]
NAMES = {"LINEAR": Motion.LINEAR, "ARC_CW": Motion.ARC_CW, "ARC_CCW": Motion.ARC_CCW}


def theirs(text: str) -> list[Step]:
    logging.disable(logging.CRITICAL)
    try:
        state = CNCState(machine_config=get_machine_config("FANUC_MILL"))
        engine = execution.NCExecutionEngine(UniversalConfigDrivenControl(init_nc_states=[state]))
        found: list[dict[str, Any]] = engine.get_Syncro_plot([text], synch=False)[0]["plot"]
    finally:
        logging.disable(logging.NOTSET)
    assert not engine.errors, engine.errors
    out = []
    for step in found:
        end = step["motionContext"]["endAxes"]
        kind = Motion.RAPID if step["traversal"] == "RAPID" else NAMES[step["geometry"]]
        out.append((str(kind), (end["X"], end["Y"], end["Z"])))
    return out


def ours(text: str) -> list[Step]:
    program = parse_program(text.encode(), "p", dialect="fanuc", home=(0.0, 0.0, 0.0))
    assert not program.errors, program.errors
    return [(str(move.motion), move.end) for move in program.moves]


def moving(steps: list[Step]) -> list[Step]:
    """Those that lead somewhere else: one reader makes moves of no length where the other makes none."""
    at, out = (0.0, 0.0, 0.0), []
    for kind, end in steps:
        if max(abs(a - b) for a, b in zip(at, end, strict=True)) > 1e-6:
            out.append((kind, end))
        at = end
    return out


def block(rng: random.Random, depth: int, count: list[int]) -> list[str]:
    """Some lines: moves, assignments, and what steers around more of them."""
    out = []
    for _ in range(rng.randrange(2, 5)):
        count[0] += 1
        label, kind = count[0], rng.random()
        if kind < 0.35:
            words = "".join(f" {c}{rng.uniform(-9, 9):.3f}" for c in "XYZ" if rng.random() < 0.6)
            out.append(f"{rng.choice(('G0', 'G1'))}{words or ' X1.'}")
        elif kind < 0.5:
            out.append(f"G1 X[#1*{rng.uniform(0.1, 2):.2f}] Y[#2-{rng.randrange(9)}.] Z#3")
        elif kind < 0.6:
            u, v = rng.randrange(1, 9), rng.randrange(1, 9)  # a half circle, whose ends have one radius
            plane, a, b, i, j = rng.choice(
                (("G17", "X", "Y", "I", "J"), ("G18", "X", "Z", "I", "K"), ("G19", "Y", "Z", "J", "K"))
            )
            out += [
                f"G91 {plane} {rng.choice(('G2', 'G3'))} {a}{2 * u}. {b}{2 * v}. {i}{u}. {j}{v}.",
                "G90 G17",
            ]
        elif kind < 0.75:
            out.append(
                f"#{rng.randrange(1, 4)}=[#{rng.randrange(1, 4)}{rng.choice('+-*')}{rng.uniform(0.5, 1.5):.2f}]"
            )
        elif kind < 0.85 and depth < 3:
            out += [f"#{10 + depth}=0", f"WHILE [#{10 + depth} LT {rng.randrange(4)}] DO{depth}"]
            out += [*block(rng, depth + 1, count), f"#{10 + depth}=#{10 + depth}+1", f"END{depth}"]
        elif kind < 0.95:
            out += [
                f"IF [#{rng.randrange(1, 4)} {rng.choice(('GT', 'LT', 'GE', 'LE'))} {rng.randrange(5)}] GOTO {label}"
            ]
            out += [f"G1 X{rng.randrange(9)}. Z{rng.randrange(9)}.", f"N{label} G90", "#1=[#1+1]"]
        else:
            out.append(f"G0 X-[#1+{rng.randrange(1, 9)}.] Y[[#2-#1]*2.]")
    return out


@pytest.mark.parametrize("seed", range(40))
def test_macro_programs_move_as_another_reader_says(seed):
    rng = random.Random(seed)
    body = block(rng, 1, [100]) + block(rng, 1, [500]) + block(rng, 1, [900])
    text = "\n".join(
        [
            "O1",
            "G90 G17 G21 F100.",
            "#1=2",
            "#2=3",
            "#3=1",
            "G0 X0 Y0 Z0",
            *body,
            "M30",
        ]
    )
    one, two = moving(ours(text)), moving(theirs(text))
    assert [kind for kind, _ in one] == [kind for kind, _ in two], text
    for (_, a), (_, b) in zip(one, two, strict=True):
        assert a == pytest.approx(b, abs=1e-6), text
