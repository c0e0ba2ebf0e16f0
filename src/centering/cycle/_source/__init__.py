"""The source's own planner, controller and stroke correction, as printed, to compare with."""
