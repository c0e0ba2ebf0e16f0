"""The robust locus: least loss under feedback over several models.

Feedback stops a process where its own constraint crosses the locus of the controller. At a point z the hidden
state of sample j is X_j(z), P_j(z, X_j) = 0, and its loss l_j(z) = phi_j(z, X_j) - phi_j*(X_j). With equally
likely hidden states the loss of a locus z(s) is the sum over j of w_j times the integral of l_j dX_j. It is
linear in dz/ds; its variation is therefore free of derivatives of the locus. With two controls (u, v) it is

    sum over j of w_j Q_j(z, X_j) / |dP_j/dx| = 0,    Q = phi_u P_v - phi_v P_u of Koren (12).

The locus of least mean loss solves this weighted mean of the conditions of all samples, point by point, for
any coordinate and without knowing the optima. Other distributions weight each term by the density at X_j. The
worst loss is minimised point by point too: at each v, over u, the largest l_j.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus._curve.locus import Locus
from sdpgrind.locus._path.inverse import root
from sdpgrind.locus._path.stretch import Stretch
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.tape_kernels import run_many
from sdpgrind.locus._robust.samples import Sample, checked, declared_range, shares, traced

OBJECTIVES = ("mean", "worst")
WAYS = ("nominal", "robust", "open loop")
GOLDEN = 0.5 * (5**0.5 - 1)  # derived: golden section
ROUNDS = 64  # derived: steps of the golden section that shrink a bracket to rounding


@dataclass(frozen=True, eq=False, repr=False)
class RobustLocus:
    """A locus for several models under feedback, from `robust_locus`. Units are those of the problems.

    Attributes
    ----------
    samples : tuple of Problem
        The models; the first is nominal and gives limit and calibration.
    weights : array, (samples,)
        Weights of the samples; their sum is 1.
    objective : {"mean", "worst"}
        Minimised loss.
    x : (float, float)
        Range of the hidden state.
    path, nominal : Stretch
        The robust locus, and the locus of the nominal model.
    curves : tuple of Locus
        The locus of each sample.
    """

    samples: tuple[Problem, ...]
    weights: Floats
    objective: str
    x: tuple[float, float]
    path: Stretch
    nominal: Stretch
    curves: tuple[Locus, ...]

    def stretch(self, along: str | None = None, x: tuple[float, float] | None = None) -> Stretch:
        """Return the robust locus for a controller.

        Parameters
        ----------
        along : str, optional
            Its coordinate; checked only.
        x : (float, float), optional
            Not used (hidden state, in its unit).

        Raises
        ------
        ValueError
            When another coordinate is given.
        """
        if along not in (None, self.path.along):
            raise checks.refuse("along", f"{self.path.along!r}, the coordinate of the robust locus", along)
        return self.path

    @cached_property
    def losses(self) -> xr.Dataset:
        """Losses without sensor bias, see `losses_with` (units of cost and response)."""
        return self.losses_with()

    def losses_with(self, *, points: int = 33, bias: float = 0.0) -> xr.Dataset:
        """Return the losses of every sample over the hidden state: nominal locus, robust locus, open loop.

        ``loss`` is the cost above the sample's optimum, negative with a violated limit. ``violation`` is
        response - limit of the sample. Open loop: the nominal model's controls for the true hidden state.

        Parameters
        ----------
        points : int
            Number of hidden states.
        bias : float
            Sensor bias (reading minus response), in the unit of the response.
        """
        return loss_table(
            self,
            checks.count("points", points, 2),
            checks.number("bias", bias, self.path.units[self.path.response]),
        )

    def __repr__(self) -> str:
        worst = float(self.losses.loss.sel(way="robust").max())
        told = f"{len(self.samples)} samples, {self.objective}; {self.path!r}"
        return f"RobustLocus({told}; loses at most {worst:.3g})"


def robust_locus(
    samples: Sequence[Problem],
    *,
    along: str,
    objective: str = "mean",
    weights: Any = None,
    x: tuple[float, float] | None = None,
    points: int = 200,
) -> RobustLocus:
    """Find the locus of least loss under feedback for models that disagree.

    Feedback keeps the true response at its limit, so a small error of the locus costs to second order only.
    For models with larger differences this locus has the least mean or worst loss.

    Parameters
    ----------
    samples : sequence of Problem
        Two or more, with the same two controls, hidden state and limit; the first is nominal.
    along : str
        Coordinate: a control, single-valued on the locus of every sample.
    objective : {"mean", "worst"}
        Mean loss over samples and hidden states, or the worst of all samples, point by point.
    weights : array, (samples,), optional
        Weights of the mean. Default: equal.
    x : (float, float), optional
        Range of the hidden state, in its unit. Default: that of the nominal problem.
    points : int
        Approximate number of points of the table.

    Raises
    ------
    ValueError
        When samples do not fit each other or have no common coordinate.
    TypeError
        When a sample is not a problem.

    Examples
    --------
    Two models with different powers of v:

    >>> from sdpgrind import locus
    >>> def model(power):
    ...     response = lambda s, c: s.x * c.v**power + 16 - 4 * c.v
    ...     return locus.Problem(
    ...         controls={"u": (0.0, 5.0), "v": (0.01, 10.0)},
    ...         hidden={"x": (0.6, 5.0)},
    ...         cost=lambda s, c: (c.u - 1) ** 2 + (c.v - 4) ** 2,
    ...         constraints=[locus.Varying(response=response, limit=lambda s, c: 17 + c.u - 4 * c.v)],
    ...     )
    >>> robust = robust_locus([model(1.0), model(1.6)], along="v")
    >>> mean = robust.losses.loss.mean(["sample", "x"])
    >>> {str(way): round(float(mean.sel(way=way)), 4) for way in mean.way.values}
    {'nominal': 0.0647, 'robust': 0.0285, 'open loop': -0.2705}
    >>> controller = locus.LocusController(robust, along="v", x=(0.7, 4.0))
    """
    given = checked(samples, along)
    checks.one_of("objective", objective, OBJECTIVES)
    parts = shares(weights, len(given))
    declared = given[0].hidden[given[0].hidden_names[0]] if x is None else declared_range(given[0], x)
    loci = [traced(one, along, checks.count("points", points, 10)) for one in given]
    models = [
        Sample(one, curve, stretch, declared) for one, (curve, stretch) in zip(given, loci, strict=True)
    ]
    places, ends = _places(models)
    free = 1 - given[0].names.index(along)
    find = _mean if objective == "mean" else _worst
    others, slopes = find(models, parts, places, free)
    path = _path(models[0], along, places, others, slopes, ends)
    return RobustLocus(
        given, parts, objective, declared, path, models[0].stretch, tuple(one.curve for one in models)
    )


def _mean(models: list[Sample], weights: Floats, places: Floats, free: int) -> tuple[Floats, Floats]:
    """Return the other control (K,) at which the weighted mean condition is 0, and its slope."""

    def total(others: Floats) -> Floats:
        controls = _controls(places, others, free)
        return np.asarray(sum(w * one.condition(controls) for w, one in zip(weights, models, strict=True)))

    found = root(lambda others: total(others)[:, 0], *_between(models, places, free))
    slopes = total(found)
    return found, np.asarray(-slopes[:, 2 - free] / slopes[:, 1 + free])


def _worst(models: list[Sample], weights: Floats, places: Floats, free: int) -> tuple[Floats, Floats]:
    """Return the other control (K,) of the least worst loss and its slope, by golden section."""

    def worst(others: Floats) -> Floats:
        controls = _controls(places, others, free)
        return np.asarray(np.max([one.loss(controls) for one in models], axis=0))

    a, b = _between(models, places, free)
    c, d = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
    fc, fd = worst(c), worst(d)
    for _ in range(ROUNDS):
        left = fc < fd
        a, b = np.where(left, a, c), np.where(left, d, b)
        c, d, kept = b - GOLDEN * (b - a), a + GOLDEN * (b - a), np.where(left, fc, fd)
        tried = worst(np.where(left, c, d))
        fc, fd = np.where(left, tried, kept), np.where(left, kept, tried)
    found = 0.5 * (a + b)
    # kinks: the worst two change
    return found, np.asarray(PchipInterpolator(places, found).derivative()(places))


def _between(models: list[Sample], places: Floats, free: int) -> tuple[Floats, Floats]:
    """Return the least and greatest other control of all samples at the coordinates."""
    own = np.array([one.stretch.rows(places)[:, free] for one in models])
    return own.min(axis=0), own.max(axis=0)


def _controls(places: Floats, others: Floats, free: int) -> Floats:
    return np.column_stack([others, places] if free == 0 else [places, others])


def _places(models: list[Sample]) -> tuple[Floats, tuple[str, str]]:
    """Return the coordinates common to the loci of all samples, and the causes of their ends."""
    lows, highs = [one.stretch.low for one in models], [one.stretch.high for one in models]
    first, last = int(np.argmax(lows)), int(np.argmin(highs))
    low, high = lows[first], highs[last]
    if not low < high:
        raise ValueError(
            f"samples must have coordinates in common; along {models[0].stretch.along!r} they have none"
        )
    nodes = np.unique(np.concatenate([[low, high], *(one.stretch.coordinate for one in models)]))
    inside = nodes[(nodes >= low) & (nodes <= high)]
    apart = np.append(np.diff(inside) > 1e-4 * (high - low), True)
    return inside[apart], (models[first].stretch.ends[0], models[last].stretch.ends[1])


def _path(
    nominal: Sample, along: str, places: Floats, others: Floats, slopes: Floats, ends: tuple[str, str]
) -> Stretch:
    """Return the robust locus with limit and hidden states of the nominal model."""
    problem, free = nominal.problem, 1 - nominal.problem.names.index(along)
    controls, direction = _controls(places, others, free), _controls(np.ones_like(places), slopes, free)
    hidden = nominal.hidden(controls)
    response, limit = (slope[:, 0] for slope in problem.system.slopes(controls, hidden[:, None], direction))
    by_hidden = np.empty((len(places), 2))
    run_many(problem.system.response_tape, np.column_stack([controls, hidden]), by_hidden)
    return Stretch.of_curve(
        along,
        names=problem.names,
        hidden_name=problem.hidden_names[0],
        controls=controls,
        hidden=hidden,
        limit=nominal.stretch.values(controls, hidden)[1],
        tangents=(direction, (limit - response) / by_hidden[:, 1], limit, response),
        ends=ends,
        values=nominal.stretch.values,
        response=nominal.stretch.response,
        units=nominal.stretch.units,
    )


def loss_table(robust: RobustLocus, points: int, bias: float) -> xr.Dataset:
    """Return loss and violation by sample, way and hidden state; NaN where a sample has no optimum."""
    path = robust.path
    x = np.linspace(*robust.x, points)
    nominal = _optima(robust.curves[0], x)[0]
    loss, violation = np.empty((2, len(robust.samples), len(WAYS), points))
    for j, curve in enumerate(robust.curves):
        least = _optima(curve, x)[1]
        ways = (
            feedback_points(robust.nominal, curve, x, bias),
            feedback_points(path, curve, x, bias),
            nominal,
        )
        for k, controls in enumerate(ways):
            cost, response, limit = curve.system.values(controls, x[:, None])
            loss[j, k], violation[j, k] = cost - least, response[:, 0] - limit[:, 0]
    dims, unit = ("sample", "way", path.hidden_name), path.units[path.response]
    return xr.Dataset(
        {
            "loss": (
                dims,
                loss,
                {
                    "long_name": "cost beyond the optimum of the sample",
                    "units": robust.samples[0].unit("cost"),
                },
            ),
            "violation": (dims, violation, {"long_name": f"{path.response} beyond its limit", "units": unit}),
        },
        {
            "sample": np.arange(len(robust.samples)),
            "way": list(WAYS),
            path.hidden_name: (
                path.hidden_name,
                x,
                {"units": path.units[path.hidden_name], "long_name": "hidden state"},
            ),
        },
        {"bias": bias, "objective": robust.objective},
    )


def feedback_points(stretch: Stretch, truth: Locus, x: Floats, bias: float = 0.0) -> Floats:
    """Return the controls (k, n) at which feedback on a stretch stops a true process at hidden states (k,).

    There the biased reading equals the computed limit; else it is the nearer end of the stretch.
    """

    def slack(s: Floats) -> Floats:
        controls = stretch.rows(s)[:, : len(stretch.names)]
        response = truth.system.values(controls, x[:, None])[1][:, 0]
        return np.asarray(stretch.values(controls, x)[1] - response - bias)

    places = root(slack, np.full(x.shape, stretch.low), np.full(x.shape, stretch.high))
    return stretch.rows(places)[:, : len(stretch.names)]


def _optima(curve: Locus, x: Floats) -> tuple[Floats, Floats]:
    """Return controls (k, n) and cost (k,) of the optima; NaN without one."""
    controls, cost = np.full((len(x), len(curve.names)), np.nan), np.full(len(x), np.nan)
    for k, state in enumerate(x):
        if curve.range[0] <= state <= curve.range[1]:
            point = curve.at(**dict[str, Any]({curve.hidden_name: float(state)}))
            controls[k], cost[k] = list(point.controls.values()), point.cost
    return controls, cost
