from ._circles import reference_circle as reference_circle
from ._cylinder import Cylinder as Cylinder
from ._profile import Profile as Profile
from ._roundness import Roundness as Roundness
from ._runout import Runout as Runout
from ._sections import Sections as Sections
from ._slope import Slope as Slope
from ._spectrum import Spectrum as Spectrum
