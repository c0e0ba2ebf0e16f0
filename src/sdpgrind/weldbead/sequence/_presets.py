"""Problems ready to use: P1 to P5, and C0, which has a closed form."""

from collections.abc import Callable

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.preset_info import PresetInfo as PresetInfo
from sdpgrind.weldbead.sequence._burn import ForceBurnLimit
from sdpgrind.weldbead.sequence._problem import SequenceProblem
from sdpgrind.weldbead.sequence._process import GrindingProcess
from sdpgrind.weldbead.sequence._scatter import Scatter

_SOURCE = "Brown (1988): K1, K2, mu, R, w, omega0 of section 5.5; charges of Fig. 5-4"
_CHOSEN = "length, reset, durations, force limit, scatter: chosen, as the source does not print its own"


def _base() -> SequenceProblem:
    return SequenceProblem(
        GrindingProcess(
            specific_energy=10.0,
            idle_power=100.0,
            friction_ratio=0.3,
            disk_radius=85.0,
            free_speed=500.0,
            speed_droop=0.0,
            bead_width=12.5,
        ),
        bead_length=50.0,
        reset_time=2.0,
        durations=range(6, 21, 2),
        force_max=50.0,
        burn_limit=None,
        scatter=Scatter("C1", 0.15, law="rayleigh"),
        height_max=2.0,
        horizon=60.0,
        stage=2.0,
        height_charge=sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)),
    )


def _quadratic() -> SequenceProblem:
    return _base().replace(
        free_speed=560.0,
        speed_droop=0.1,
        burn_limit=ForceBurnLimit(16.0),
        height_charge=sdp.Charge(under=sdp.Quadratic(2.0), over=sdp.Quadratic(20.0)),
        lateness_charge=sdp.Quadratic(0.01),
        late_window=60.0,
    )


def _scaled() -> SequenceProblem:
    return _base().replace(idle_power=0.0, scatter=Scatter("K1", 0.6), force_max=400.0, height_max=1.0)


_PRESETS: dict[str, tuple[Callable[[], SequenceProblem], str]] = {
    "P1": (_base, "fixed deadline, linear charges"),
    "P2": (lambda: _base().replace(lateness_charge=sdp.Linear(0.25)), "expensive time: 0.25 $/s late"),
    "P3": (lambda: _base().replace(lateness_charge=sdp.Linear(0.10)), "cheap time: 0.10 $/s late"),
    "P4": (lambda: _base().replace(burn_limit=ForceBurnLimit(16.0)), "P1 with a burn limit of force"),
    "P5": (_quadratic, "quadratic charges, late ones too; burn limit, drive with droop"),
    "C0": (_scaled, "no idle power, specific energy random: known in closed form"),
}


def preset(name: str) -> SequenceProblem:
    """Return a problem ready to use.

    Parameters
    ----------
    name : str
        Name from `presets`. Units of the problem: mm, s, N, W, J, $.

    Raises
    ------
    ValueError
        When there is no such preset.

    Examples
    --------
    >>> preset("P4").force_interval(20.0)[1].__round__(2)
    26.67
    """
    return _PRESETS[checks.one_of("name", name, _PRESETS)][0]()


def presets() -> tuple[PresetInfo, ...]:
    """Return name, content, source and calibration of every preset; units of the problems: mm, s, N, W, J, $.

    Examples
    --------
    >>> [info.name for info in presets()]
    ['P1', 'P2', 'P3', 'P4', 'P5', 'C0']
    """
    return tuple(PresetInfo(name, about, _SOURCE, _CHOSEN) for name, (_, about) in _PRESETS.items())
