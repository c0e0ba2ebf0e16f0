"""Weld-bead grinding: stochastic dynamic programming of a grinding sequence (Brown 1988).

From the mean bead height and the time left to the deadline, `plan` decides whether to stop, or which feed and
normal force the next pass uses, for the least expected penalty of the whole sequence.
"""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__, ("sequence",))
