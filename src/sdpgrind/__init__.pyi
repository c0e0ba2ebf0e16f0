from . import control as control
from . import finishing as finishing
from . import identify as identify
from . import locus as locus
from . import physics as physics
from . import plunge as plunge
from . import sdp as sdp
from . import weldbead as weldbead
from .base import units as units
from .base.records import load as load
from .base.warm import warm as warm

__version__: str
