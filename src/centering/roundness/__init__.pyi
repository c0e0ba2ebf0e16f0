from ._circles import reference_circle as reference_circle
from ._profile import Profile as Profile
from ._roundness import Roundness as Roundness
from ._roundness_interval import RoundnessInterval as RoundnessInterval
from ._runout import Runout as Runout
from ._slope import Slope as Slope
from ._spectrum import Spectrum as Spectrum
