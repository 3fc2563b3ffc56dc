"""The machine: joints <-> tool pose, what the joints allow, how long a program takes, and pulses for its motors.

Goal: say where the tool is for any position of the joints and which positions of the joints bring it there;
what happens between two positions; how fast that may go; and what a pulse generator would make of it.

    m = load("ac-table", second_point=(0, 0, -50))      # or load("machine.toml")
    pose = m.forward(m.joints(x=10, a=30, c=45))        # tip and tool axis in the part
    path = follow(m, tips, axes)                        # joints of a whole path, one solution per pose
    tip_deviation(m, path.joints[:-1], path.joints[1:]) # how far joint-linear blocks leave the straight line

1. A machine is one serial chain, listed from the workpiece over the bed to the tool (`axis.py`, `chain.py`).
   Forward kinematics is the product of its joints; the inverse solves the two rotary axes by a spherical
   triangle, which keeps its digits next to singularities, and the slides by a linear system. All branches are
   returned; singular poses and poses out of reach are flagged, not guessed.
2. Along a path one branch is taken: the shortest rotary move inside the travels (`branches.py`).
3. Between two positions joints may be linear (J), or the tip straight with linear rotary joints (R) or with the
   tool axis on a great circle (V): `motion.py`. `deviation.py` bounds how far J leaves the straight line and
   cuts a block until it does not.
4. Travels, speeds and accelerations of the joints cap the feed (`joint_limits.py`); three-axis paths have closed
   forms (`caps.py`), the numbers of a three-axis job are in `limits.py`, its time in `timing.py`.
5. `dda.py` and `pulses.py` send the paths of a three-axis program as pulses of adding registers.

| file | holds |
|---|---|
| `axis.py`, `chain.py` | `Axis`, `Machine`: serial chains, forward and inverse kinematics, derivatives |
| `presets.py`, `machinefile.py` | machines by name and from TOML files: `load` |
| `classes.py` | `FrameMachine`: closed forms of the classes 2/0, 1/1, 0/2 |
| `orientation.py` | axis and angular velocity of the C-A head and the hexapod |
| `branches.py` | `follow`: one solution per pose along a path, `Jump` |
| `motion.py` | `JointMotion` (J), `TcpMotion` (R, V): tip and axis with derivatives over t |
| `deviation.py` | `tip_deviation`, `axis_deviation`, `pieces`, `straighten` |
| `joint_limits.py` | `travel_overruns`, `joint_caps`, `tcp_caps`: what the joints allow |
| `block_peaks.py` | `tcp_block_peaks`, `peak_times`: the fastest moment inside many blocks at once |
| `limits.py` | `MachineLimits` |
| `described.py` | `described`: where the rotary axes lie, in words |
| `caps.py` | `line_peaks`, `arc_peaks`, `path_peaks`, `axis_caps`, `travel_caps` |
| `timing.py` | `BlockTimes`, `block_times`, `feed_path_ratio` |
| `dda.py` | `line_train`, `arc_train`, `helix_train`, ...: pulses from adding registers |
| `pulses.py` | `Interpolator`: paths as pulse blocks, feed rate numbers, clocks, files, plot |
| `_kernels.py` | junction speeds, branch choice, registers |

Equations
---------
cap of a path        U = min_i vmax_i / max_s |dq_i/ds|                      (1)
                     for a straight block equal to U = L / max_i(|dq_i| / vmax_i)
junction speed       J_i <= min(v_i, v_{i+1}),  J_{i+1}^2 <= J_i^2 + 2 a_i L_i, both directions (2)
peak speed           v_p = min(v_i, sqrt(a_i L_i + (J_i^2 + J_{i+1}^2) / 2)) (3)
time                 t = (v_p - J_i)/a_i + (v_p - J_{i+1})/a_i + (L - d_1 - d_2)/v_p   (4)
joints at a tip feed U = L min_i min( v_i / max|q_i'|, sqrt(a_i / max|q_i''|) )    (5)
chain                p = Mw^-1 T_1(q_1) ... T_m(q_m) tip,  u = rot(Mw^-1 T_1 ... T_m) k         (6)
bow of a block       |p(t) - straight| <= max|p''| / 8                       (7)

Conventions
-----------
- Joints are mm and rad, in the order of the chain; `Machine.joints` and `Machine.named` speak names and degrees.
- Home is every joint zero. Axes, points, tip and part frame of a chain are given there, in machine axes.
- A joint counts positive as its `sign` says, see `Axis`. Presets count tables by their physical motion (-1).
- The tool axis points from the tip to the spindle. `with_tool` hangs a tool below the gauge point, `with_work`
  places the part. A work offset of a program is added to the joint values by whoever reads the program.
- For sweeps: `Machine.screws` gives the chain as rows in the part frame, `Machine.tip_centred` the chain whose
  joint-linear blocks are the blocks of tool-centre-point control.

Sources
-------
Chapters 2 and 3 of an Indonesian book on five-axis milling (classes of machines, head models), with its misprints
corrected where the docstrings say so; the second subproblem of Paden and Kahan (Murray, Li, Sastry: A Mathematical
Introduction to Robotic Manipulation, 1994); the documented behaviour of LinuxCNC's `xyzac-trt` and `xyzbc-trt`; a
thesis on a DDA engraving machine (mode `s1`).

Departures
- Orientation by three sides of a spherical triangle instead of dot products: those lose half of their digits
  where the tool is nearly parallel to the first rotary axis.
- The sources give tool-frame components as machine coordinates; they are those only if no head axis turns the
  slides (`FrameMachine.slides`).
- The DDA compares with >=, starts half full, and moves x before y adds it; `s1` keeps the listing's errors.

Known limits
------------
- The inverse wants three slides and at most two rotary axes that are not parallel. The hexapod is an orientation
  model; its legs are not modelled. Forward kinematics and motions take any chain.
- `follow` decides pose by pose. It always finds a way inside the travels if every pose has one, but not the one
  with the fewest rewinds.
- Peaks of `tcp_caps` are sampled, with the nearest point to the first rotary axis added for great circles; those of
  `tcp_block_peaks` too, with the error of sampling added.
- A joint may use its whole acceleration for the bend of a block and again for its ramps.
- The acceleration of `block_times` bounds the speed along the path, block by block. Corners cost nothing and arcs have no
  centripetal limit, so the accelerated time is a lower bound for a real control; jerk is unbounded. It is
  reported and never raises a feed.
- Limits of DDA arcs are measured over all radii to 500 BLU, not proven: 1 BLU for quadrants, 1.2 for circles,
  2.5 for any arc. Those of lines and the ends of all blocks are proven.
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
