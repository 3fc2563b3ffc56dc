"""Many straight blocks in one kernel call for rays along x and y: level ones of any cutter, and those of balls on any line."""
