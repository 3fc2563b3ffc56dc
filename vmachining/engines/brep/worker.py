"""The process that runs OCCT: `python -m vmachining.engines.brep.worker`, driven by `workers.py`.

Pickled messages over stdin and stdout: first (stock, blocks), then block numbers with their brackets; a
`Verdict` comes back for each. OCCT talks on stdout, so the answers go through a copy of it and stdout itself
becomes stderr.
"""

from __future__ import annotations

import os
import pickle
import sys

__all__ = ["main"]


def main() -> None:
    """Answer until stdin ends."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    questions = sys.stdin.buffer
    from vmachining.engines.brep.ladder import Ladder, quiet

    quiet()
    stock, blocks, rungs = pickle.load(questions)
    ladder = Ladder(stock, blocks)
    pickle.dump("ready", answers)
    answers.flush()
    while True:
        try:
            block, bracket = pickle.load(questions)
        except EOFError:
            return
        pickle.dump(ladder.removed(block, bracket, rungs=rungs), answers)
        answers.flush()


if __name__ == "__main__":
    main()
