"""Damaged programs: what a reader must answer with findings, never with an exception."""

import random
from collections.abc import Sequence


def mutated(program: str, seed: int, words: Sequence[str]) -> str:
    """A program after one to eleven random changes; `words` are put in for some of its characters."""
    rng = random.Random(seed)
    text = list(program)
    for _ in range(rng.randrange(1, 12)):
        place = rng.randrange(len(text))
        kind = rng.randrange(4)
        if kind == 0:
            del text[place]
        elif kind == 1:
            text[place] = chr(rng.randrange(9, 127))
        elif kind == 2:
            text[place:place] = text[(k := rng.randrange(len(text))) : k + rng.randrange(30)]
        else:
            text[place : place + rng.randrange(20)] = rng.choice(words)
    return "".join(text)
