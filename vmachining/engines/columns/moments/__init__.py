"""Integrals of a cutter's profile over polygons of the plan, as brackets from moments of distance."""
