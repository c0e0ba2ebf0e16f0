"""Robots: kinematics of arm and serial robots (URDF), axes under the work, branches, torque per force."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
