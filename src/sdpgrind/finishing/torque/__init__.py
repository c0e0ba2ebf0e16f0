"""Torque axis that presses the tool: controllers, poles, step responses, tolerances."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
