"""Machines and poses for the tests of the machine room."""

from __future__ import annotations

import numpy as np

from vmachining.machine import PRESETS, Machine, preset

OPTIONS = {
    "ac-table": {"first_point": (1, -2, 3), "second_point": (-7, 5, -50)},
    "bc-table": {"first_point": (1, -2, 3), "second_point": (-7, 5, -50)},
    "ba-table": {"first_point": (1, -2, 3), "second_point": (-7, 5, -50)},
    "ab-table": {"first_point": (1, -2, 3), "second_point": (-7, 5, -50), "iso": True},
    "ca-head": {"pivot_mm": 150.0, "first_offset": (3, -4, 5)},
    "cb-head": {"pivot_mm": 150.0},
    "ab-head": {"pivot_mm": 150.0},
    "ba-head": {"pivot_mm": 80.0, "first_offset": (1, 2, 30)},
    "c-table-b-head": {"pivot_mm": 150.0, "table_point": (4, 5, 0)},
    "c-table-a-head": {"pivot_mm": 150.0, "table_point": (4, 5, 0), "iso": True},
    "nutating-head": {"pivot_mm": 150.0},
    "nutating-table": {"nutation_deg": 40.0, "table_point": (0, 3, -60)},
    "xyzac-trt": {"rot_point": (1, 2, 3)},
    "2/0": {"t12": (10, 20, 30), "t23": (0, 5, -40), "t34": (0, 0, -100)},
    "1/1": {"t12": (10, 20, 30), "t23": (0, 5, -40), "t34": (0, 0, -100)},
    "0/2": {"t12": (10, 20, 30), "t23": (0, 5, -40), "t34": (0, 0, -100)},
}
"""Presets with every offset different from zero."""

FIVE_AXIS = [name for name in PRESETS if name != "xyz"]


def machine(name: str) -> Machine:
    """A preset with offsets, a tool and a part that lies askew."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    return preset(name, **OPTIONS.get(name, {})).with_tool(75.0).with_work((11, -22, 33), turn)


def joints(m: Machine, rng: np.random.Generator, n: int) -> np.ndarray:
    """Random joints, (n, m.axes): slides within 300 mm, any angle."""
    q = rng.uniform(-300.0, 300.0, (n, len(m.axes)))
    q[:, list(m.rotary)] = rng.uniform(-np.pi, np.pi, (n, len(m.rotary)))
    return q
