"""Independent truths that tests compare with; no part of the package."""
