"""`FinishingCell`: a robot whose torque axis presses the tool on a surface, with table and gauges."""
