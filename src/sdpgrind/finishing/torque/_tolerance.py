"""Tolerance to contact stiffness: speed and robustness of a controller together."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.torque._controller import TorqueController
from sdpgrind.finishing.torque._simulate import simulate_axis

_GRID = 200  # chosen: factors tried before bisection
_BISECTIONS = 40  # chosen: to the rounding of the factor


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class StiffnessCase:
    """Figures of a controller on contacts of other stiffness than believed, from `worst_case`.

    Attributes
    ----------
    factors : array, (n,)
        True over believed k_e.
    settling_2, settling_5 : array, (n,)
        Settling to 2 and 5 %, mean over start angles, s; infinite: some run never does.
    overshoot : array, (n,)
        Mean over start angles, unit 1.
    ripple : array, (n,)
        Root mean square over start angles, N.
    stable : (float, float)
        Range of factors with a stable sampled loop.
    """

    factors: Floats
    settling_2: Floats
    settling_5: Floats
    overshoot: Floats
    ripple: Floats
    stable: tuple[float, float]

    @property
    def worst(self) -> dict[str, float]:
        """Worst of each figure over the factors: s, s, unit 1, N."""
        names = ("settling_2", "settling_5", "overshoot", "ripple")
        return {name: float(np.max(getattr(self, name))) for name in names}

    def __repr__(self) -> str:
        worst, (low, high) = self.worst, self.stable
        settled = f"5 % within {worst['settling_5']:.3g} s, overshoot {100 * worst['overshoot']:.3g} %"
        told = f"{settled}, ripple {worst['ripple']:.3g} N"
        factors = f"k_e x {self.factors.min():.3g} to {self.factors.max():.3g}"
        return f"StiffnessCase(at worst of {factors}: {told}; stable for k_e x {low:.3g} to {high:.3g})"

    def __str__(self) -> str:
        head = "k_e x   2 % (s)   5 % (s)   overshoot   ripple (N)"
        columns = (self.factors, self.settling_2, self.settling_5, self.overshoot, self.ripple)
        rows = (
            f"{f:5.3g}  {a:8.3f}  {b:8.3f}  {100 * o:8.1f} %   {r:10.4f}"
            for f, a, b, o, r in zip(*columns, strict=True)
        )
        low, high = self.stable
        return "\n".join([head, *rows, f"stable for k_e x {low:.3g} to {high:.3g}"])


def stiffness_range(
    controller: TorqueController, *, low: float = 0.05, high: float = 20.0
) -> tuple[float, float]:
    """Return the range of factors of k_e (unit 1) with a stable sampled loop, clipped to the requested one.

    (1, 1) for "constant": undamped, marginal at every stiffness.

    Parameters
    ----------
    controller : TorqueController
        Controller with its believed axis.
    low, high : float
        Requested range of factors; low < 1 < high.

    Raises
    ------
    ValueError
        The requested range does not contain 1.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> controller = fin.TorqueController(fin.TorqueAxis(), normal_force=1.111, kind="lqg")
    >>> [round(end, 2) for end in fin.torque.stiffness_range(controller)]
    [0.05, 4.35]
    """
    if not checks.positive("low", low) < 1.0 < checks.positive("high", high):
        raise ValueError(f"low and high must have 1 between them; got {low:g} and {high:g}")
    if controller.kind == "constant":
        return 1.0, 1.0
    return _edge(controller, low), _edge(controller, high)


def _edge(controller: TorqueController, end: float) -> float:
    """End of the stable range from 1 toward `end`."""
    inside = 1.0
    for factor in np.geomspace(1.0, end, _GRID)[1:]:
        if not _stable(controller, factor):
            return _between(controller, inside, float(factor))
        inside = float(factor)
    return end


def _between(controller: TorqueController, inside: float, outside: float) -> float:
    for _ in range(_BISECTIONS):
        middle = (inside * outside) ** 0.5
        inside, outside = (middle, outside) if _stable(controller, middle) else (inside, middle)
    return inside


def _stable(controller: TorqueController, factor: float) -> bool:
    axis = controller.axis
    truth = axis.replace(contact_angular_stiffness=factor * axis.contact_angular_stiffness)
    return controller.loop(truth, sampled_time=True).stable


def worst_case(
    controller: TorqueController,
    factors: Sequence[float] = (0.3, 0.5, 1.0, 2.0, 3.0),
    *,
    duration: float = 1.0,
    start_angles: int = 20,
) -> StiffnessCase:
    """Run a controller on contacts of other stiffness than believed: its speed and the price in tolerance.

    Choose a controller by the worst expected contact, not by the believed one.

    Parameters
    ----------
    controller : TorqueController
        Controller with its believed axis.
    factors : sequence of float
        True over believed k_e.
    duration : float
        Duration of each run, s.
    start_angles : int
        Number of start angles to average over.

    Raises
    ------
    ValueError
        A factor is not > 0.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> controller = fin.TorqueController(fin.TorqueAxis(), normal_force=1.111, kind="lqg")
    >>> case = fin.torque.worst_case(controller, factors=(0.5, 1.0))
    >>> round(case.worst["overshoot"], 2), case.stable[1] > 3
    (0.13, True)
    """
    found, axis = [], controller.axis
    for factor in factors:
        stiffness = checks.positive("factors", factor) * axis.contact_angular_stiffness
        truth = axis.replace(contact_angular_stiffness=stiffness)
        record = simulate_axis(controller, truth=truth, duration=duration, start_angles=start_angles)
        found.append(record.figures)
    names = ("settling_2", "settling_5", "overshoot", "ripple")
    figures = {name: np.array([one[name] for one in found]) for name in names}
    return StiffnessCase(np.array(factors, dtype=float), **figures, stable=stiffness_range(controller))
