"""Closed integrals over the patches of a ball's sweep."""
