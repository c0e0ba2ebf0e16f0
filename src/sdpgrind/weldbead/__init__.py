"""Weld-bead grinding: stochastic dynamic programming of a grinding sequence (Brown 1988).

Given a bead of mean height x and the time left to a deadline, `plan` says whether to stop, or which feed and normal force
the next pass should use, so that the expected penalty at the end of the whole sequence is least.
"""

from sdpgrind.base import faces

__getattr__, __dir__, __all__ = faces.attach(__name__, __file__, ("sequence",))
