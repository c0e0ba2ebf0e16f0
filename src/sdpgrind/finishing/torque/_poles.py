"""Poles of the closed loop, always with the observer, and the refusal of a loop that is not stable."""

import dataclasses
from math import inf

import numpy as np

from sdpgrind.base.checks import Complex
from sdpgrind.finishing.torque._axis import TorqueAxis
from sdpgrind.finishing.torque._law import Setting
from sdpgrind.finishing.torque._model import continuous, sampled

_EDGE = 1e-9  # how near to the edge a pole of the undamped axis may come, of its modulus


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class AxisPoles:
    """Poles of axis, controller and observer together.

    Attributes
    ----------
    continuous : array
        Of the loop in continuous time, 1/s, slowest first.
    sampled : array
        Of the loop as it is sampled, in the z plane (dimensionless), slowest first.
    sample_time : float
        s.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> print(fin.TorqueController(fin.TorqueAxis(), normal_force=1.111).poles)  # the source's observer is slower than its loop
    -16.54±8.88j, -20.55±45.68j, -114.41±57.79j 1/s; slowest sampled 0.983556±0.00862j
    """

    continuous: Complex
    sampled: Complex
    sample_time: float

    @property
    def slowest(self) -> float:
        """Least rate of decay of the two, 1/s; 0 or less: it does not decay."""
        modulus = float(np.max(np.abs(self.sampled)))
        return float(
            min(np.min(-self.continuous.real), -np.log(modulus) / self.sample_time if modulus else inf)
        )

    @property
    def stable(self) -> bool:
        """Whether all of them decay, dimensionless."""
        return bool(np.all(self.continuous.real < 0.0) and np.all(np.abs(self.sampled) < 1.0))

    def __repr__(self) -> str:
        return f"AxisPoles({self})"

    def __str__(self) -> str:
        largest = np.max(np.abs(self.sampled))
        slow = [pole for pole in self.sampled if abs(pole) > largest * (1 - _EDGE)]
        return f"{_text(self.continuous, '.2f')} 1/s; slowest sampled {_text(np.array(slow), '.6g')}"


def _text(poles: Complex, form: str) -> str:
    """Poles, pairs once."""
    one = (
        f"{p.real:{form}}" + (f"±{p.imag:{'.2f' if form == '.2f' else '.3g'}}j" if p.imag else "")
        for p in poles
        if p.imag >= 0
    )
    return ", ".join(one)


def poles_of(setting: Setting, truth: TorqueAxis | None = None) -> AxisPoles:
    """Both, of the axis as it is believed or as it is."""
    axis = setting.axis if truth is None else truth
    return AxisPoles(continuous(setting, axis).poles, sampled(setting, axis).poles, setting.axis.sample_time)


def check_stable(setting: Setting) -> None:
    """Refuse a loop that is not stable on the axis that is believed; without a loop the axis is undamped, and says so itself."""
    if setting.gains is None:
        return
    found = poles_of(setting)
    if not found.stable:
        raise ValueError(f"gains must make a stable loop on the axis that is believed; its poles are {found}")
