"""Bottom tier: force loop on a motor-driven table, designs, prediction; Brown (1988), ch. 7 and App. B."""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
