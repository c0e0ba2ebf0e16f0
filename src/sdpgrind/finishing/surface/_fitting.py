"""Surface through scattered points, of a net that grows as far as it helps."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._coverage import NEAR, WIDE, empty_share
from sdpgrind.finishing.surface._fit_quality import FitQuality, agreement, kept_by_most, root_mean_square
from sdpgrind.finishing.surface._fit_task import SPARE, FitTask, Net, task_of
from sdpgrind.finishing.surface._folds import refuse_folded_surface
from sdpgrind.finishing.surface._least_squares import Knots
from sdpgrind.finishing.surface._net_fit import NetFit, fit_net

GROWTH, FALL = 1.5, 0.9  # source: finishing-any-robot.md, section 2
MOST = 16_384  # chosen: control points; their equations take a second
NOISE = 0.1  # chosen: correlation of neighbours; a tenth of what is left may be form
EMPTY = 0.05  # source: finishing-any-robot.md, section 2

GIVEN = "the net was given"
KEPT = "99 % of the points keep the tolerance"
IS_NOISE = "a finer net is no nearer, and neighbours differ as noise does"
IS_FORM = (
    "finer nets are no nearer, but neighbours agree: edge, ripple or smooth noise; a given net may follow"
)
FEW = "a finer net needs more points"


class Fitted(NamedTuple):
    """Control points and knots of a surface whose Qu x Qv is on the side of the tool, and its quality."""

    control_points: Floats
    knots: Knots
    quality: FitQuality


def fitted(
    points: npt.ArrayLike,
    net: Net | None,
    degree: tuple[int, int],
    tolerance: float,
    side: npt.ArrayLike | None,
    empty_max: float,
    scattered: bool,
) -> Fitted:
    """Fit a net to points (m, 3); see `Surface.fit`. Corners of triangles are not `scattered`."""
    most = checks.share("empty_max", empty_max)
    task = task_of(points, net, degree, tolerance, side)
    fit, status = _grown(task) if net is None else (fit_net(task, task.net), GIVEN)
    refuse_folded_surface(fit.at_feet, task.points, task.plane.axes[2])
    empty = empty_share(fit.uv[:, fit.used], fit.spans, task.plane.sides if scattered else None)
    _refuse_holes(empty, most, fit)
    agree, (nu, nv) = _agreement(task, fit), fit.control_points.shape[:2]
    left_out = tuple(np.flatnonzero(~fit.used).tolist())
    quality = FitQuality(fit.distances, fit.uv.T, task.tolerance, (nu, nv), empty, agree, status, left_out)
    return Fitted(fit.control_points, fit.knots, quality)


def _grown(task: FitTask) -> tuple[NetFit, str]:
    """Fit nets that grow until the tolerance is kept or the residual stops falling."""
    net, fit = task.net, fit_net(task, task.net)
    before: NetFit | None = None  # the coarser net, where the last growth did not help
    while kept_by_most(_kept(fit)) > task.tolerance:
        net = math.ceil(GROWTH * net[0]), math.ceil(GROWTH * net[1])
        if math.prod(net) > min(len(task.points) // SPARE, MOST):
            return fit, FEW
        finer = fit_net(task, net)
        if _falls(before or fit, finer):
            before = None
        elif _agreement(task, fit) < NOISE:
            return fit, IS_NOISE
        elif before:  # form may hide from one net, hardly from two
            return before, IS_FORM
        else:
            before = fit
        fit = finer
    return fit, KEPT


def _falls(coarse: NetFit, fine: NetFit) -> bool:
    """Whether the residual falls by a tenth."""
    return root_mean_square(_kept(fine)) < FALL * root_mean_square(_kept(coarse))


def _kept(fit: NetFit) -> Floats:
    """Distances of all points but outliers."""
    return fit.distances[fit.used]


def _agreement(task: FitTask, fit: NetFit) -> float:
    """Correlation of the distances of neighbours, none of them an outlier."""
    return agreement(fit.distances, task.pairs[:, fit.used[task.pairs].all(axis=0)])


def _refuse_holes(empty: float, most: float, fit: NetFit) -> None:
    if empty > most:
        nu, nv = fit.control_points.shape[:2]
        raise ValueError(
            f"points must lie within {NEAR} knot spans, and within {WIDE:g} times the usual distance of"
            f" points, of all but {most:g} of the rectangle around them; {empty:.3g} of it is empty at a net"
            f" of {nu} x {nv}. Take a smaller region, or empty_max="
            f"{math.ceil(100 * empty) / 100:g} where the part has a hole or no corner there"
        )
