"""What the machine can do: feeds per axis, acceleration, and the time a program therefore takes.

Goal: given the paths of a program, say how fast the tool tip may go on each of them, and how long the
program lasts.

1. `limits.py`: the numbers of a machine, checked at birth. None means unlimited.
2. `caps.py`: how much of each axis a path uses (peak of |dq_i/ds|), and the tip feed at which the first
   axis reaches its limit.
3. `timing.py`: ideal time (length over feed) and time with bounded acceleration (trapezoidal profiles,
   junction speeds by a forward and a backward pass), and the share of the path that is fed.

| file | holds |
|---|---|
| `limits.py` | `MachineLimits` |
| `caps.py` | `line_peaks`, `arc_peaks`, `path_peaks`, `axis_caps`, `travel_caps` |
| `timing.py` | `BlockTimes`, `block_times`, `feed_path_ratio` |
| `axis.py`, `chain.py` | `Axis`, `Machine`: serial chains, forward and inverse kinematics, derivatives |
| `presets.py`, `machinefile.py` | machines by name and from TOML files: `load` |
| `classes.py` | `FrameMachine`: closed forms of the classes 2/0, 1/1, 0/2 |
| `orientation.py` | axis and angular velocity of the C-A head and the hexapod |
| `branches.py` | `follow`: one solution per pose along a path, `Jump` |
| `motion.py` | `JointMotion` (J), `TcpMotion` (R, V): tip and axis with derivatives over t |
| `deviation.py` | `tip_deviation`, `axis_deviation`, `pieces`, `straighten` |
| `joint_limits.py` | `travel_overruns`, `joint_caps`, `tcp_caps`: what the joints allow |
| `dda.py` | `line_train`, `arc_train`, `helix_train`, ...: pulses from adding registers |
| `pulses.py` | `Interpolator`: paths as pulse blocks, feed rate numbers, clocks, files, plot |
| `_kernels.py` | junction speeds, branch choice, registers |

Equations
---------
cap of a path        U = min_i vmax_i / max_s |dq_i/ds|                      (1)
                     for a straight block equal to U = L / max_i(|dq_i| / vmax_i)
junction speed       J_i <= min(v_i, v_{i+1}),  J_{i+1}^2 <= J_i^2 + 2 a L_i, both directions   (2)
peak speed           v_p = min(v_i, sqrt(a L_i + (J_i^2 + J_{i+1}^2) / 2))   (3)
time                 t = (v_p - J_i)/a + (v_p - J_{i+1})/a + (L - d_1 - d_2)/v_p   (4)

Known limits
------------
- Three linear axes. A rotary axis enters only through `travel_caps`, which takes any number of axes.
- The acceleration bounds the speed along the path. Corners cost nothing and arcs have no centripetal
  limit, so the accelerated time is a lower bound for a real control; jerk is unbounded.
- The accelerated time is reported, it never raises a feed.
"""

from vmachining.machine.axis import Axis, Kind
from vmachining.machine.branches import JointPath, Jump, follow, jumps
from vmachining.machine.caps import arc_peaks, axis_caps, line_peaks, path_peaks, travel_caps
from vmachining.machine.chain import Machine, Rates, Screws, Solutions, ToolPose
from vmachining.machine.classes import FrameMachine
from vmachining.machine.dda import (
    Train,
    arc_train,
    helix_train,
    line_limit,
    line_train,
    nearest_arc,
    pulse_counts,
    s1_quadrant_train,
)
from vmachining.machine.deviation import (
    AxisDeviation,
    TipDeviation,
    axis_deviation,
    pieces,
    straighten,
    tip_deviation,
)
from vmachining.machine.joint_limits import (
    Overrun,
    joint_caps,
    joint_peaks,
    least_times,
    tcp_caps,
    tcp_peaks,
    travel_overruns,
)
from vmachining.machine.limits import MachineLimits
from vmachining.machine.machinefile import load, machine_from_mapping, read_machine
from vmachining.machine.motion import JointMotion, TcpMotion, derivative_bounds
from vmachining.machine.orientation import (
    ca_acceleration,
    ca_axis,
    ca_omega,
    ca_rate,
    hexapod_matrix,
    hexapod_omega,
)
from vmachining.machine.presets import PRESETS, preset
from vmachining.machine.pulses import (
    Interpolator,
    PulseBlock,
    feed_rate_number,
    plot_pulses,
    source_clock_hz,
    write_csv,
    write_npz,
)
from vmachining.machine.timing import BlockTimes, block_times, feed_path_ratio

__all__ = [
    "PRESETS",
    "Axis",
    "AxisDeviation",
    "BlockTimes",
    "FrameMachine",
    "Interpolator",
    "JointMotion",
    "JointPath",
    "Jump",
    "Kind",
    "Machine",
    "MachineLimits",
    "Overrun",
    "PulseBlock",
    "Rates",
    "Screws",
    "Solutions",
    "TcpMotion",
    "TipDeviation",
    "ToolPose",
    "Train",
    "arc_peaks",
    "arc_train",
    "axis_caps",
    "axis_deviation",
    "block_times",
    "ca_acceleration",
    "ca_axis",
    "ca_omega",
    "ca_rate",
    "derivative_bounds",
    "feed_path_ratio",
    "feed_rate_number",
    "follow",
    "helix_train",
    "hexapod_matrix",
    "hexapod_omega",
    "joint_caps",
    "joint_peaks",
    "jumps",
    "least_times",
    "line_limit",
    "line_peaks",
    "line_train",
    "load",
    "machine_from_mapping",
    "nearest_arc",
    "path_peaks",
    "pieces",
    "plot_pulses",
    "preset",
    "pulse_counts",
    "read_machine",
    "s1_quadrant_train",
    "source_clock_hz",
    "straighten",
    "tcp_caps",
    "tcp_peaks",
    "tip_deviation",
    "travel_caps",
    "travel_overruns",
    "write_csv",
    "write_npz",
]
