from ._derivatives import SurfaceDerivatives as SurfaceDerivatives
from ._fit_quality import FitQuality as FitQuality
from ._presets import cylinder_surface as cylinder_surface
from ._presets import flat_surface as flat_surface
from ._presets import nominal_surface as nominal_surface
from ._presets import sphere_surface as sphere_surface
from ._presets import uneven_surfaces as uneven_surfaces
from ._surface import Surface as Surface
