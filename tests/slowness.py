"""How slow this machine is just now, for the few tests that guard against a cost which grows with the square."""

from time import process_time

USUAL_S = 0.025
"""Processor time of the loop where the limits of those tests were set."""


def slowness() -> float:
    """By which a limit of time is multiplied: 1 or more."""
    times = []
    for _ in range(5):
        begin, total = process_time(), 0
        for i in range(500_000):
            total += i * i
        times.append(process_time() - begin)
    return max(1.0, max(times) / USUAL_S)
