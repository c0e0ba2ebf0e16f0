"""Lack of fit: the rest of a model against the noise that readings at like conditions show."""

from typing import NamedTuple

import numpy as np
from scipy.special import fdtrc

from sdpgrind.base import serial
from sdpgrind.base.checks import Floats

_RARELY = 1e-3  # chosen: probability by which noise alone is a lack of fit
_WORSE = (
    1.25  # chosen, as for a machine: variance about the model over that of the noise; less does not matter
)
_ALIKE = 1e-6  # chosen: singular value of unit columns, over the greatest; less is rounding
_WIDER = 2.0  # derived: standard errors of the correlation at the ends of its 95 % interval
_EACH = 3  # chosen: readings for each term; of fewer a surface of first order, and fewer changes
_SCALES = (1, 2, 4, 8)  # chosen: readings over which the response changes; lags of 0.3 to 10 of them show
_SPARE = 3  # derived: readings beyond all terms, for the variance and the correlation of the noise
_ROUNDS = 2  # chosen: fits with a new correlation, as of every fit with noise of first order


class Rest(NamedTuple):
    """Standard deviations about the model and of the noise; probability of such a rest by noise alone.

    `of_changes`: probability of what follows changes of the response, by noise alone.
    """

    sd: float
    noise_sd: float
    chance: float
    of_changes: float = 1.0

    @property
    def fits(self) -> bool:
        """Whether noise explains the rest, or all of it but a small part."""
        return self.chance >= _RARELY or self.sd**2 <= _WORSE * self.noise_sd**2

    @property
    def late(self) -> bool:
        """Whether the readings follow changes of the response late, or early."""
        return self.of_changes < _RARELY


def rest(
    residual: Floats,
    slopes: Floats,
    inputs: Floats,
    apart: Floats,
    least: float,
    response: Floats | None = None,
) -> Rest | None:
    """Return the rest of a fit against a smooth surface over the inputs; None: too few readings.

    What such a surface takes from the residuals depends on the inputs and is no noise (F test). The noise is
    of first order, with the correlation that it has about the surface, at both ends of its 95 % interval: too
    small a correlation makes the noise a slow change of the inputs, too great a one a fast change.

    A gauge that lags leaves what the response f was some readings ago: sum_j w_j (f_k - f_k-j). Changes of f
    over 1, 2, 4 and 8 readings are terms of their own therefore, whatever the noise is.

    Parameters
    ----------
    residual : array, shape (n,)
        Readings minus responses, in their order of time.
    slopes : array, shape (n, p)
        Slopes of the residuals by the fitted values.
    inputs : array, shape (m, n)
        Quantities on which the response depends.
    apart : array, shape (n,)
        Steps before each reading, as `serial.gaps` gives them.
    least : float
        Least standard deviation of the noise: what a gauge rounds.
    response : array, shape (n,), optional
        Response of the model in the order of time. Default: no order.
    """
    own, both = _unit(slopes), np.hstack([_unit(slopes), _surface(inputs)])
    changes = np.zeros((residual.size, 0)) if response is None else _changes(response, apart)
    every = np.hstack([both, changes[:, : max(residual.size // _EACH - both.shape[1], 1)]])
    terms = _rank(every)
    if residual.size < terms + _SPARE:
        return None
    left, rho = residual, 0.0
    for _ in range(_ROUNDS):
        left = residual - every @ _solved(serial.filtered(every.T, rho, apart).T, residual, rho, apart)
        rho = serial.correlation(left, terms, apart)
    noise = max(float(left @ left) / (residual.size - terms), least**2)
    about = float(residual @ residual) / max(residual.size - _rank(own), 1)
    off = _WIDER * float(np.sqrt((1 - rho**2) / residual.size))
    ends = max(rho - off, 0.0), min(rho + off, serial.MOST)
    chance, of_changes = (
        max(_chance(residual, rows, every, (end, apart, least)) for end in ends) for rows in (own, both)
    )
    return Rest(about**0.5, noise**0.5, chance, of_changes)


def _changes(response: Floats, apart: Floats) -> Floats:
    """Change of the response over the last readings of each series, (n, scales)."""
    index = np.arange(response.size)
    first = np.maximum.accumulate(np.where(np.isfinite(apart), 0, index))
    before = [response[np.maximum(index - scale, first)] for scale in _SCALES]
    return _unit(response[:, None] - np.array(before).T)


def _chance(residual: Floats, rows: Floats, every: Floats, noise: tuple[float, Floats, float]) -> float:
    """Probability that noise alone gives all terms as much of the squares that `rows` leave."""
    rho, apart, least = noise
    white = serial.filtered(residual, rho, apart)
    (without, few), (with_it, many) = (
        _square(white, serial.filtered(terms.T, rho, apart).T) for terms in (rows, every)
    )
    if many == few:
        return 1.0
    free = white.size - many
    variance = max(with_it / free, (1 - rho**2) * least**2)
    if variance == 0.0:
        return 1.0 if without == 0.0 else 0.0
    return float(fdtrc(many - few, free, (without - with_it) / (many - few) / variance))


def _surface(inputs: Floats) -> Floats:
    """Terms up to the second order of what changes, shape (n, terms); up to the first for few readings."""
    off = inputs - inputs.mean(axis=1, keepdims=True)
    moved = off[np.ptp(inputs, axis=1) > _ALIKE * np.abs(inputs).max(axis=1)]
    first = [np.ones(inputs.shape[1]), *_unit(moved.T).T]
    second = [one * other for k, one in enumerate(first[1:], 1) for other in first[k:]]
    enough = inputs.shape[1] >= _EACH * (len(first) + len(second))
    return _unit(np.array(first + second * enough).T)


def _unit(columns: Floats) -> Floats:
    length = np.sqrt(np.sum(columns**2, axis=0))
    return np.asarray(columns / np.where(length > 0, length, 1.0))


def _rank(columns: Floats) -> int:
    return int(np.linalg.matrix_rank(columns, rtol=_ALIKE)) if columns.any() else 0


def _solved(white: Floats, residual: Floats, rho: float, apart: Floats) -> Floats:
    return np.asarray(np.linalg.lstsq(white, serial.filtered(residual, rho, apart), rcond=_ALIKE)[0])


def _square(white: Floats, columns: Floats) -> tuple[float, int]:
    """Sum of squares that the columns leave, and their rank."""
    u, s, _ = np.linalg.svd(_unit(columns), full_matrices=False)
    basis = u[:, s > _ALIKE * s[0]]
    return float(np.sum((white - basis @ (basis.T @ white)) ** 2)), basis.shape[1]
