"""Closed quads between nodes in and outside of the material, through the ends of rays (dual contouring)."""
