"""Sampled control, shared by the areas: exact sampling, margins, laws that do not wind up.

Thin over `scipy`: what is here is what the areas need beyond it.
"""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
