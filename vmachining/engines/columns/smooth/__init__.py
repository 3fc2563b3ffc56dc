"""Bounds where surfaces are smooth, and which of two surfaces lies above the other."""
