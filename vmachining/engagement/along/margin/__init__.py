"""How far a point of the edge is from cutting: stock, earlier sweeps, and what it moves into."""
