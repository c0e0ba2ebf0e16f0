"""Planner, controller and stroke correction of the source, as printed, for comparison."""
