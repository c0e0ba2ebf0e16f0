"""Poles of the closed loop, observer included, and refusal of unstable loops."""

import dataclasses
from math import inf

import numpy as np

from sdpgrind.base.checks import Complex
from sdpgrind.finishing.torque._axis import TorqueAxis
from sdpgrind.finishing.torque._law import Setting
from sdpgrind.finishing.torque._model import continuous, sampled

_EDGE = 1e-9  # chosen: relative distance of an undamped pole from the limit of stability


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class AxisPoles:
    """Poles of axis, controller and observer together.

    Attributes
    ----------
    continuous : array
        Poles in continuous time, 1/s, slowest first.
    sampled : array
        Poles of the sampled loop in the z plane, slowest first.
    sample_time : float
        Sample time, s.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> print(fin.TorqueController(fin.TorqueAxis(), normal_force=1.111).poles)  # gains of the source
    -16.54±8.88j, -20.55±45.68j, -114.41±57.79j 1/s; slowest sampled 0.983556±0.00862j
    """

    continuous: Complex
    sampled: Complex
    sample_time: float

    @property
    def slowest(self) -> float:
        """Least decay rate of both loops, 1/s; <= 0: no decay."""
        modulus = float(np.max(np.abs(self.sampled)))
        return float(
            min(np.min(-self.continuous.real), -np.log(modulus) / self.sample_time if modulus else inf)
        )

    @property
    def stable(self) -> bool:
        """Whether all poles (1/s) decay."""
        return bool(np.all(self.continuous.real < 0.0) and np.all(np.abs(self.sampled) < 1.0))

    def __repr__(self) -> str:
        return f"AxisPoles({self})"

    def __str__(self) -> str:
        largest = np.max(np.abs(self.sampled))
        slow = [pole for pole in self.sampled if abs(pole) > largest * (1 - _EDGE)]
        return f"{_text(self.continuous, '.2f')} 1/s; slowest sampled {_text(np.array(slow), '.6g')}"


def _text(poles: Complex, form: str) -> str:
    """Poles as text, pairs once."""
    one = (
        f"{p.real:{form}}" + (f"±{p.imag:{'.2f' if form == '.2f' else '.3g'}}j" if p.imag else "")
        for p in poles
        if p.imag >= 0
    )
    return ", ".join(one)


def poles_of(setting: Setting, truth: TorqueAxis | None = None) -> AxisPoles:
    """Both sets of poles, of the believed or the true axis."""
    axis = setting.axis if truth is None else truth
    return AxisPoles(continuous(setting, axis).poles, sampled(setting, axis).poles, setting.axis.sample_time)


def check_stable(setting: Setting) -> None:
    """Refuse a loop that is unstable on the believed axis; "constant" is exempt, being marginal by design."""
    if setting.gains is None:
        return
    found = poles_of(setting)
    if not found.stable:
        raise ValueError(f"gains must make a stable loop on the axis that is believed; its poles are {found}")
