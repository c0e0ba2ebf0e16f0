"""Separation of the part's form from the roller's runout, by one least-squares fit with the centre.

Rows are 1, cosines and sines of the harmonics in the part angle, those of the runout, and its derivative by
the ratio. Part angles depend on the fitted centre and tip radius: each Gauss-Newton step updates them.
"""

import dataclasses
from math import copysign, inf, sqrt

import numpy as np
from scipy.special import fdtrc

from centering.roundness._roller import RollerError
from centering.roundness._roller_rows import Basis, condition
from centering.roundness._roller_start import REACH, SEEN, SeparationState, start
from centering.roundness._roller_task import SeparationTask, refuse_integer
from sdpgrind.base.checks import Floats

_STEPS = 50  # chosen: Gauss-Newton steps, at most; 250 random scans took 2 to 13
_STILL = 1e-9  # chosen: relative move of circle and ratio that ends them
_PIECES = 4  # chosen: pieces of a turn in which the roller's phase is compared
_KEPT = 0.01  # chosen: least share of a phase's variance left by the fit to show slip
_ROUNDING = 1e-12  # chosen: residual over the radius without any noise


@dataclasses.dataclass(frozen=True)
class RollerFit:
    """Circle (radius, x, y; mm) with covariance, tip radius, runout, residual of each reading."""

    circle: Floats
    covariance: Floats
    tip_radius: float
    runout: RollerError
    residual: Floats


@dataclasses.dataclass(frozen=True)
class _Fit:
    """Linear fit: solution by rows, normal matrix, residual."""

    solution: Floats
    gram: Floats
    residual: Floats

    @property
    def noise_sd(self) -> float:
        """Standard deviation of one value; infinite without degrees of freedom."""
        freedom = self.residual.size - self.solution.size
        return float(np.linalg.norm(self.residual)) / sqrt(freedom) if freedom > 0 else inf

    def covariance(self, *values: slice) -> list[Floats]:
        """Covariances of some values; infinite without degrees of freedom."""
        spread = np.linalg.inv(self.gram)
        parts = [np.asarray(spread[some, some], dtype=float) for some in values]
        return [
            self.noise_sd**2 * part if self.noise_sd < inf else np.full(part.shape, inf) for part in parts
        ]


def separate(task: SeparationTask) -> RollerFit:
    """Separate form and runout."""
    samples = task.samples
    nominal = task.ratio or float(samples.circle[0]) / abs(samples.tip_radius)
    state, refine = start(task, nominal)
    for _ in range(_STEPS):
        part_angle, deviation = samples.about(state.circle, state.tip_radius)
        basis, further = Basis.of(part_angle, task.upr_max), state.runout_rows(part_angle, refine)
        fit = _fitted(basis, further, deviation)
        before, state = state, _moved(task, state, fit, nominal, refine)
        if _still(before, state):
            break
    else:
        raise ValueError(
            f"angle must tell circle and ratio; after {_STEPS} steps the ratio still goes from"
            f" {before.ratio:.9g} to {state.ratio:.9g}: read more turns"
        )
    _refuse_edge(state.ratio, nominal, task.origin)
    refuse_integer(state.ratio, f", found near {nominal:.6g}{task.origin}", task.near_integer)
    return _separation(task, state, fit, part_angle, basis, further)


def _fitted(basis: Basis, further: Floats, target: Floats) -> _Fit:
    """Least squares by the normal equations; accepted conditions leave ten digits."""
    gram, first = basis.bordered(further), len(basis.rows)
    solution = np.asarray(
        np.linalg.solve(gram, np.concatenate([basis.rows @ target, further @ target])), dtype=float
    )
    return _Fit(solution, gram, target - solution[:first] @ basis.rows - solution[first:] @ further)


def _moved(
    task: SeparationTask, state: SeparationState, fit: _Fit, nominal: float, refine: bool
) -> SeparationState:
    """State after a step; the tip's radius follows the ratio unless that is given."""
    first = 2 * task.upr_max + 1
    circle, ratio, rho = state.circle + fit.solution[:3], state.ratio, state.tip_radius
    if refine:
        ratio = float(np.clip(ratio + fit.solution[-1], nominal * (1 - REACH), nominal * (1 + REACH)))
        rho = rho if task.ratio else copysign(float(circle[0]) / ratio, rho)
    return SeparationState(circle, rho, ratio, fit.solution[first : first + 2])


def _still(before: SeparationState, after: SeparationState) -> bool:
    """Whether a step has moved nothing."""
    moved = np.abs(after.circle - before.circle).max() / after.circle[0]
    return bool(max(moved, abs(after.ratio / before.ratio - 1)) < _STILL)


def _separation(
    task: SeparationTask, state: SeparationState, fit: _Fit, part_angle: Floats, basis: Basis, further: Floats
) -> RollerFit:
    """Circle, runout and slip of a settled fit."""
    first, size = len(basis.rows), len(further)
    of_circle, of_runout = fit.covariance(slice(0, 3), slice(first, first + size))
    covariance = np.zeros((3, 3))
    covariance[:size, :size] = of_runout
    runout = RollerError(
        np.array([*state.tone, state.ratio]),
        covariance,
        tip_radius=float(state.circle[0]) / state.ratio,
        condition=condition(fit.gram[: first + 2, : first + 2]),
        turns=task.samples.turns,
        upr_max=task.upr_max,
        noise_sd=fit.noise_sd,
    )
    if runout.amplitude > SEEN * runout.amplitude_sd:
        slip, probability = _slip(state, part_angle, np.vstack([basis.rows, further]), fit)
        runout = runout.replace(slip=slip, slip_probability=probability)
    return RollerFit(state.circle, of_circle, state.tip_radius, runout, fit.residual)


def _slip(state: SeparationState, part_angle: Floats, rows: Floats, fit: _Fit) -> tuple[float, float]:
    """Spread of the roller's phase over pieces of a turn, as length along the part, mm, and its probability.

    The covariance of the phases excludes the part absorbed by the fit, nearly all for pieces that were read
    once.
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
    chance = (
        float(fdtrc(count, freedom, _ratio(squares, noise**2, count, fit))) if count and freedom > 0 else 1.0
    )
    return float(np.ptp(phase)) * float(state.circle[0]) / state.ratio, chance


def _ratio(squares: float, variance: float, count: int, fit: _Fit) -> float:
    """Fisher's ratio: mean square of the phases over that of the residual without them."""
    whole = variance * (fit.residual.size - fit.solution.size)
    others = max(whole - squares, 1e-12 * whole) / (fit.residual.size - fit.solution.size - count)
    return squares / count / others


def _refuse_edge(ratio: float, nominal: float, origin: str) -> None:
    if abs(ratio / nominal - 1) > REACH * (1 - 1e-6):
        raise ValueError(
            f"ratio must be within {100 * REACH:g} % of that of the roller; got {nominal:.6g}{origin},"
            f" and the runout is strongest at the edge, {ratio:.6g}: another tip_radius, or give the ratio"
        )
