"""The streaming estimator of a ring's circle, one reading at a time, and the source's own for comparison."""
