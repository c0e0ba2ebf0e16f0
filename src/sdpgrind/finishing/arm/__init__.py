"""Robots: kinematics of the arm and of serial robots, choice of branches, corners, torque per force."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
