"""Roots, intervals and quadratures that know nothing of milling."""
