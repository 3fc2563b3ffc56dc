"""A measured trace over a prediction: the trace is a slot in closed form, with an entry, noise, and faults of traces."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from tinyjob import JOB, write_job

import vmachining as vm
from tests.oracles.force_closed import tooth_force
from vmachining.errors import InputError
from vmachining.force import align, read_trace
from vmachining.force.identify import layer_integrals
from vmachining.job.predict import measured_table, predict

K0 = (700.0, 250.0, 120.0, 25.0, 18.0, 4.0)
REV, TEETH, FEED, RADIUS = 8000.0, 2, 600.0, 2.0
FORCE = '\n[force]\ncoefficients = "aluminium_like_constant"\n'
BEFORE, LASTS, TURN = 0.1, 0.5, 0.3  # s before the entry, s, turns of the first tooth there


@cache
def found():
    """Block 2 of the tiny job: along +x from x = -4, one millimetre deep, stock from x = 0."""
    with TemporaryDirectory() as folder:
        job = JOB.replace("length_mm = 20", "length_mm = 20\nflutes = 2")
        return predict(vm.Job.load(write_job(Path(folder), job=job + FORCE)), [2])


def slot(samples=40, rev=REV):
    """Time and force from 0.1 s before the rim of the cutter meets the stock."""
    t = np.arange(0.0, LASTS, 60.0 / rev / samples)
    x = -RADIUS + (t - BEFORE) * FEED / 60.0
    phi = 2.0 * np.pi * (TURN + t * rev / 60.0)
    layer, force = layer_integrals(0.0, 1.0, 0.0), np.zeros((len(t), 3))
    for tooth in range(TEETH):
        angle = phi + 2.0 * np.pi * tooth / TEETH
        cuts = x + RADIUS * np.sin(angle) > 0.0
        force += np.where(cuts[:, None], tooth_force(angle, layer, FEED / TEETH / REV, K0), 0.0)
    return t, force


def written(folder, t, force, *, first="time_s", names="fx_n,fy_n,fz_n", kept=slice(None)):
    path = folder / "trace.csv"
    lines = [f"{a!r},{x!r},{y!r},{z!r}" for a, (x, y, z) in zip(t.tolist(), force.tolist(), strict=True)]
    path.write_text("\n".join([f"{first},{names}", *np.array(lines)[kept]]) + "\n", encoding="utf-8")
    return path


def laid(path, **options):
    return align(found().turns(), read_trace(path, **options))


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_slot_in_closed_form_is_found_where_it_was_cut(tmp_path, noise):
    t, force = slot()
    force = force + noise * np.abs(force).max() * np.random.default_rng(4).standard_normal(force.shape)
    over = laid(written(tmp_path, t, force))
    begin = found().stations["time_s"].min()
    # 2 mm of air before the rim meets the stock; stations are 0.5 mm apart
    assert over.start_s == pytest.approx(begin + 0.2 - BEFORE, abs=0.02)
    # two teeth look alike: the angle is known but for a pitch
    assert (over.turn * TEETH) % 1.0 == pytest.approx(TURN * TEETH % 1.0, abs=0.02)
    full = t > BEFORE + 0.3
    top = np.abs(force[full]).max()
    # 1 % of interpolation between angles of ten degrees, where a tooth enters
    rms = np.sqrt(((over.predicted - over.measured)[full] ** 2).mean(axis=0)) / top
    assert (rms < 0.02 + 1.1 * noise).all()
    if not noise:
        # on entry, revolutions 0.05 s apart are interpolated
        assert not over.notes and over.correlation > 0.97
        assert over.axes["y"].mean_n == pytest.approx(over.axes["y"].mean_measured_n, rel=0.02)
    table = measured_table(over)
    assert table["fx_measured_n"].to_numpy() == pytest.approx(force[:, 0]) and set(table["block"]) <= {2, -1}


def test_an_angle_stands_for_time(tmp_path):
    t, force = slot()
    by_time = laid(written(tmp_path, t, force))
    by_angle = laid(written(tmp_path, t * REV * 6.0 + 77.0, force, first="phi_deg"), rev_min=REV)
    assert by_angle.start_s == pytest.approx(by_time.start_s, abs=1e-4)
    workpiece = laid(written(tmp_path, t, -force), on="workpiece")
    assert workpiece.axes["x"].rms_n == pytest.approx(by_time.axes["x"].rms_n, rel=1e-3)


NAMED = {
    "gap": (lambda t, f: (np.delete(t, slice(900, 1100)), np.delete(f, slice(900, 1100), axis=0)), "1 gaps; the largest"),
    "kN": (lambda t, f: (t, f / 1000.0), "kN instead of N?"),
    "lbf": (lambda t, f: (t, f / 4.4482216), "lbf instead of N?"),
    "few": (lambda t, f: (t[::5], f[::5]), "4 samples from tooth to tooth"),
    "speed": (lambda t, f: (t * 1.37, f), "another spindle speed"),
    "side": (lambda t, f: (t, -f), "--on workpiece"),
    "program": (lambda t, f: (t, f[:, [1, 2, 0]] * np.sign(np.sin(40.0 * t))[:, None]), "another program"),
}  # fmt: skip


@pytest.mark.parametrize("case", NAMED)
def test_a_fault_of_a_trace_is_named(tmp_path, case):
    spoil, told = NAMED[case]
    over = laid(written(tmp_path, *spoil(*slot())))
    assert any(told in note for note in over.notes), over.notes


REFUSED = {
    "milliseconds": ({"first": "time_ms"}, {}, "'time_ms' has no unit or another one"),
    "kilonewton": ({"names": "fx_kn,fy_n,fz_n"}, {}, "'fx_kn'"),
    "component": ({"names": "fx_n,fy_n,mz"}, {}, "'fz_n' is missing"),
    "falls": ({"kept": slice(None, None, -1)}, {}, ":3: time_s does not rise"),
    "angle": ({"first": "phi_deg"}, {}, "phi_deg needs a spindle speed"),
    "short": ({"kept": slice(20)}, {}, "where one revolution takes 0.0075 s"),
    "sparse": ({"kept": slice(None, None, 12)}, {}, "1.67 samples from tooth to tooth"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_no_search_can_lay_over_is_refused(tmp_path, case):
    options, more, told = REFUSED[case]
    with pytest.raises(InputError, match=told.replace("'", ".")):
        laid(written(tmp_path, *slot(), **options), **more)
