"""Planning and control of grinding, finishing and precision centering under uncertainty.

Physics and its uncertainty go in; a plan that can be looked at, saved and looked up in microseconds comes out; a
controller follows it on a machine, real or simulated; what was measured improves the physics.

Packages are imported when they are first used: `sdpgrind.weldbead`, `sdpgrind.plunge`, `sdpgrind.locus`,
`sdpgrind.finishing`, and what they stand on.
"""

from sdpgrind.base import faces
from sdpgrind.base import units as units

__version__ = "0.1.0"
__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
