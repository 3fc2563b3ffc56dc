"""Compiled parts of contact along programs; each module's legend says what its symbols are."""
