# The condition itself, for all who ask it: numpy with arrays, kernels with numbers.

from typing import Any

from vmachining.jit import leaf


def speed(h: Any, rho: Any, n_r: Any, n_z: Any, v_m: Any, v_a: Any, s_m: Any) -> Any:
    """Normal speed f of the point of a circle in a direction m across the axis, or its part along any vector m there.

    h, rho, n_r, n_z : height, radius, normal of the circle. v_m = m.V, v_a = A.V, s_m = m.dA/dt.
    """
    return n_r * v_m + (h * n_r - rho * n_z) * s_m + n_z * v_a


normal_speed = leaf(speed)
