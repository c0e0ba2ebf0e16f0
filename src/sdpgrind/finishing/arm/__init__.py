"""The robot: poses of its tool, force from torque, joints forward and inverse, branches."""
