"""Torque axis: the motor that presses the tool, its observers and controllers."""
