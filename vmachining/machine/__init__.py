"""The machine: joints <-> tool pose, what the joints allow, how long a program takes, and pulses for its motors.

A `Machine` is one serial chain from the workpiece over the bed to the tool: `load` reads one by name or from a file,
`forward` and `inverse` go between joints and pose, all branches returned, singular poses flagged. `follow` takes one
branch along a path; `JointMotion` and `TcpMotion` are what happens between two positions, `tip_deviation` how far
joint-linear blocks leave the straight line. `travel_overruns`, `joint_caps` and `tcp_caps` say what the joints allow,
`MachineLimits`, `axis_caps` and `block_times` the same for three slides. `Interpolator` makes pulses.

Joints are mm and rad in the order of the chain, home is every joint zero, the tool axis points from the tip to the spindle.

Imports `geometry` and the shared shelf; knows no program and no engine. Equations (1) to (7), files, conventions,
sources, departures and limits: docs/kinematics.md.
"""

from vmachining.machine.axis import Axis, Kind
from vmachining.machine.block_peaks import (
    Peaks,
    linear_peaks,
    peak_accelerations,
    peak_times,
    tcp_block_peaks,
)
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
from vmachining.machine.described import described
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
    joint_accelerations,
    joint_caps,
    joint_peaks,
    least_times,
    tcp_caps,
    tcp_peaks,
    travel_overruns,
)
from vmachining.machine.limits import MachineLimits
from vmachining.machine.machinefile import load, machine_from_mapping, read_machine
from vmachining.machine.motion import JointMotion, TcpMotion, derivative_bounds, tip_lengths
from vmachining.machine.orientation import (
    ca_acceleration,
    ca_axis,
    ca_omega,
    ca_rate,
    hexapod_matrix,
    hexapod_omega,
)
from vmachining.machine.presets import PRESETS, preset, with_axes
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
    "Peaks",
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
    "described",
    "feed_path_ratio",
    "feed_rate_number",
    "follow",
    "helix_train",
    "hexapod_matrix",
    "hexapod_omega",
    "joint_accelerations",
    "joint_caps",
    "joint_peaks",
    "jumps",
    "least_times",
    "line_limit",
    "line_peaks",
    "line_train",
    "linear_peaks",
    "load",
    "machine_from_mapping",
    "nearest_arc",
    "path_peaks",
    "peak_accelerations",
    "peak_times",
    "pieces",
    "plot_pulses",
    "preset",
    "pulse_counts",
    "read_machine",
    "s1_quadrant_train",
    "source_clock_hz",
    "straighten",
    "tcp_block_peaks",
    "tcp_caps",
    "tcp_peaks",
    "tip_deviation",
    "tip_lengths",
    "travel_caps",
    "travel_overruns",
    "with_axes",
    "write_csv",
    "write_npz",
]
