"""Further runs at and between the levels, where the best may lie.

A quadratic b x + c x^2 with c < 0 has its peak at x = -b/(2c), below each place of negative slope b + 2 c x.
Student's law of the slope is therefore the distribution of the peak (Fieller); n further runs are placed at
the middles of n parts of equal probability. Levels tied with the best are tried in its place.
"""

import dataclasses
from collections.abc import Iterator, Sequence
from itertools import combinations, islice, product
from typing import TYPE_CHECKING, overload

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtrit

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.finishing.study._best import Best, best
from sdpgrind.finishing.study._pooling import Pool
from sdpgrind.finishing.study._reading import law_of_a_reading
from sdpgrind.finishing.study._settings import Level
from sdpgrind.finishing.study._surface_fit import FactorAxis, SurfaceFit, surface_fit
from sdpgrind.finishing.study._texts import amount, level

if TYPE_CHECKING:
    from sdpgrind.finishing.study._observations import Observations


@dataclasses.dataclass(frozen=True)
class NextRun:
    """One further run.

    Attributes
    ----------
    settings : mapping of str to level
        Level of each factor with an effect, in its own unit.
    mean, sd : float
        Mean and standard deviation of its ratio over as many readings as each run of the study has, dB, with
        the uncertainty of the surface.
    law : sdp.Law
        Distribution of one reading: where smaller or larger is better, log-normal in the unit of the
        response, with the scatter of readings within runs; for other ratios normal, of the ratio in dB.
    why : str
        Purpose.
    """

    settings: dict[str, Level]
    mean: float
    sd: float
    law: sdp.Law
    why: str


@dataclasses.dataclass(frozen=True, repr=False)
class NextRuns(Sequence[NextRun]):
    """Further runs, and other findings from the surface.

    Attributes
    ----------
    runs : tuple of NextRun
        Runs; each mean in dB.
    gain : float
        Best of the surface minus its value at the best combination of levels, dB.
    notes : tuple of str
        Factors that are best at an end of their range; the reason for fewer runs than requested.
    unit : str
        Unit of the response.
    """

    runs: tuple[NextRun, ...]
    gain: float
    notes: tuple[str, ...]
    unit: str

    @overload
    def __getitem__(self, index: int) -> NextRun: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[NextRun]: ...
    def __getitem__(self, index: int | slice) -> NextRun | Sequence[NextRun]:
        """Return a run (its mean in dB), or a slice of runs."""
        return self.runs[index]

    def __len__(self) -> int:
        return len(self.runs)

    def __iter__(self) -> Iterator[NextRun]:
        return iter(self.runs)

    def __repr__(self) -> str:
        lines = []
        for run in self.runs:
            where = ", ".join(f"{name} {_short(value)}" for name, value in run.settings.items())
            unit = self.unit if isinstance(run.law, sdp.LogNormal) else "dB"
            mean, sd = amount(float(run.law.mean), unit), amount(float(run.law.sd), unit)
            lines.append(f"{where}: {mean} +- {sd}; {run.why}")
        promise = [f"the surface promises {self.gain:.2f} dB over the best levels"] if lines else []
        return "\n".join([*lines, *promise, *self.notes])


def _short(value: Level) -> str:
    return f"{value:.4g}" if isinstance(value, float) else level(value)


def next_runs(study: "Observations", number: int, pool: Pool) -> NextRuns:
    """Further runs of a study; see `Study.next_runs`."""
    number = checks.count("number", number)
    if study.interactions:
        raise ValueError("next_runs must be asked of a study without interactions: its surface has none")
    found, fit = best(study, pool, 0.05), surface_fit(study, pool)
    inside = [axis for axis in fit.axes if _peak(fit, axis) is not None]
    tops = {axis.factor: _top(fit, axis, found[axis.factor]) for axis in fit.axes}
    if not fit.axes:
        note = "no factor shows an effect: no further run is worth more than another"
        return NextRuns((), 0.0, (note,), study.unit)
    outside = [axis for axis in fit.axes if axis not in inside]
    swaps = [swap for axis in outside for swap in _swaps(study, fit, axis, tops, found)]
    settings = _settings(fit, inside, list(islice(_tried(tops, swaps), number)), number)
    runs = [_run(study, fit, at, inside, tops) for at in settings]
    gain = fit.law(tops)[0] - fit.law({axis.factor: found[axis.factor] for axis in fit.axes})[0]
    notes = tuple(note for axis in outside for note in _at_the_end(axis, tops[axis.factor]))
    if len(runs) < number:
        notes = (*notes, f"{len(runs)} of {number} runs: no other levels are as good, as far as the data say")
    return NextRuns(tuple(runs), gain, notes, study.unit)


def _swaps(
    study: "Observations", fit: SurfaceFit, axis: FactorAxis, tops: dict[str, Level], found: Best
) -> list[tuple[str, Level]]:
    """Levels of a factor that may be as good as its best, the highest on the surface first."""
    name = axis.factor
    ties = {found[name], *(tie.level for tie in found.ties if tie.factor == name)}
    levels = [at for at in study.levels(name) if at != tops[name] and (name in found.arbitrary or at in ties)]
    return [(name, at) for at in sorted(levels, key=lambda at: -fit.law({**tops, name: at})[0])]


def _tried(tops: dict[str, Level], swaps: list[tuple[str, Level]]) -> Iterator[dict[str, Level]]:
    """Best levels, then those with one swapped, with two, and so on."""
    for count in range(len(tops) + 1):
        for chosen in combinations(swaps, count):
            if len(dict(chosen)) == count:
                yield tops | dict(chosen)


def _settings(
    fit: SurfaceFit, inside: list[FactorAxis], tried: list[dict[str, Level]], number: int
) -> list[dict[str, Level]]:
    """Up to `number` different settings: each part of a peak once, then other pairs of levels and parts."""
    found: list[dict[str, Level]] = []
    for k, part in [(k % len(tried), k) for k in range(number)] + list(
        product(range(len(tried)), range(number))
    ):
        peaks: dict[str, Level] = {
            axis.factor: _placed(fit, axis, _part(part, j, number)) for j, axis in enumerate(inside)
        }
        if len(found) < number and tried[k] | peaks not in found:
            found.append(tried[k] | peaks)
    return found


def _peak(fit: SurfaceFit, axis: FactorAxis) -> float | None:
    """Coordinate of the highest point of a quadratic between the ends; None: there is none."""
    if axis.degree < 2:
        return None
    k = fit.position(axis)
    b, c = fit.estimate.value[k : k + 2]
    return None if c >= 0 or abs(b) >= -2 * c else float(-b / (2 * c))


def _top(fit: SurfaceFit, axis: FactorAxis, best_level: Level) -> Level:
    """Best level of a factor: for names as found, for numbers the peak or the better end."""
    if not axis.numeric:
        return best_level
    peak = _peak(fit, axis)
    if peak is not None:
        return axis.value(peak)
    k = fit.position(axis)
    slopes = fit.estimate.value[k : k + axis.degree]
    ends = [float(sum(s * x ** (n + 1) for n, s in enumerate(slopes))) for x in (-1.0, 1.0)]
    return axis.ends[int(np.argmax(ends))]


def _part(run: int, axis: int, number: int) -> float:
    """Middle of a run's part of an axis, 0 to 1; each part once, in another order on each axis."""
    # 0.381966 = (3 - sqrt 5)/2, the golden section: equidistributed orders
    order = np.argsort((0.381966 * axis * np.arange(number)) % 1.0, kind="stable")
    return (float(order[run]) + 0.5) / number


def _placed(fit: SurfaceFit, axis: FactorAxis, share: float) -> float:
    """Level below which the peak lies with probability `share`, within the range."""
    k = fit.position(axis)
    value, covariance = fit.estimate.value[k : k + 2], fit.estimate.covariance[k : k + 2, k : k + 2]
    reach = float(stdtrit(fit.estimate.freedom, share))

    def excess(x: float) -> float:
        row = np.array([1.0, 2 * x])
        return float(-row @ value - reach * np.sqrt(row @ covariance @ row))

    if excess(-1.0) >= 0:
        return axis.value(-1.0)
    return axis.value(1.0) if excess(1.0) <= 0 else axis.value(float(brentq(excess, -1.0, 1.0, xtol=1e-13)))


def _run(
    study: "Observations",
    fit: SurfaceFit,
    settings: dict[str, Level],
    inside: list[FactorAxis],
    tops: dict[str, Level],
) -> NextRun:
    mean, sd = fit.law(settings)
    return NextRun(settings, mean, sd, law_of_a_reading(study, mean, sd), _why(settings, inside, tops))


def _why(settings: dict[str, Level], inside: list[FactorAxis], tops: dict[str, Level]) -> str:
    parts, peaks = [], {axis.factor for axis in inside}
    for axis in inside:
        value, top = float(settings[axis.factor]), float(tops[axis.factor])
        if abs(value - top) <= 1e-9 * abs(top):
            parts.append(f"{axis.factor} at the top of the surface: confirms it")
        else:
            parts.append(
                f"{axis.factor} {'below' if value < top else 'above'} the top {top:.4g}:"
                " where else the best may lie"
            )
    swapped = [
        f"{name} {level(value)}: as good, as far as the data say"
        for name, value in settings.items()
        if name not in peaks and value != tops[name]
    ]
    return "; ".join([*parts, *swapped]) or "at the best levels: confirms them"


def _at_the_end(axis: FactorAxis, value: Level) -> list[str]:
    """Note on a number that is best at an end of its range."""
    if not axis.numeric:
        return []
    side = "greatest" if value == axis.ends[1] else "least"
    return [f"{axis.factor} is best at {level(value)}, the {side} level tried: beyond it nothing is known"]
