"""A plan of cells that finds the sweeps near a place."""
