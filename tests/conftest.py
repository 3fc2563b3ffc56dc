"""Lanes of the tests, and invented cases that are the same in every run.

`--lane quick` (`./run tests`) leaves out what is marked `slow` or `long`, `--lane check` (`./run check`, CI, and
plain pytest) what is marked `long`, `--lane full` (`./run tests --full`) nothing. The closing lines say what was
left out.

VMACHINING_EXPLORE=1 invents new cases: what it finds becomes a case of its own. A case that fails is shown as it
was invented; `--lane full` and VMACHINING_EXPLORE=1 look for a smaller one, which may take minutes where an example
cuts metal.
"""

from __future__ import annotations

import os
from collections import Counter

import pytest
from hypothesis import Phase, settings

EXPLORE = "VMACHINING_EXPLORE" in os.environ
settings.register_profile("smallest", derandomize=not EXPLORE, deadline=None)
settings.register_profile(
    "as invented", settings.get_profile("smallest"), phases=(Phase.explicit, Phase.reuse, Phase.generate)
)

LEAVES_OUT = {"quick": ("slow", "long"), "check": ("long",), "full": ()}
WAY_IN = {"slow": "./run check", "long": "./run tests --full"}
LEFT_OUT = pytest.StashKey[Counter[str]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--lane", choices=tuple(LEAVES_OUT), default="check", help="how much is run (default: check)"
    )


def pytest_configure(config: pytest.Config) -> None:
    config.stash[LEFT_OUT] = Counter()
    settings.load_profile("smallest" if EXPLORE or config.getoption("--lane") == "full" else "as invented")


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
    for mark, count in sorted(config.stash[LEFT_OUT].items()):
        terminalreporter.write_line(f"left out: {count} tests marked {mark} ({WAY_IN[mark]} runs them)")
