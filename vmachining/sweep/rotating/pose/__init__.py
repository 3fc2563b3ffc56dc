"""One pose of a tool: where it is, how a line crosses it, how far a point is from it."""
