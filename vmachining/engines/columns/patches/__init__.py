"""Integrals of sweeps over cells: ends, middles and the curves where they meet."""
