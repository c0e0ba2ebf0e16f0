"""Presets of plunge cycles."""

from collections.abc import Callable

from sdpgrind import physics, units
from sdpgrind.base import checks
from sdpgrind.base.preset_info import PresetInfo as PresetInfo
from sdpgrind.plunge._model.model import PlungeModel
from sdpgrind.plunge._model.problem import CycleProblem

_U0, _B = physics.malkin_burn_coefficients()
_MALKIN = physics.BurningLimit(u0=round(_U0, 3), B=round(_B, 2))  # in the digits of the presets


def _simulation() -> CycleProblem:
    model = PlungeModel(
        wheel_diameter=50.0,
        work_diameter=70.0,
        width=9.0,
        wheel_speed=units.m_per_s(37.0),
        work_rotation=units.hz(5.0),
        wear_flat_area=0.026,
        stiffness=8000.0,
        normal_force_ratio=9.78,
        power=physics.GrindingPower(
            specific_energy=13.8, ploughing_force=0.962, sliding=physics.DongSliding()
        ),
        burning=_MALKIN.replace(B=3.32),
        diffusivity=12.5,
        roundness_base=units.um(1.59),
        roundness_gain=2.75,
    )
    return CycleProblem(model, stock=0.282, command_rate_max=0.0448, roundness_max=units.um(3.0))


def _experiment() -> CycleProblem:
    model = _simulation().model.replace(
        burning=_MALKIN,
        roundness_base=0.0,
        roundness_gain=3.0633,
        linear_time_constant=1.9347,
    )
    return CycleProblem(model, stock=0.3634, command_rate_max=0.0255, roundness_max=units.um(3.0))


_SOURCE = "Dong, Danai and Malkin (2004): wheel, work, speeds, stiffness and wear of section 4, roundness"
_PRESETS: dict[str, tuple[Callable[[], CycleProblem], str, str, str]] = {
    "simulation": (
        _simulation,
        "the bore of the simulation, whose deflection follows the force",
        _SOURCE,
        "B, greatest rate, stock, force ratio and roundness: to the published times of 6.4, 15.7 and 13.2 s",
    ),
    "experiment": (
        _experiment,
        "the bore of the second experiment, with a linear lag;"
        " no work is burned, so that there are two segments",
        _SOURCE + "; rates and time constants of both experiments",
        "lag and roundness: to the roundness of both, 3.9 and 2.9 µm;"
        " stock: to the published 24.66 s over 1.38",
    ),
}


def preset(name: str) -> CycleProblem:
    """Return a problem ready to use.

    ``"simulation"``: the bore of Dong, Danai and Malkin (2004), section 4. The source prints wheel, work,
    speeds, stiffness, wear and roundness, but not Part 1, the model of burning: B, the greatest rate, the
    stock and the force ratio are *calibrated* to its published times (6.4, 15.7 and 13.2 s), which these
    therefore do not confirm.

    ``"experiment"``: the bore of their second experiment, whose rates do not burn hardened steel. The lag is
    linear; lag and roundness are *calibrated* to the out-of-roundness of both experiments at two time
    constants.

    Parameters
    ----------
    name : {"simulation", "experiment"}
        Name of the preset. Units of the problem: mm, s, N, W, J, rad.

    Raises
    ------
    ValueError
        If there is no such preset.

    Examples
    --------
    >>> preset("simulation").model.equivalent_diameter  # mm
    175.0
    >>> problem = preset("experiment")
    >>> problem.model.burn_rate > problem.command_rate_max, round(problem.time_constant, 4)  # s
    (True, 1.9347)
    """
    return _PRESETS[checks.one_of("name", name, _PRESETS)][0]()


def presets() -> tuple[PresetInfo, ...]:
    """Return name, content, source and calibration of every preset (units of the problems: mm, s, N, W, J).

    Examples
    --------
    >>> [info.name for info in presets()]
    ['simulation', 'experiment']
    """
    return tuple(PresetInfo(name, *words) for name, (_, *words) in _PRESETS.items())
