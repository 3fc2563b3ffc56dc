"""Solids of sweeps whose axis leans or turns: grazing curves, sheets, caps, what is entered again, parts in time."""
