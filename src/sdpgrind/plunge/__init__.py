"""Cylindrical plunge grinding: cycles of least time without burned layers (Dong, Danai and Malkin 2004, Part 2)."""

from sdpgrind.plunge._model import PlungeModel, Wear
from sdpgrind.plunge._plan import CyclePlan, plan
from sdpgrind.plunge._presets import preset
from sdpgrind.plunge._problem import CycleProblem

__all__ = ["CyclePlan", "CycleProblem", "PlungeModel", "Wear", "plan", "preset"]
