"""The process that runs OCCT: `python -m vmachining.engines.brep.worker`, driven by `workers.py`.

Pickled messages over stdin and stdout: first (stock, blocks, rungs), then (block, bracket), each answered by a
`Verdict`; or (path, brackets, labels), answered by the volume of the STEP file or the text of a refusal.

OCCT talks on stdout, so the answers go through a copy of it and stdout itself becomes stderr.
"""

from __future__ import annotations

import os
import pickle
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining.errors import VMachiningError

if TYPE_CHECKING:
    from vmachining.engines.brep.ladder import Blank

__all__ = ["main"]


def main() -> None:
    """Answer until stdin ends."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    questions = sys.stdin.buffer
    from vmachining.engines.brep.ladder import Ladder, quiet

    quiet()
    stock, blocks, rungs = pickle.load(questions)
    ladder: Ladder | None = None
    pickle.dump("ready", answers)
    answers.flush()
    while True:
        try:
            question = pickle.load(questions)
        except EOFError:
            return
        if len(question) == 3:
            answer: object = _written(stock, blocks, *question)
        else:
            ladder = ladder or Ladder(stock, blocks)
            answer = ladder.removed(*question, rungs=rungs)
        pickle.dump(answer, answers)
        answers.flush()


def _written(stock: Blank, blocks: Any, path: Path, brackets: Any, labels: Any) -> float | str:
    """Volume of the STEP file, or why there is none."""
    from vmachining.engines.brep.workpiece import write_step

    try:
        return write_step(path, stock, blocks, brackets, labels)
    except VMachiningError as exc:
        return str(exc)
    except Exception as exc:  # OCCT raises whatever it meets
        return f"OCCT failed: {type(exc).__name__} {exc}"


if __name__ == "__main__":
    main()
