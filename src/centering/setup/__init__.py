"""Setting up for the next part type: changeover, allowance, stock, chatter."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
