"""The arm that carries the tool: inverse kinematics, choice of branches, jumps at corners, lever of the force."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
