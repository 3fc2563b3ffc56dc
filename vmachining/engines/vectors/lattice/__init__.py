"""Blocks against vectors along normals, which stand on lattices over facets and edges."""
