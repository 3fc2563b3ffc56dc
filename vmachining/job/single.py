"""The volume of one sweep, without any stock."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np

from vmachining.engines.mesh import solid
from vmachining.errors import EngineError, SweepError
from vmachining.interval import Interval
from vmachining.job.brep import note_of
from vmachining.job.files import atomic_path
from vmachining.sweep import Sweep, Turn
from vmachining.tolerance import CHORD_MM

ROUNDING = 1e-9
"""Relative rounding of a mesh volume."""

SWEEP_SECONDS = 120.0
"""Processor time of OCCT for the solid of one sweep; most take below ten."""

WIDE_RAD, WIDE_MISS_MM = 0.17, 1e-3
"""Axes that turn by more than ten degrees: solids of parts whose envelope folds may miss as much; what they miss is measured."""

LOOK = 0.02
"""Chord of the first look at a tool that turns, as a share of its radius."""

BREP_REL = 1e-7
"""What spline faces within 1e-6 mm of the truth, and the integral over them, can change of a volume."""


Report = Callable[[str], None]
"""Told what is done now, for who waits."""


def swept_volume(sweep: Sweep, chord: float = CHORD_MM, report: Report = lambda _: None) -> Interval:
    """Volume of a sweep, mm^3.

    Parameters
    ----------
    sweep : Sweep
    chord : float
        mm, about the distance between the inner and the outer solid.
    report : called before each of the long steps.

    Returns
    -------
    Interval
        lo and hi are the volumes of the inner and the outer solid of the mesh engine. estimate is the closed
        form or flux integral where the sweep has one (`sweep.volume`), otherwise the volume of the fair solid,
        or the end of the bracket it lies beyond. Not proven where the axis turns: outer meshes of whole sweeps are not.

    Raises
    ------
    EngineError
        The kernel failed, its inner solid is larger than its outer one, or the formula contradicts them.
    """
    standing = sweep.upright()
    if standing is not None:  # a leaning tool that does not turn: as if it stood, where walls are exact
        sweep = standing[0]
    lo, hi = (_volume(sweep, chord, side, report) for side in ("inner", "outer"))
    exact = sweep.volume
    noise = ROUNDING * hi
    if lo > hi + noise:
        raise EngineError(f"the inner solid has {lo:.9g} mm3, the outer one {hi:.9g}", engine="mesh")
    if exact is None:  # the fair solid is a guess: it moves neither bound
        fair = _volume(sweep, chord, "fair", report)
        found = Interval(min(lo, hi), min(max(fair, min(lo, hi)), hi), hi)
    elif lo - noise <= exact <= hi + noise:
        found = Interval(min(lo, exact), exact, max(hi, exact))
    else:
        raise EngineError(
            f"the formula gives {exact:.9g} mm3, outside of [{lo:.9g}, {hi:.9g}]", engine="mesh"
        )
    return found if standing is not None else found.stated()


def _first_look(sweep: Sweep) -> Interval:
    """Bracket by coarse facets, which take less time than the flux integral and fine facets of a wide turn."""
    lo, fair, hi = (
        float(solid(sweep, chord=LOOK * sweep.profile.max_radius, side=side).volume())
        for side in ("inner", "fair", "outer")
    )
    return Interval(lo, min(max(fair, lo), hi), hi, proven=False)


def _volume(sweep: Sweep, chord: float, side: Literal["inner", "fair", "outer"], report: Report) -> float:
    report(f"mesh of the {side} solid")
    return float(solid(sweep, chord=chord, side=side).volume())


def sweep_record(
    sweep: Sweep,
    chord: float = CHORD_MM,
    step: Path | None = None,
    report: Report = lambda _: None,
    *,
    brep: bool = True,
    seconds: float = SWEEP_SECONDS,
    known: Callable[[Interval], None] = lambda _: None,
) -> dict[str, Any]:
    """What `vmachining sweep` prints: bracket, and the B-rep solid where there is one (else null and why).

    OCCT works in a separate process: whatever happens to it is reported in `brep_note`. Where the sweep is a union
    of several solids, `brep_mm3` is what booleans of them find that agrees with the bracket.

    step : file to write the solids to. Where none exist, or the file does not read back the same,
    `step_refused` says why and nothing is written; the other values stand.
    report : called before each of the long steps. brep : False: the bracket only, and no STEP file.
    seconds : of a processor, for each thing that OCCT is asked: the solid, its booleans, the file.
    known : called with the bracket before OCCT begins, which may take much longer; before that with a coarser one where the
        axis turns.

    Raises EngineError: As `swept_volume`.
    """
    begin = time.perf_counter()
    if sweep.upright() is None and chord < LOOK * sweep.profile.max_radius:
        with suppress(EngineError):  # finer facets may do, and say what is wrong if not
            known(_first_look(sweep))
    bracket = swept_volume(sweep, chord, report)
    known(bracket)
    record: dict[str, Any] = {
        "volume_mm3": bracket.estimate, "lo_mm3": bracket.lo, "hi_mm3": bracket.hi, "proven": bracket.proven,
        "brep_mm3": None, "brep_valid": None, "brep_faces": None, "brep_note": None,
        "brep_solids": 0, "brep_fit_mm": None,
        "seconds": {"mesh": time.perf_counter() - begin},
    }  # fmt: skip
    begin = time.perf_counter()
    if not brep:
        return record | {"brep_note": "not asked"}
    report(f"B-rep solid, by OCCT in a separate process, within {seconds:g} s")
    record |= _from_brep(sweep, bracket, seconds)
    record["seconds"]["brep"] = time.perf_counter() - begin
    if step is not None:
        report(f"writing {step.name}")
        record["step_refused"] = _not_written(sweep, step, record, seconds)
    return record


def _not_written(sweep: Sweep, step: Path, record: Mapping[str, Any], seconds: float) -> str | None:
    """Write the solids of a sweep; why not, or None."""
    from vmachining.engines import brep

    # several solids are valid one by one, whatever booleans of them say
    if not record["brep_valid"] or (record["brep_mm3"] is None and record["brep_solids"] < 2):
        return f"no B-rep solid to write: {record['brep_note']}"
    try:
        with atomic_path(step) as temporary:
            brep.isolated(brep.write_sweep, temporary, sweep, *_miss(sweep), seconds=seconds)
    except (SweepError, EngineError) as exc:
        return str(exc)
    return None


def _miss(sweep: Sweep) -> tuple[float, ...]:
    """What solids of this sweep may miss, if more than usual."""
    if not isinstance(sweep.path, Turn) or sweep.upright() is not None:
        return ()
    turn = np.arccos(np.clip(sweep.path.axis(0.0) @ sweep.path.axis(1.0), -1.0, 1.0))
    return (WIDE_MISS_MM,) if turn > WIDE_RAD else ()


def _from_brep(sweep: Sweep, bracket: Interval, seconds: float) -> dict[str, Any]:
    """The columns brep_*."""
    from vmachining.engines import brep

    try:
        described = brep.isolated(brep.described, sweep, *_miss(sweep), seconds=seconds)
    except (SweepError, EngineError) as exc:
        return {"brep_note": str(exc)}
    record = {
        "brep_valid": all(one.valid and one.closed for one in described.solids),
        "brep_faces": sum(one.faces for one in described.solids),
        "brep_solids": len(described.solids),
        "brep_fit_mm": described.fit_mm,
    }
    found: float | None
    if len(described.solids) == 1:
        found = described.solids[0].volume
        if not bracket.holds(found, slack=ROUNDING * bracket.hi + BREP_REL * found):
            return record | {"brep_note": f"{found:.9g} mm3 lies outside of the bracket"}
        return record | {"brep_mm3": found}
    note = f"the sweep is a union of {len(described.solids)} solids"
    if described.points:  # booleans of parts that almost coincide do not end
        return record | {
            "brep_note": f"{note} within {described.fit_mm:.1g} mm, right at all of {described.points} points by exact distances"
        }
    (x, y, z), (a, b, c) = (sweep.bounds + [[-1.0], [1.0]]).tolist()
    around = brep.Blank("box", (x, y, z), (a, b, c))
    ((_, verdict),) = brep.check_blocks(around, [[sweep]], {0: bracket}, seconds=seconds)
    return record | {
        "brep_mm3": verdict.removed_mm3,
        "brep_note": ": ".join(filter(None, (note, note_of(verdict)))),
    }
