"""Problems ready to use."""

from collections.abc import Callable

from sdpgrind import units
from sdpgrind.base import checks
from sdpgrind.base.preset_info import PresetInfo as PresetInfo
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus.processes._dressed_grinding import DressedGrinding
from sdpgrind.locus.processes._grinding import Grinding
from sdpgrind.locus.processes._koren_example import KorenExample
from sdpgrind.locus.processes._motor import MotorAxis
from sdpgrind.locus.processes._roughness import Roughness
from sdpgrind.locus.processes._turning import Turning

MINUTE = 60.0  # derived: s


def _m_per_min(value: float) -> float:
    return units.m_per_s(value / MINUTE)


def _koren_example() -> Problem:
    return Problem(
        model=KorenExample(), controls={"u": (0.0, 5.0), "v": (0.0, 10.0)}, hidden={"x": (0.2, 20.0)}
    )


def _turning() -> Problem:
    model = Turning(
        tool_change_time=3.5 * MINUTE,
        life=15.0 * MINUTE,
        life_speed=_m_per_min(180.0),
        life_feed=0.3,
        taylor_v_exp=4.0,
        taylor_f_exp=1.6,
        feed_force=3400.0,
        force_exponent=0.75,
        speed_force=1.2 / _m_per_min(1.0),
        wear_force=1200.0,
        breaking_force=2860.0,
        breaking_exponent=0.5,
    )
    speeds = (_m_per_min(60.0), _m_per_min(350.0))
    return Problem(
        model=model,
        controls={"cutting_speed": speeds, "feed": (0.02, 0.5)},
        hidden={"flank_wear": (0.0, 0.58)},
    )


def _milling() -> Problem:
    model = Turning(
        tool_change_time=10.0 * MINUTE,
        life=45.0 * MINUTE,
        life_speed=_m_per_min(180.0),
        life_feed=0.15,
        taylor_v_exp=3.0,
        taylor_f_exp=1.2,
        feed_force=12000.0,
        force_exponent=0.75,
        speed_force=1.0 / _m_per_min(1.0),
        wear_force=3000.0,
        power_max=14000.0,
    )
    speeds = (_m_per_min(60.0), _m_per_min(300.0))
    return Problem(
        model=model,
        controls={"cutting_speed": speeds, "feed": (0.05, 0.25)},
        hidden={"flank_wear": (0.0, 0.6)},
    )


def _wheel() -> Grinding:
    return Grinding(wheel_diameter=300.0, work_diameter=60.0, width=9.3, wheel_speed=units.m_per_s(30.0))


_MACHINE = {"infeed_rate": (units.um(0.1), units.um(50.0)), "work_rotation": (0.4, 63.0)}


def _grinding() -> Problem:
    return Problem(model=_wheel(), controls=_MACHINE, hidden={"wear_flat_area": (0.004, 0.0104)})


def _grinding_roughness() -> Problem:
    roughness = Roughness(roughness_max=units.um(0.8), base=units.um(0.5), exponent=0.4)
    return Problem(
        model=DressedGrinding(grinding=_wheel().replace(roughness=roughness), area=0.006, area_exponent=0.35),
        controls={**_MACHINE, "dressing_lead": (0.05, 0.5)},
        hidden={"dullness": (0.8, 1.6), "dressing_state": (0.7, 1.4)},
    )


def _motor() -> Problem:
    model = MotorAxis(inertia_base=100.0, torque_max=1000.0, angle=60.0)
    ranges = {"speed": (10.0, 300.0), "acceleration": (100.0, 20000.0)}
    return Problem(model=model, controls=ranges, hidden={"inertia": (50.0, 1500.0)})


_PRESETS: dict[str, tuple[Callable[[], Problem], str, str, str]] = {
    "koren-example": (
        _koren_example,
        "the example of Koren's paper: a circle as locus",
        "Koren (1989), (14) to (18), (25), (26)",
        "nothing",
    ),
    "turning": (
        _turning,
        "turning while the force of a worn tool nears the force that breaks it",
        "forms: Koren (1989), (1) to (6), (27), (30); he prints no numbers",
        "all numbers: 2 mm deep in medium carbon steel, so that the limit is met at 0.16 mm of wear",
    ),
    "milling": (
        _milling,
        "face milling while a worn cutter nears the power of the machine;"
        " the best feed is always the greatest",
        "forms: Koren (1989), (1) to (6), (30), and (28) as what cutting needs",
        "all numbers: 7.5 mm of edge in medium carbon steel, so that the limit is met at 0.1 mm of wear",
    ),
    "grinding": (
        _grinding,
        "plunge grinding of a shaft while a wheel that dulls nears the burning power;"
        " Koren's Fig. 7 at D_e = 50 mm",
        "power: Brown (1988), (4.2), units mended; burning: Malkin, as in Brown (4.3);"
        " wheel speed: Koren (1989), Fig. 7",
        "diameters and width: to the published 28 s and 4 s of his cycles;"
        " beyond an area of 0.01054 everything burns",
    ),
    "grinding-roughness": (
        _grinding_roughness,
        "the same with roughness as second limit and the dressing lead as third control",
        "as grinding; roughness and wear flats of the dressing: forms of Malkin and Koren (1980)",
        "as grinding, and all numbers of roughness and dressing: no source prints them",
    ),
    "motor": (
        _motor,
        "a joint that turns by 60 rad in the least time with a load whose inertia drifts",
        "response and limit: Koren (1989), (20) to (22)",
        "cost (time of the move) and all numbers: so that the greatest speed holds up to 567 kg mm^2",
    ),
}


def preset(name: str) -> Problem:
    """Return a problem of the literature.

    ``"koren-example"``: the example of Koren (1989). ``"turning"``, ``"milling"``: a worn tool that may
    break, or exceeds the power of the machine; forms of Koren, all numbers *chosen*. ``"grinding"``: a
    dulling wheel, Malkin's laws; diameters and width are *calibrated* to Koren's 28 s and 4 s, which are
    therefore no test. ``"grinding-roughness"``: two hidden states, two constraints, three controls; its
    dressing is *chosen*. ``"motor"``: Koren's motor; cost and numbers are *chosen*.

    Parameters
    ----------
    name : {"koren-example", "turning", "milling", "grinding", "grinding-roughness", "motor"}
        Name. Units of the problem: mm, s, N, W, J, rad.

    Raises
    ------
    ValueError
        When the name is unknown.

    Examples
    --------
    >>> problem = preset("grinding")
    >>> problem.names, problem.hidden["wear_flat_area"], problem.unit("grinding_power")
    (('infeed_rate', 'work_rotation'), (0.004, 0.0104), 'W')
    """
    return _PRESETS[checks.one_of("name", name, _PRESETS)][0]()


def presets() -> tuple[PresetInfo, ...]:
    """Return name, content, source and calibration of all presets (units: mm, s, N, W, J, rad).

    Examples
    --------
    >>> [info.name for info in presets()]
    ['koren-example', 'turning', 'milling', 'grinding', 'grinding-roughness', 'motor']
    """
    return tuple(PresetInfo(name, *words) for name, (_, *words) in _PRESETS.items())
