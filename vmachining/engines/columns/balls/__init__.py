"""Closed integrals of balls over cells."""
