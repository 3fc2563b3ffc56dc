"""Engagement -> chip load -> force, torque, power; the only room with material constants.

1. `coefficients.py`: cutting and edge coefficients as polynomials of the height above the tip, in files and as shipped sets.
2. `segments.py`: the mechanistic model piece by piece: segments of an edge, elemental forces, direction matrix, lag.
3. `model.py`: forces of all teeth at positions and rotation angles, from engaged intervals of any engine.
4. `turn.py`: the same at a place of a job's block, as functions of the feed, with exact ends of arcs and jumps.
5. `closed.py`: closed forms for an upright tool: slots and shoulders.
6. `identify.py`: coefficients from mean forces of slot tests.

| file | holds |
|---|---|
| `coefficients.py` | `Coefficients`, `shipped` |
| `segments.py` | `edge_segments`, `elemental_forces`, `direction_matrix`, `force_on`, `segment_torque`, `helix_lag` |
| `model.py` | `edge_forces`, `Forces`, `power_w`, `cantilever_mm`, `deflection_force` |
| `turn.py` | `turn_load`, `Load`, `load_rows`, `feasible_feeds`, `peak_levels` |
| `closed.py` | `layer_integrals`, `tooth_force`, `slot_means`, `shoulder_means` |
| `identify.py` | `identify`, `layer_coefficients` |
| `_kernels.py` | sums along edges, Simpson over a turn, envelopes over the feed |

Forces act ON THE TOOL in the tool frame: x, y, z of `engagement.frames.rotation`, z along the tool axis. Source: Hendriko,
five-axis milling, chapter 7; the direction matrix, the order of its columns and the segments are put right.

Known limits: teeth are equally spaced and have no run-out; chips are thick to first order in the feed; the tool does not
bend away from what it cuts; coefficients know nothing of speed and wear.
"""

from vmachining.force.closed import (
    LayerIntegrals,
    layer_integrals,
    shoulder_means,
    slot_means,
    tooth_force,
)
from vmachining.force.coefficients import NAMES, Coefficients, shipped
from vmachining.force.identify import (
    Identification,
    LayerFit,
    SlotTests,
    identify,
    layer_coefficients,
    read_tests,
    smoothed,
)
from vmachining.force.model import (
    Forces,
    bull_edge,
    cantilever_mm,
    deflection_force,
    edge_forces,
    power_w,
)
from vmachining.force.segments import (
    direction_matrix,
    edge_segments,
    elemental_forces,
    engaged_chip,
    force_on,
    helix_lag,
    printed_direction_matrix,
    segment_torque,
    tooth_angles,
)
from vmachining.force.turn import (
    COMPONENTS,
    Component,
    Load,
    feasible_feeds,
    load_rows,
    peak_levels,
    turn_load,
    turn_series,
)

__all__ = [
    "COMPONENTS",
    "NAMES",
    "Coefficients",
    "Component",
    "Forces",
    "Identification",
    "LayerFit",
    "LayerIntegrals",
    "Load",
    "SlotTests",
    "bull_edge",
    "cantilever_mm",
    "deflection_force",
    "direction_matrix",
    "edge_forces",
    "edge_segments",
    "elemental_forces",
    "engaged_chip",
    "feasible_feeds",
    "force_on",
    "helix_lag",
    "identify",
    "layer_coefficients",
    "layer_integrals",
    "load_rows",
    "peak_levels",
    "power_w",
    "printed_direction_matrix",
    "read_tests",
    "segment_torque",
    "shipped",
    "shoulder_means",
    "slot_means",
    "smoothed",
    "tooth_angles",
    "tooth_force",
    "turn_load",
    "turn_series",
]
