"""One net fitted to points: least squares at the feet of the points, which are then sought anew."""

from functools import cached_property

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.surface import _evaluation as evaluation
from sdpgrind.finishing.surface import _forms as forms
from sdpgrind.finishing.surface._control_net import clamped
from sdpgrind.finishing.surface._derivatives import SurfaceDerivatives
from sdpgrind.finishing.surface._fit_task import FitTask, Net
from sdpgrind.finishing.surface._least_squares import Knots, control_points
from sdpgrind.finishing.surface._outliers import kept

REPEATS = 3  # source: finishing-any-robot.md, section 2
MORE = 4  # chosen: further ones while points leave or come back; a cloud that swings has no clear outliers

FLAT = 1e-12  # of the mean square of a tangent, chosen: less has no direction to step along


class NetFit:
    """Control points (nu, nv, 3) with their knots, mm, the feet `uv` (2, m) of points (m, 3), and which of
    them were `used` (m,): all but outliers.
    """

    def __init__(
        self, control_points: Floats, knots: Knots, degree: tuple[int, int], points: Floats, used: Bools
    ) -> None:
        self.control_points, self.knots, self.used = control_points, knots, used
        self._points = points
        self._net = evaluation.Net(evaluation.homogeneous(control_points, None), False, knots, degree)
        self.uv = np.empty((2, 0))

    def with_feet(self, uv: Floats) -> "NetFit":
        """Seek the feet of the points from `uv` on: one Newton step of first order, within the domain."""
        d = evaluation.scattered(self._net, *uv)
        rest = self._points - d.point
        (E, F, G), a, b = forms.first_form(d), forms.dot(rest, d.u), forms.dot(rest, d.v)
        least = FLAT * np.array([E.mean(), G.mean(), E.mean() * G.mean()])
        u = np.clip(uv[0] + (G * a - F * b) / np.maximum(E * G - F**2, least[2]), 0.0, 1.0)
        v = np.clip(uv[1] + (b - F * (u - uv[0])) / np.maximum(G, least[1]), 0.0, 1.0)
        u = np.clip(uv[0] + (a - F * (v - uv[1])) / np.maximum(E, least[0]), 0.0, 1.0)
        self.uv = np.stack([u, v])
        return self

    @cached_property
    def at_feet(self) -> SurfaceDerivatives:
        """Feet and derivatives there (m, 3), mm."""
        return evaluation.scattered(self._net, *self.uv)

    @cached_property
    def distances(self) -> Floats:
        """Distances (m,) of the points, mm, > 0 on the side of Qu x Qv."""
        d = self.at_feet
        rest = self._points - d.point
        return np.asarray(np.copysign(np.sqrt(forms.dot(rest, rest)), forms.dot(rest, np.cross(d.u, d.v))))

    @property
    def spans(self) -> tuple[int, int]:
        """Knot spans along u and v."""
        u, v = (len(np.unique(each)) - 1 for each in self.knots)
        return u, v


def fit_net(task: FitTask, net: Net) -> NetFit:
    """Fit a net, from the places of the points over their plane on.

    Feet on a coarser net would be a worse start: they keep the pattern of its knots (measured on a cylinder:
    20 times the error).
    """
    knots = clamped(net[0], task.degree[0]), clamped(net[1], task.degree[1])
    at, used = task.plane.parameters(task.points), np.ones(len(task.points), dtype=bool)
    for repeat in range(REPEATS + MORE):
        rest = task.points[used] - task.plane.corner
        found = control_points(at[:, used], rest, knots, task.degree) + task.plane.corner
        fit = NetFit(found, knots, task.degree, task.points, used).with_feet(at)
        at, before = fit.uv, used
        used = _used(task, fit)
        if repeat + 1 >= REPEATS and (used == before).all():
            break
    return fit


def _used(task: FitTask, fit: NetFit) -> Bools:
    """All points but outliers; all, where they are fewer than the control points then."""
    used = kept((fit.uv * task.plane.sides[:, None]).T, fit.distances, task.tolerance)
    return used if used.sum() >= np.prod(fit.control_points.shape[:2]) else np.ones_like(used)
