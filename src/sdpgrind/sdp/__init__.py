"""Stochastic dynamic programming for processes with an uncertain outcome, duration, and optional stopping.

A problem is axes + moves + stops + stages. With J the expected penalty-to-go ($), x the coordinates, n the stages left and
m the mode::

    J_n(x, m) = min( stop charge(x, m) + late(n),
                     min over moves and controls of  charge(x, c) + E J_{n - duration}(x', m') )

`plan` solves it on a grid, exactly for a piecewise linear J where a coordinate falls by a random amount (`Shift`), by
quadrature for any other step (`Sampled`), and refines the grid until the answer is known to a tolerance.

Error of a solution: linear interpolation makes it second order in the spacing on average (kinks of J fall unevenly between
nodes; for the weld-bead problems the largest error of all states falls 2.8 to 4 times a halving). ``policy.error`` adds the
extrapolated error of the grid and that of the search between control levels.
"""

from sdpgrind.sdp._distributions.discrete import Discrete, Point
from sdpgrind.sdp._distributions.empirical import Empirical, RectifiedNormal
from sdpgrind.sdp._distributions.law import Law
from sdpgrind.sdp._distributions.normal import LogNormal, Normal
from sdpgrind.sdp._distributions.rayleigh import Rayleigh
from sdpgrind.sdp._plan.check import Report, check
from sdpgrind.sdp._plan.plan import ToleranceError, plan
from sdpgrind.sdp._policy.distribution import Distribution
from sdpgrind.sdp._policy.policy import Action, Policy
from sdpgrind.sdp._policy.simulate import Runs
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.one_sided import Constant, Linear, OneSided, Quadratic
from sdpgrind.sdp._problem.problem import Axis, Forever, Levels, Move, Problem, Stages, Stop, Transition
from sdpgrind.sdp._transitions.rows import Rows
from sdpgrind.sdp._transitions.sampled import Sampled
from sdpgrind.sdp._transitions.shift import Shift
from sdpgrind.sdp._transitions.stay import Stay

__all__ = [
    "Action",
    "Axis",
    "Charge",
    "Constant",
    "Discrete",
    "Distribution",
    "Empirical",
    "Forever",
    "Law",
    "Levels",
    "Linear",
    "LogNormal",
    "Move",
    "Normal",
    "OneSided",
    "Point",
    "Policy",
    "Problem",
    "Quadratic",
    "Rayleigh",
    "RectifiedNormal",
    "Report",
    "Rows",
    "Runs",
    "Sampled",
    "Shift",
    "Stages",
    "Stay",
    "Stop",
    "ToleranceError",
    "Transition",
    "check",
    "plan",
]
