"""Blocks of ball cutters against vectors along normals, many in one call, by closed forms."""
