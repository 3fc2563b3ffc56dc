"""Bounds by planes and chords on polygons: cells cut at borders of footprints."""
