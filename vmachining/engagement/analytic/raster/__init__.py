"""Highest points of triangles over a grid of upright lines."""
