"""Blocks against the grid of upright vectors, many in one call, with the removal of each."""
