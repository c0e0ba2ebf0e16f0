"""Form of the part and runout of the roller told apart by one least-squares fit, about a centre that comes out of it.

Rows are 1, cosines and sines of the harmonics in the part's angle, the runout's cosine and sine, and its derivative by the
ratio. Part angles depend on the centre and on the tip's radius, which depend on the fit: each Gauss-Newton step moves them all.
"""

import dataclasses
from math import ceil, copysign, inf, sqrt
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import fdtrc

from centering._roundness.harmonics import powers
from centering._roundness.part_frame import into_part
from centering._roundness.runout import Runout
from centering._roundness.sampling import widest_gap
from centering._roundness.scan import TOO_BAD
from centering._roundness.separation_task import Task, refuse_integer
from sdpgrind.base.checks import Floats

REACH = 5e-3
"""Share of the ratio within which it is refined."""

_STEPS = 20
_STILL = 1e-9  # of the radius, and of the ratio: then one more step changes nothing
_SEEN = 5.0  # sd of the amplitude: a smaller runout has no frequency of its own
_TELLING = 0.3  # of the reach: a ratio is refined if its sd is less
_UNSURE, _INFLATED = 0.1, 4.0  # of the amplitude, and times its sd at the ratio as it is: then the ratio is kept
_APART = 0.25  # of the ratio times the turns: tried ratios; a peak is 2 wide
_PIECES = 4  # of a turn, in which the roller's phase is looked at
_KEPT = 0.01  # of the variance of a phase: where the fit leaves less, the readings tell no slip
_ROUNDING = 1e-12  # of the radius: what is left without any noise
_LATER = (0, 0.5, 1, 1.5, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48)


@dataclasses.dataclass(frozen=True)
class Separation:
    """Circle (radius, x, y; mm) with its covariance, tip radius, runout, and what is left of each reading."""

    circle: Floats
    covariance: Floats
    tip_radius: float
    runout: Runout
    residual: Floats


@dataclasses.dataclass(frozen=True)
class _State:
    """What a step moves: circle, tip radius, ratio, runout's cosine and sine."""

    circle: Floats
    tip_radius: float
    ratio: float
    tone: Floats


@dataclasses.dataclass(frozen=True)
class _Fit:
    """A linear fit: solution by rows, normal matrix, residual."""

    solution: Floats
    gram: Floats
    residual: Floats

    @property
    def noise_sd(self) -> float:
        freedom = self.residual.size - self.solution.size
        return float(np.linalg.norm(self.residual)) / sqrt(freedom) if freedom > 0 else inf

    def covariance(self, *values: slice) -> list[Floats]:
        """Of some values; infinite where no reading is left to tell the noise by."""
        spread = np.linalg.inv(self.gram)
        parts = [np.asarray(spread[some, some], dtype=float) for some in values]
        return [self.noise_sd**2 * part if self.noise_sd < inf else np.full(part.shape, inf) for part in parts]


def separate(task: Task, circle: Floats) -> Separation:
    """Tell form and runout apart, from a circle (radius, x, y) to begin with."""
    nominal = task.ratio or float(circle[0]) / abs(task.tip_radius)
    state, refine = _start(task, circle, nominal)
    for _ in range(_STEPS):
        part_angle, deviation = _seen(task, state)
        fit = _fitted(_rows(part_angle, task.upr_max, state, refine), deviation)
        before, state = state, _moved(task, state, fit, nominal, refine)
        if _still(before, state):
            break
    _refuse_edge(state.ratio, nominal, task.origin)
    refuse_integer(state.ratio, f", found near {nominal:.6g}{task.origin}", task.near_integer)
    return _separation(task, state, fit, part_angle, refine)


def _start(task: Task, circle: Floats, nominal: float) -> tuple[_State, bool]:
    """What the steps begin with, and whether there is a runout whose ratio can be refined."""
    state = _State(circle, task.tip_radius, nominal, np.zeros(2))
    part_angle, deviation = _seen(task, state)
    _refuse_ill(task, _rows(part_angle, task.upr_max, state, False), nominal)
    found = _first_runout(task, part_angle, deviation, nominal) if task.refine else None
    if found is None:
        return state, False
    better = dataclasses.replace(state, ratio=found[0], tone=found[1])
    return (better, True) if _told(task, better, part_angle, deviation, nominal) else (state, False)


def _told(task: Task, state: _State, part_angle: Floats, deviation: Floats, nominal: float) -> bool:
    """Whether the samples tell the ratio better than its reach does: hardly so over one turn, where harmonics make up for it.

    Nor is it looked for where that would make the amplitude unsure which is known at the ratio as it is: near a whole number
    the two grow together.
    """
    rows = _rows(part_angle, task.upr_max, state, True)
    gram = rows @ rows.T
    if condition(gram / np.sqrt(np.outer(gram.diagonal(), gram.diagonal()))) == inf:
        return False
    fit = _fitted(rows, deviation)
    (variance,) = fit.covariance(slice(-1, None))
    if sqrt(variance[0, 0]) >= _TELLING * REACH * state.ratio:
        return False
    at_nominal = _rows(part_angle, task.upr_max, dataclasses.replace(state, ratio=nominal), True)
    return not any(_unsettled(each, state.tone, fit.noise_sd) for each in (gram, at_nominal @ at_nominal.T))


def _unsettled(gram: Floats, tone: Floats, noise_sd: float) -> bool:
    """Whether an amplitude becomes unsure, and much less sure, where the ratio is looked for, whose row is the last."""
    amplitude, own = float(np.hypot(*tone)), slice(-3, -1)
    refined = noise_sd**2 * np.linalg.inv(gram)[own, own]
    kept = noise_sd**2 * np.linalg.inv(gram[:-1, :-1])[-2:, -2:]
    sure, unsure = (sqrt(max(float(tone @ spread @ tone), 0.0)) / amplitude for spread in (kept, refined))
    return unsure > max(_UNSURE * amplitude, _INFLATED * sure)


def _seen(task: Task, state: _State) -> tuple[Floats, Floats]:
    """Part angle and deviation of each sample."""
    part_angle, distance = into_part(task.angle, task.reading, state.tip_radius, state.circle[1:])
    return part_angle, distance - state.tip_radius - state.circle[0]


def harmonic_rows(part_angle: Floats, upr_max: int) -> Floats:
    """Rows 1, cos, sin, cos 2, sin 2, ... of the part's angle, (2 upr_max + 1, n)."""
    waves = powers(np.exp(1j * part_angle), upr_max + 1)
    rows = np.empty((2 * upr_max + 1, part_angle.size))
    rows[0] = 1.0
    rows[2::2], rows[1::2] = waves.imag[1:], waves.real[1:]
    return rows


def _rows(part_angle: Floats, upr_max: int, state: _State, refine: bool) -> Floats:
    """Harmonics, the runout's two rows and, where the ratio is refined, the derivative by it."""
    runout = Runout(np.array([*state.tone, state.ratio]), np.zeros((3, 3))).derivatives(part_angle).T
    return np.vstack([harmonic_rows(part_angle, upr_max), runout if refine else runout[:2]])


def _fitted(rows: Floats, target: Floats) -> _Fit:
    """Least squares by the normal equations: conditions that are accepted leave them ten digits."""
    gram = rows @ rows.T
    solution = np.asarray(np.linalg.solve(gram, rows @ target), dtype=float)
    return _Fit(solution, gram, target - solution @ rows)


def condition(gram: Floats) -> float:
    """Condition of the basis of a normal matrix; infinite beyond 1e7, where the matrix has no digits left."""
    values = np.linalg.eigvalsh(gram)
    return sqrt(values[-1] / values[0]) if values[0] > 1e-14 * values[-1] else inf


def _first_runout(task: Task, part_angle: Floats, deviation: Floats, nominal: float) -> tuple[float, Floats] | None:
    """Of ratios within reach that whose runout explains most of what harmonics leave; None where that is no more than noise."""
    rows = harmonic_rows(part_angle, task.upr_max)
    factor = cho_factor(rows @ rows.T)
    left = deviation - cho_solve(factor, rows @ deviation) @ rows
    count = 2 * ceil(REACH * nominal * task.turns / _APART) + 3
    ratios = nominal * (1 + np.linspace(-REACH, REACH, count))
    gains, tones = zip(*(_explained(rows, factor, left, part_angle, ratio) for ratio in ratios), strict=True)
    best = int(np.argmax(gains))
    freedom = left.size - len(rows) - 3
    seen = freedom > 0 and gains[best] * freedom > _SEEN**2 * (left @ left - gains[best])
    return (float(ratios[best]), tones[best]) if seen else None


def _explained(rows: Floats, factor: Any, left: Floats, part_angle: Floats, ratio: float) -> tuple[float, Floats]:
    """Sum of squares that a runout of that ratio explains beyond the harmonics, and the runout."""
    tone = np.stack([np.cos(ratio * part_angle), np.sin(ratio * part_angle)])
    shared = rows @ tone.T
    gram = tone @ tone.T - shared.T @ cho_solve(factor, shared)
    found = np.linalg.solve(gram, tone @ left)
    return float(left @ tone.T @ found), found


def _moved(task: Task, state: _State, fit: _Fit, nominal: float, refine: bool) -> _State:
    """The state after a step; the tip's radius goes with the ratio unless that was given."""
    first = 2 * task.upr_max + 1
    circle, ratio, rho = state.circle + fit.solution[:3], state.ratio, state.tip_radius
    if refine:
        ratio = float(np.clip(ratio + fit.solution[-1], nominal * (1 - REACH), nominal * (1 + REACH)))
        rho = rho if task.ratio else copysign(float(circle[0]) / ratio, rho)
    return _State(circle, rho, ratio, fit.solution[first : first + 2])


def _still(before: _State, after: _State) -> bool:
    moved = np.abs(after.circle - before.circle).max() / after.circle[0]
    return bool(max(moved, abs(after.ratio / before.ratio - 1)) < _STILL)


def _separation(task: Task, state: _State, fit: _Fit, part_angle: Floats, refine: bool) -> Separation:
    first, size = 2 * task.upr_max + 1, 3 if refine else 2
    of_circle, of_runout = fit.covariance(slice(0, 3), slice(first, first + size))
    covariance = np.zeros((3, 3))
    covariance[:size, :size] = of_runout
    runout = Runout(
        np.array([*state.tone, state.ratio]),
        covariance,
        tip_radius=float(state.circle[0]) / state.ratio,
        condition=condition(fit.gram[: first + 2, : first + 2]),
        turns=task.turns,
        upr_max=task.upr_max,
        noise_sd=fit.noise_sd,
    )
    if runout.amplitude > _SEEN * runout.amplitude_sd:
        slip, probability = _slip(state, part_angle, _rows(part_angle, task.upr_max, state, refine), fit)
        runout = runout.replace(slip=slip, slip_probability=probability)
    return Separation(state.circle, of_circle, state.tip_radius, runout, fit.residual)


def _slip(state: _State, part_angle: Floats, rows: Floats, fit: _Fit) -> tuple[float, float]:
    """Spread of the roller's phase over pieces of a turn as a way along the part, mm; probability of as much by noise.

    What the fit has taken off the residual is taken off the covariance of the phases, too: of the pieces that were read once it
    leaves next to nothing.
    """
    waves = np.exp(-1j * state.ratio * part_angle) / complex(state.tone[0], -state.tone[1])
    piece = ((part_angle - part_angle.min()) * (_PIECES / (2 * np.pi))).astype(int)
    size = np.bincount(piece)
    whole = np.flatnonzero(size >= size.max() / 2)
    mean = 2 * waves.imag * (piece == whole[:, np.newaxis]) / size[whole, np.newaxis]
    phase, taken = mean @ fit.residual, mean @ rows.T
    own = np.sum(mean**2, axis=1)
    left = (np.diag(own) - taken @ np.linalg.solve(fit.gram, taken.T)) / np.sqrt(np.outer(own, own))
    share, directions = np.linalg.eigh(left)
    kept = share > _KEPT
    squares = float(np.sum((directions.T @ (phase / np.sqrt(own)))[kept] ** 2 / share[kept]))
    noise, count = max(fit.noise_sd, _ROUNDING * float(state.circle[0])), int(np.sum(kept))
    freedom = fit.residual.size - fit.solution.size - count
    chance = float(fdtrc(count, freedom, _ratio(squares, noise**2, count, fit))) if count and freedom > 0 else 1.0
    return float(np.ptp(phase)) * float(state.circle[0]) / state.ratio, chance


def _ratio(squares: float, variance: float, count: int, fit: _Fit) -> float:
    """Mean square of the phases over that of the residual without them: Fisher's ratio."""
    whole = variance * (fit.residual.size - fit.solution.size)
    others = max(whole - squares, 1e-12 * whole) / (fit.residual.size - fit.solution.size - count)
    return squares / count / others


def _refuse_edge(ratio: float, nominal: float, origin: str) -> None:
    if abs(ratio / nominal - 1) > REACH * (1 - 1e-6):
        raise ValueError(
            f"ratio must be within {100 * REACH:g} % of that of the roller; got {nominal:.6g}{origin}, and the runout is"
            f" strongest at the edge, {ratio:.6g}: another tip_radius, or give the ratio"
        )


def _refuse_ill(task: Task, rows: Floats, ratio: float) -> None:
    found = condition(rows @ rows.T)
    if found <= TOO_BAD:
        return
    raise ValueError(
        f"angle must cover enough turns to tell runout at {ratio:.6g} upr from {task.upr_max} harmonics: the condition must be"
        f" <= {TOO_BAD:g}; got {found:.3g} with {task.turns:.3g} turns; {_advice(task, ratio)}"
    )


def _advice(task: Task, ratio: float) -> str:
    """What would make the condition good: turns, on an even grid, or samples where there are none."""
    more = _more_turns(ratio, task.upr_max, task.turns)
    if more == 0:
        gap = widest_gap(task.angle)
        return f"a gap of {np.degrees(gap):.3g} degrees or the offset leaves part of the turn bare: upr_max must be lower"
    return "no number of turns will do" if more is None else f"about {more:g} turns more are needed"


def _more_turns(ratio: float, upr_max: int, turns: float) -> float | None:
    """Turns to be added until the two can be told apart, on an even grid."""
    for more in _LATER:
        part_angle = 2 * np.pi * (turns + more) * np.linspace(0, 1, ceil((turns + more) * (2 * upr_max + 6)), endpoint=False)
        rows = np.vstack([harmonic_rows(part_angle, upr_max), np.cos(ratio * part_angle), np.sin(ratio * part_angle)])
        if condition(rows @ rows.T) <= TOO_BAD:
            return more
    return None
