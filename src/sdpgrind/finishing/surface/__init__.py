"""Die surfaces: B-spline and rational B-spline patches with their curvature and area."""
