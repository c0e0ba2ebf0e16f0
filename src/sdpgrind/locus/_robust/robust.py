"""A locus for models that disagree: the one whose points cost least where feedback stops the true process.

Feedback stops a process where its own constraint crosses the locus that is walked on, whatever model that locus came from. At a
point z sample j stops for the hidden state X_j(z), with P_j(z, X_j) = 0, and loses l_j(z) = phi_j(z, X_j) - phi_j*(X_j). Over
hidden states that are equally likely, a locus z(s) loses the sum over j of w_j times the integral of l_j dX_j. That is linear in
dz/ds, so that its variation holds no derivative of the locus: with two controls, (u, v), it is

    sum over j of w_j Q_j(z, X_j) / |dP_j/dx| = 0,    Q = phi_u P_v - phi_v P_u of Koren (12).

The best locus in the mean is that of the weighted mean of the equations of all samples, point by point, whatever coordinate is
used, and no optimum has to be known. Where hidden states are not equally likely, each term counts by the density at its X_j. The
worst loss is made least point by point, too: at each v the u whose largest l_j is least.
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
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.tape_kernels import run_many
from sdpgrind.locus._robust.samples import Sample, checked, declared_range, shares, traced
from sdpgrind.locus._stretch.inverse import root
from sdpgrind.locus._stretch.stretch import Stretch

OBJECTIVES = ("mean", "worst")
WAYS = ("nominal", "robust", "open loop")
"""Of walking, whose losses are compared."""
GOLDEN = 0.5 * (5**0.5 - 1)
ROUNDS = 64
"""Of the golden section: the bracket shrinks to rounding."""


@dataclass(frozen=True, eq=False, repr=False)
class RobustLocus:
    """A locus for several models, to be walked on with feedback; `robust_locus` makes it. Units are those of the problems.

    Attributes
    ----------
    samples : tuple of Problem
        The models that disagree; the first is the nominal one, which gives limit and calibration.
    weights : array, (samples,)
        Of the samples; their sum is 1.
    objective : {"mean", "worst"}
        What was made least.
    x : (float, float)
        Range of the hidden state.
    path, nominal : Stretch
        The robust locus, and that of the nominal model.
    curves : tuple of Locus
        What each sample alone holds for best.
    """

    samples: tuple[Problem, ...]
    weights: Floats
    objective: str
    x: tuple[float, float]
    path: Stretch
    nominal: Stretch
    curves: tuple[Locus, ...]

    def stretch(self, along: str | None = None, x: tuple[float, float] | None = None) -> Stretch:
        """Return the robust locus, as a controller takes it.

        Parameters
        ----------
        along : str, optional
            Its coordinate.
        x : (float, float), optional
            Range of the hidden state: not used, for it was declared before (in its unit).

        Raises
        ------
        ValueError
            When another coordinate is asked for.
        """
        if along not in (None, self.path.along):
            raise checks.refuse("along", f"{self.path.along!r}, the coordinate of the robust locus", along)
        return self.path

    @cached_property
    def losses(self) -> xr.Dataset:
        """What is lost: `losses_with` of a sensor without bias (units of cost and response)."""
        return self.losses_with()

    def losses_with(self, *, points: int = 33, bias: float = 0.0) -> xr.Dataset:
        """Return what every sample loses at every hidden state: on the nominal locus, on the robust one, and open loop.

        ``loss`` is the cost beyond the sample's own optimum there; below 0 where the limit is violated for it. ``violation`` is
        how far the sample's response passes its limit (below 0: slack). Open loop: the nominal model's controls for the true
        hidden state, which nobody knows.

        Parameters
        ----------
        points : int
            Hidden states.
        bias : float
            What the sensor reads too much, in the unit of the response.
        """
        return loss_table(
            self,
            checks.count("points", points, 2),
            checks.number("bias", bias, self.path.units[self.path.response]),
        )

    def __repr__(self) -> str:
        worst = float(self.losses.loss.sel(way="robust").max())
        return f"RobustLocus({len(self.samples)} samples, {self.objective}; {self.path!r}; loses at most {worst:.3g})"


def robust_locus(
    samples: Sequence[Problem],
    *,
    along: str,
    objective: str = "mean",
    weights: Any = None,
    x: tuple[float, float] | None = None,
    points: int = 200,
) -> RobustLocus:
    """Find the locus on which a process loses least, with feedback, when models of it disagree.

    Feedback keeps the true response at its limit, so that a locus that is a little wrong loses only to second order. Where models
    disagree by more, no locus is right for all of them; this is the one with the least mean or worst loss.

    Parameters
    ----------
    samples : sequence of Problem
        Models that disagree, or one problem with models drawn from what is known: two or more, with the same two controls, the
        same hidden state, and one constraint, whose limit, which is computed, is the same in all. The first is nominal.
    along : str
        The coordinate: a control that is single-valued on the locus of every sample.
    objective : {"mean", "worst"}
        Mean over samples and hidden states; or the worst of all samples, point by point.
    weights : array, (samples,), optional
        Of the samples in the mean; else equal.
    x : (float, float), optional
        Range of the hidden state, in its unit; else that of the nominal problem.
    points : int
        About how many points the table has.

    Raises
    ------
    ValueError
        When samples do not fit each other, or have no coordinate in common.
    TypeError
        When a sample is no problem.

    Examples
    --------
    Two models whose speed counts with another power:

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
    """Other control and its slope by the coordinate, where the weighted mean of all conditions is 0."""

    def total(others: Floats) -> Floats:
        controls = _controls(places, others, free)
        return np.asarray(sum(w * one.condition(controls) for w, one in zip(weights, models, strict=True)))

    found = root(lambda others: total(others)[:, 0], *_between(models, places, free))
    slopes = total(found)
    return found, np.asarray(-slopes[:, 2 - free] / slopes[:, 1 + free])


def _worst(models: list[Sample], weights: Floats, places: Floats, free: int) -> tuple[Floats, Floats]:
    """Other control whose largest loss is least, by the golden section; the weights do not matter."""

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
    return found, np.asarray(
        PchipInterpolator(places, found).derivative()(places)
    )  # it has kinks where the worst two change


def _between(models: list[Sample], places: Floats, free: int) -> tuple[Floats, Floats]:
    """Least and greatest of what all samples want at the coordinates."""
    own = np.array([one.stretch.rows(places)[:, free] for one in models])
    return own.min(axis=0), own.max(axis=0)


def _controls(places: Floats, others: Floats, free: int) -> Floats:
    return np.column_stack([others, places] if free == 0 else [places, others])


def _places(models: list[Sample]) -> tuple[Floats, tuple[str, str]]:
    """Coordinates of the nodes, as far as the loci of all samples are known; and why they end there."""
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
    """The robust locus with the limit of the nominal model, and calibrated by its hidden state."""
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
    """Loss and violation by sample, way and hidden state; unknown where a sample has no optimum."""
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
    """Controls (k, n) at which feedback on a stretch stops a true process for hidden states (k,).

    That is where the reading meets the computed limit, or the end next to it.
    """

    def slack(s: Floats) -> Floats:
        controls = stretch.rows(s)[:, : len(stretch.names)]
        response = truth.system.values(controls, x[:, None])[1][:, 0]
        return np.asarray(stretch.values(controls, x)[1] - response - bias)

    places = root(slack, np.full(x.shape, stretch.low), np.full(x.shape, stretch.high))
    return stretch.rows(places)[:, : len(stretch.names)]


def _optima(curve: Locus, x: Floats) -> tuple[Floats, Floats]:
    """Controls (k, n) and cost (k,) of the optima; NaN where there is none."""
    controls, cost = np.full((len(x), len(curve.names)), np.nan), np.full(len(x), np.nan)
    for k, state in enumerate(x):
        if curve.range[0] <= state <= curve.range[1]:
            point = curve.at(**dict[str, Any]({curve.hidden_name: float(state)}))
            controls[k], cost[k] = list(point.controls.values()), point.cost
    return controls, cost
