"""Processes with drifting constraints: Koren's example, cutting, grinding, a motor axis; presets."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
