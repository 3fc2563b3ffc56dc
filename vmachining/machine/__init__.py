"""The machine: joints <-> tool pose, what the joints allow, how long a program takes, and pulses for its motors.

A `Machine` is one serial chain from the workpiece over the bed to the tool: `load` reads one by name or from a file,
`forward` and `inverse` go between joints and pose, all branches returned, singular poses flagged. `follow` takes one
branch along a path, `tip_deviation` says how far joint-linear blocks leave the straight line. `MachineLimits` hold what
slides and joints allow, `drive` is how fast a path is driven within them. `Interpolator` makes pulses.

Joints are mm and rad in the order of the chain, home is every joint zero, the tool axis points from the tip to the spindle.

Imports `geometry` and the shared shelf; knows no program and no engine. Equations (1) to (7), conventions,
sources, departures and limits: docs/kinematics.md.
"""

from vmachining.machine.axis import Axis
from vmachining.machine.block_peaks import (
    Peaks,
    line_peaks,
    linear_peaks,
    path_peaks,
    peak_accelerations,
    peak_times,
    tcp_block_peaks,
)
from vmachining.machine.branches import JointPath, follow
from vmachining.machine.chain import Machine
from vmachining.machine.dda import arc_train, line_train, pulse_counts
from vmachining.machine.deviation import axis_deviation, tip_deviation
from vmachining.machine.hexapod import Hexapod
from vmachining.machine.limits import CORNER_TOLERANCE_MM, MachineLimits
from vmachining.machine.lookahead import Way, drive
from vmachining.machine.machinefile import load, read_parts
from vmachining.machine.presets import PRESETS, described, preset, preset_options, with_axes
from vmachining.machine.pulses import Interpolator, PulseBlock, write_csv, write_npz

__all__ = [
    "CORNER_TOLERANCE_MM", "PRESETS", "Axis", "Hexapod", "Interpolator", "JointPath", "Machine", "MachineLimits",
    "Peaks", "PulseBlock", "Way", "arc_train", "axis_deviation", "described", "drive", "follow", "line_peaks",
    "line_train", "linear_peaks", "load", "path_peaks", "peak_accelerations", "peak_times", "preset",
    "preset_options", "pulse_counts", "read_parts", "tcp_block_peaks", "tip_deviation", "with_axes", "write_csv",
    "write_npz",
]  # fmt: skip
