"""Robot arm and xy table: kinematics, choice of branches, jumps at corners, torque per force."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
