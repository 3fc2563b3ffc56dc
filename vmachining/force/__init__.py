"""Engagement -> chip load -> force, torque, power; the only room with material constants.

1. `coefficients.py`: cutting and edge coefficients as polynomials of the height above the tip, in files and as shipped sets.
2. `model.py`: forces of all teeth at positions and rotation angles, from engaged intervals of any engine.
3. `turn.py`: the same at a place of a job's block, as functions of the feed, with exact ends of arcs and jumps.
4. `identify.py`: coefficients from mean forces of slot tests.
5. `measured.py`: a measured trace over the predicted forces.

| file | holds |
|---|---|
| `coefficients.py` | `Coefficients`, `shipped` |
| `model.py` | `edge_forces`, `Forces`, `power_w`, `cantilever_mm`, `deflection_force` |
| `turn.py` | `turn_load`, `Load`, `load_rows`, `feasible_feeds`, `peak_levels` |
| `identify.py` | `identify`, `layer_coefficients`, `predicted_means` |
| `measured.py` | `read_columns`, `read_trace`, `align`, `Overlay` |
| `_kernels.py` | sums along edges, Simpson over a turn, envelopes over the feed |

Forces act ON THE TOOL in the tool frame: x, y, z of `engagement.frames.rotation`, z along the tool axis. Source: Hendriko,
five-axis milling, chapter 7; the direction matrix, the order of its columns and the segments are corrected.

Known limits: teeth are equally spaced and have no run-out; chips are thick to first order in the feed; the tool does not
bend away from what it cuts; coefficients know nothing of speed and wear.
"""

from vmachining.force.coefficients import NAMES, Coefficients, shipped
from vmachining.force.identify import (
    Identification,
    LayerFit,
    SlotTests,
    identify,
    layer_coefficients,
    predicted_means,
    read_tests,
    smoothed,
)
from vmachining.force.measured import Overlay, Turns, align, read_trace
from vmachining.force.model import Forces, bull_edge, cantilever_mm, deflection_force, edge_forces, power_w
from vmachining.force.turn import (
    Component,
    Load,
    feasible_feeds,
    load_rows,
    peak_levels,
    turn_load,
    turn_series,
)

__all__ = [
    "NAMES", "Coefficients", "Component", "Forces", "Identification", "LayerFit", "Load", "Overlay", "SlotTests",
    "Turns", "align", "bull_edge", "cantilever_mm", "deflection_force", "edge_forces", "feasible_feeds", "identify",
    "layer_coefficients", "load_rows", "peak_levels", "power_w", "predicted_means", "read_tests", "read_trace",
    "shipped", "smoothed", "turn_load", "turn_series",
]  # fmt: skip
