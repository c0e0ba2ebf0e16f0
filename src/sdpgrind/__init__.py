"""Planning and control of grinding, finishing and precision centering under uncertainty.

From physics and its uncertainty follows a plan, which is plotted, saved and looked up in microseconds; a
controller follows it on a machine, real or simulated; the measurements improve the physics.

Packages are imported at first use: `sdpgrind.weldbead`, `sdpgrind.plunge`, `sdpgrind.locus`,
`sdpgrind.finishing`, and their common ground.
"""

from sdpgrind.base import faces
from sdpgrind.base import units as units

__version__ = "0.1.0"
__getattr__, __dir__, __all__ = faces.attach(__name__, __file__)
