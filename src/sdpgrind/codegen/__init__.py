"""C99 from plans and controllers, with the same bits: translator of kernels, files, self-test, check."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
