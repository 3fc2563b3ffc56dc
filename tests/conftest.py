"""Lanes of the tests, and invented cases that are the same in every run.

`--lane quick` (`./run tests`) leaves out what is marked `slow` or `long`, `--lane check` (`./run check`, CI, and
plain pytest) what is marked `long`, `--lane full` (`./run tests --full`) nothing. The closing lines say what was
left out.

Invented cases (Hypothesis) are the same on every machine, unless `--fresh`, `--lane full` or `--hypothesis-seed N`
asks for new ones; `./run fuzz` does so in rounds. What such a run finds is repeated by the command that it prints,
and becomes a case of its own. A case that fails is shown as it was invented; a fresh run looks for a smaller one,
which may take minutes where an example cuts metal.
"""

from __future__ import annotations

import secrets
from collections import Counter

import pytest
from hypothesis import Phase, settings
from hypothesis.internal.conjecture import providers

settings.register_profile("fresh", derandomize=False, deadline=None)
settings.register_profile(
    "fixed", derandomize=True, deadline=None, phases=(Phase.explicit, Phase.reuse, Phase.generate)
)

# Hypothesis mixes the literals of all modules loaded so far, ours included, into its numbers: a case then depends on
# the tests that ran before, on edits elsewhere, and on the folder of the clone. `test_conftest.py` sees that this holds.
providers._get_local_constants = lambda: providers._local_constants

LEAVES_OUT = {"quick": ("slow", "long"), "check": ("long",), "full": ()}
WAY_IN = {"slow": "./run check", "long": "./run tests --full"}
SEED = pytest.StashKey[str | None]()
LEFT_OUT = pytest.StashKey[Counter[str]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--lane", choices=tuple(LEAVES_OUT), default="check", help="how much is run (default: check)"
    )
    parser.addoption("--fresh", action="store_true", help="invent new cases, and say how to repeat them")


@pytest.hookimpl(tryfirst=True)  # before the plugin of Hypothesis, and before xdist hands the options on
def pytest_configure(config: pytest.Config) -> None:
    config.stash[LEFT_OUT] = Counter()
    option = config.option
    if (option.fresh or option.lane == "full") and option.hypothesis_seed is None:
        option.hypothesis_seed = str(secrets.randbelow(10**9))
    config.stash[SEED] = option.hypothesis_seed
    settings.load_profile("fixed" if option.hypothesis_seed is None else "fresh")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out, and begin with the files that have most slow tests: the last ones of two processes are then short."""
    kept, left = [], []
    for item in items:
        why = next((m for m in LEAVES_OUT[config.getoption("--lane")] if item.get_closest_marker(m)), None)
        if why is None:
            kept.append(item)
        else:
            left.append(item)
            config.stash[LEFT_OUT][why] += 1
    if left:
        config.hook.pytest_deselected(items=left)
    slow = Counter(item.path for item in kept if item.get_closest_marker("slow"))
    items[:] = sorted(kept, key=lambda item: -slow[item.path])


def pytest_sessionfinish(session: pytest.Session) -> None:
    if hasattr(session.config, "workeroutput"):  # a process of xdist tells the one that reports
        session.config.workeroutput["left_out"] = dict(session.config.stash[LEFT_OUT])


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: object) -> None:
    told = getattr(node, "workeroutput", {}).get("left_out")
    if told is not None:  # every process collects all tests
        node.config.stash[LEFT_OUT] = Counter(told)  # type: ignore[attr-defined]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if config.stash[SEED] is not None:
        terminalreporter.write_line(
            f"invented with seed {config.stash[SEED]}: add --hypothesis-seed={config.stash[SEED]} to repeat it"
        )
    for mark, count in sorted(config.stash[LEFT_OUT].items()):
        terminalreporter.write_line(f"left out: {count} tests marked {mark} ({WAY_IN[mark]} runs them)")
