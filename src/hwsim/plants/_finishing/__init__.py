"""`FinishingCell`: a robot's torque axis that presses on a surface, table and gauges."""
