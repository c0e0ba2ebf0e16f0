"""Roughness after finishing: log-normal model, identification, cross-validation and repeated passes."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
