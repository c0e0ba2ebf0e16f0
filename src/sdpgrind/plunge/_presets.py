"""Cycles ready to use."""

from sdpgrind import physics, units
from sdpgrind.base import checks
from sdpgrind.plunge._model import PlungeModel
from sdpgrind.plunge._problem import CycleProblem


def preset(name: str) -> CycleProblem:
    """Return a problem ready to use.

    ``"simulation"``: the bore of Dong, Danai and Malkin (2004), section 4, as their simulation has it. The source prints wheel,
    work, speeds, stiffness, wear and roundness; Part 1, with the model of burning, is missing: B, the greatest rate, the stock
    and the force ratio are *calibrated* to its published times (6.4, 15.7 and 13.2 s), so that these prove nothing.

    Parameters
    ----------
    name : {"simulation"}
        Which. Units of the problem: mm, s, N, W, J, rad.

    Examples
    --------
    >>> preset("simulation").model.equivalent_diameter  # mm
    175.0
    """
    checks.one_of("name", name, ("simulation",))
    model = PlungeModel(
        wheel_diameter=50.0,
        work_diameter=70.0,
        width=9.0,
        wheel_speed=units.m_per_s(37.0),
        work_rotation=units.hz(5.0),
        wear_flat_area=0.026,
        stiffness=8000.0,
        normal_force_ratio=9.78,
        power=physics.GrindingPower(specific_energy=13.8, ploughing_force=0.962, sliding=physics.DongSliding()),
        burning=physics.BurningLimit(u0=6.205, B=3.32),
        diffusivity=12.5,
        roundness_base=units.um(1.59),
        roundness_gain=2.75,
    )
    return CycleProblem(model, stock=0.282, command_rate_max=0.0448, roundness_max=units.um(3.0))
