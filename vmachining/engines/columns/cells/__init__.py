"""Proven bounds of the removed volume in one cell of the plan."""
