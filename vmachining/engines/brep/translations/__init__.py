"""Solids of sweeps whose tool stands upright: level lines and arcs, plunges, ramps, helices."""
