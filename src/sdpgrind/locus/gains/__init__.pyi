from ._analysis import GainDesign as GainDesign
from ._area_design import AreaDesign as AreaDesign
from ._decoupling import decoupling_gains as decoupling_gains
from ._decoupling import spectral_radius as spectral_radius
from ._design import design_gain as design_gain
from ._gain_schedule import GainSchedule as GainSchedule
