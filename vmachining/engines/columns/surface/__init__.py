"""Lower surface of a straight sweep of a convex cutter: value, tangent plane, curvature, border, cover."""
