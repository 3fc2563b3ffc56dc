"""Engagement -> chip load -> force, torque, power; the only room with material constants."""

from vmachining.force.closed import (
    LayerIntegrals,
    layer_integrals,
    shoulder_means,
    slot_means,
    tooth_force,
)
from vmachining.force.coefficients import NAMES, Coefficients, shipped
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
from vmachining.force.turn import COMPONENTS, Component, Load, load_rows, turn_load
