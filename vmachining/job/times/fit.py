"""The few numbers of a machine that its times depend on, found from logs.

Windows of consecutive intervals (a whole sequence of changes is never cut) give logged seconds y. For accelerations at feed, in
rapids and of the z slide, corner tolerance, rapid speed and time per block z, the look-ahead gives the seconds p(z) of motion;
what changes of tool and spindle last, c >= 0, enters linearly: y = p(z) + E c. Both are found by least absolute deviations,
which a pause that nobody logged does not move: c by reweighted least squares, z by a search over one number at a time on a
logarithmic scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.errors import InputError
from vmachining.job.times.laid import Laid
from vmachining.machine import MachineLimits

WINDOW_S = 3.0
"""s of a window at least: ten times the distance of entries in common logs, which is the error of its ends."""

RAPID, AXES = "rapid_acceleration_mm_s2", "axis_acceleration_mm_s2"

EVENTS = (
    "tool_change_s", "table_change_s", "program_stop_s", "spindle_start_s", "spindle_s_per_1000_rev_min",
)  # fmt: skip

UNLIMITED = 20_000.0
"""mm/s^2 of a slide that is not searched: it never decides."""

SEARCH: dict[str, tuple[float, float, float | None]] = {
    "max_acceleration_mm_s2": (50.0, UNLIMITED, 1000.0),
    "rapid_acceleration_mm_s2": (50.0, UNLIMITED, None),
    "axis_acceleration_mm_s2": (50.0, UNLIMITED, None),
    "corner_tolerance_mm": (1e-4, 1.0, 0.01),
    "rapid_mm_min": (1000.0, 100_000.0, 15_000.0),
    "block_s": (1e-5, 0.1, 1e-3),
}
"""Least, largest and first value of what is searched. None: rapids and the z slide have the acceleration of the path at feed,
unless another one is better; of the slides, only z is searched."""

FACTORS = (4.0, 2.0, 1.4, 1.15, 1.06, 1.03)

GAIN = 0.01
"""Share of the error that an acceleration of rapids or z has to take away to be one of its own."""


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """limits : found. error : mean absolute error of windows relative to their mean, on the logs that were used.
    left_out : words for logs that were not."""

    limits: MachineLimits
    error: float
    windows: int
    seconds: float
    left_out: tuple[str, ...] = ()


def _windows(laid: Laid) -> Ints:
    """(k,) window of an interval, -1 of none."""
    owner = np.full(len(laid.logged), -1, dtype=np.int64)
    number, spent = 0, 0.0
    busy = np.concatenate([[False, False], laid.events.sum(axis=1) > 0, [False]])
    # the spindle is waited for two lines after its word at most
    near = busy[2:-1] | busy[3:] | busy[1:-2] | busy[:-3]
    for k in range(len(owner)):
        if not laid.kept[k]:
            number, spent = number + (spent > 0.0), 0.0
            continue
        if spent >= WINDOW_S and not near[k]:
            number, spent = number + 1, 0.0
        owner[k] = number
        spent += float(laid.logged[k])
    return owner


def fit(laid: Sequence[Laid]) -> Fitted:
    """Numbers of the machine that ran these logs.

    Raises InputError: Less than a minute that can be compared.
    """
    other = tuple(text for one in laid if (text := one.another) is not None)
    used = [one for one in laid if one.another is None] if len(other) < len(laid) else laid
    owners = [_windows(one) for one in used]

    def sums(values: Sequence[Floats]) -> Floats:
        """Of all windows, of values (k,) of the intervals of every log."""
        pairs = zip(owners, values, strict=True)
        return np.concatenate(
            [np.bincount(own + 1, v, minlength=own.max(initial=-1) + 2)[1:] for own, v in pairs]
        )

    logged = sums([one.logged for one in used])
    events = np.column_stack([sums([one.events[:, k] for one in used]) for k in range(len(EVENTS))])
    if logged.sum() < 60.0:
        raise InputError(
            f"only {logged.sum():.0f} s of these logs can be compared", remedy="give longer ones"
        )

    def judged(limits: MachineLimits) -> tuple[float, MachineLimits]:
        moving = sums([one.paths(limits)[0] for one in used])
        cost = _events(logged - moving, events)
        rest = np.abs(logged - moving - events @ cost)
        found = _with(limits, dict(zip(EVENTS, cost.round(4).tolist(), strict=True)))
        return float(rest.sum()), found

    begin = {name: first for name, (_, _, first) in SEARCH.items() if first is not None}
    here = _with(MachineLimits(), begin)
    least, here = judged(here)
    # what rapids and z have of their own is looked for last, and has to gain: otherwise it stands in for another number
    for names in (begin, SEARCH):
        if names is SEARCH:
            # both at once: with one acceleration for all, an error of the one hides that of the other
            path = here.max_acceleration_mm_s2 or UNLIMITED
            shares = [(r, z) for r in (1.0, 2.0, 4.0) for z in (0.5, 0.7, 1.0)]
            own_ones = [{RAPID: min(path * r, UNLIMITED), AXES: path * z} for r, z in shares]
            cost, trial = min((judged(_with(here, own)) for own in own_ones), key=lambda found: found[0])
            if cost < least * (1.0 - GAIN):
                least, here = cost, trial
        for factor in FACTORS:
            moved = True
            while moved:
                moved = False
                for name in names:
                    low, high, first = SEARCH[name]
                    own = _value(here, name)
                    now = own or first or here.max_acceleration_mm_s2 or UNLIMITED
                    for value in (now * factor, now / factor):
                        if low <= value <= high:
                            cost, trial = judged(_with(here, {name: float(f"{value:.4g}")}))
                            if cost < least * (1.0 - (GAIN if own is None else 1e-4)):
                                least, here, moved = cost, trial, True
                                break
                moved = moved and factor < 4.0
    return Fitted(here, least / float(logged.sum()), len(logged), float(logged.sum()), other)


def _with(limits: MachineLimits, numbers: dict[str, Any]) -> MachineLimits:
    axes = {name: (UNLIMITED, UNLIMITED, numbers[name]) for name in (AXES,) if name in numbers}
    return replace(limits, **{**numbers, **axes})


def _value(limits: MachineLimits, name: str) -> float | None:
    found = getattr(limits, name)
    value: float | None = found[2] if found and name == AXES else found
    return value


def _events(rest: Floats, events: Floats) -> Floats:
    """(5,) seconds of events, by least absolute deviations, none negative."""
    on = events.sum(axis=1) > 0
    if not on.any():
        return np.zeros(events.shape[1])
    from scipy.optimize import nnls  # half a second to load, for this command alone

    a, y = events[on], rest[on]
    weight = np.ones(len(y))
    cost = np.zeros(a.shape[1])
    for _ in range(30):
        root = np.sqrt(weight)
        cost = nnls(a * root[:, None], y * root)[0]
        weight = 1.0 / np.maximum(np.abs(y - a @ cost), 0.05)
    return np.asarray(cost)


def machine_text(fitted: Fitted, logs: Sequence[str]) -> str:
    """The file of a machine: a table [machine] with keys of a job file."""
    given = {name: value for name, value in asdict(fitted.limits).items() if name in (*SEARCH, *EVENTS)}
    about = f"{fitted.seconds:.0f} s in {fitted.windows} windows, mean error {100 * fitted.error:.2g} %"
    keys = (f"{name} = {list(v) if name == AXES else float(v)!r}" for name, v in given.items() if v)
    return "\n".join([f"# from {', '.join(logs)}: {about}", "[machine]", *keys]) + "\n"
