"""Integrals of what one sweep lies below another: where their surfaces cross."""
