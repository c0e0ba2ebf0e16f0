"""Things that ``exports.py`` exports: plans, controllers, estimators, tables of one to three axes."""

from collections.abc import Callable
from typing import Any

import casadi
import numpy as np

import centering
from sdpgrind import finishing, identify, locus, plunge, sdp, units, weldbead
from sdpgrind.locus._curve.inversion import Inversion
from sdpgrind.locus._problem.tape import tape
from sdpgrind.locus._trace.table import LocusTable
from sdpgrind.weldbead import force


def cycle() -> Any:
    return plunge.CycleController(plunge.preset("simulation"), safety_margin=0.05)


def stages() -> Any:
    return plunge.StagedController(plunge.preset("simulation"))


def motion() -> Any:
    path = finishing.hilbert(finishing.surface.flat_surface(6.4), 2, mapping="parametric")
    return finishing.plan(finishing.FinishingProblem(path, friction_ratio=0.0))


def torque() -> Any:
    return finishing.TorqueController(finishing.TorqueAxis(), motion(), normal_force=1.111, kind="lqg")


def _pass() -> Any:
    time = np.array([0.0, 0.4, 1.0, 2.0])
    planned = {"time": time, "normal_force": [30.0, 30.0, 55.0, 20.0], "fly_height": [10.0, 9.9, 9.8, 10.0]}
    return type("Plan", (), {**planned, "center_x": 30.0 * time})


def press() -> Any:
    return force.ForceController(_pass(), force.PI.design(crossover=units.hz(3.0)))


def ahead() -> Any:
    """Predictive, at its limits: a quadratic program in most samples."""
    limits = force.Limits(command_max=-9.85, command_min=-11.0, command_rate_max=3.0)
    return force.PredictiveController(_pass(), force.Predictive(), limits=limits)


def bead() -> Any:
    return weldbead.plan(weldbead.preset("P1"), tolerance=1e-3)


def ring() -> Any:
    return centering.GeometryEstimator(noise_sd=0.002)


def table() -> Any:
    key = np.linspace(0.5, 4.0, 12)
    columns = np.column_stack([np.sin(key), key**2])
    names = {"wear": "mm", "feed": "mm/s", "speed": "mm/s"}
    return LocusTable(key, columns, np.column_stack([np.cos(key), 2.0 * key]), names)


def along() -> Any:
    return locus.LocusController(locus.plan(locus.preset("grinding")), along="infeed_rate")


def inversion() -> Any:
    return locus.plan(locus.preset("grinding")).inversion()


def rough() -> Any:
    """Inversion of a rough response, flat between a rise and a jump: Newton's method fails, and it bisects."""
    v, x = casadi.SX.sym("v"), casadi.SX.sym("x")
    steps = 2.0 * casadi.atan(40.0 * (x - 1.3)) + casadi.atan(1e40 * (x * x - 9.7)) + 0.3 * x
    response = v * steps + 1e-3 * casadi.sqrt(v + 1.3)  # none below; it falls from there to 0
    key = np.linspace(1.0, 4.0, 12)
    columns = np.column_stack([1.0 + 0.1 * key])
    place = LocusTable(key, columns, np.full((key.size, 1), 0.1), {"state": "mm", "speed": "mm/s"})
    made = casadi.Function("f", [v, x], [response, casadi.jacobian(response, x)])
    return Inversion(tape(made), place, low=1.0, high=4.0, units={"power": "W"})


def rows() -> Any:
    return identify.RecursiveLeastSquares(("start", "slope", "bend"), forgetting=0.98)


def _prior() -> Any:
    return identify.Estimate(("start", "slope", "bend"), [1.0, 2.0, 3.0], np.diag([0.1, 0.2, 0.3]))


def rows_known() -> Any:
    """The noise is known: no residuals are squared."""
    return identify.RecursiveLeastSquares(_prior().names, forgetting=0.98, prior=_prior(), noise_sd=0.1)


def walk() -> Any:
    return identify.RandomWalk(_prior().names, walk_variance=1e-3, noise_variance=[0.1, 0.2, 0.3])


def walk_of_row() -> Any:
    return identify.RandomWalk(_prior().names, walk_variance=1e-3, noise_variance=0.2, prior=_prior())


def push() -> Any:
    return centering.plan(centering.preset("printed").replace(mass=0.8))


def _removed(s: Any, c: Any) -> Any:
    return sdp.LogNormal(0.004 * c.strokes, 0.0008 * c.strokes)


def hone() -> Any:
    """One axis, no deadline, a charge of too little stock."""
    moves = [
        sdp.Move("hone", {"strokes": sdp.Levels(1.0, 9.0, 5)}, sdp.Shift("stock", _removed),
                 charge=lambda s, c: 0.3 + 0.02 * c.strokes),
        sdp.Move("lap", {"strokes": [2.0, 4.0]}, sdp.Shift("stock", _removed), charge=0.4),
    ]  # fmt: skip
    stop = sdp.Stop("done", sdp.Charge(under=sdp.Linear(200.0), over=sdp.Linear(900.0)))
    stock = sdp.Axis("stock", 0.0, 0.04, 21, "mm", below="stop")
    return sdp.plan(sdp.Problem([stock], moves, [stop], sdp.Forever()))


def bent() -> Any:
    """The charge of the stop is bent within cells, on both sides of a target on the axis; two modes."""
    axis = sdp.Axis("height", -0.5, 2.0, 26, "mm", below="stop", above="hold")
    levels = {"mean": sdp.Levels(0.05, 0.6, 9)}
    moves = [
        sdp.Move("grind", levels, sdp.Shift("height", lambda s, c: sdp.Rayleigh(c.mean, 0.3 * c.mean)),
                 charge=lambda s, c: 0.02 + 0.1 * (s.mode == 1)),
        sdp.Move("wait", {}, sdp.Stay(), charge=0.05, into="one"),
    ]  # fmt: skip
    stop = sdp.Stop("stop", sdp.Charge(under=sdp.Quadratic(1.0), over=sdp.Quadratic(9.0)))
    return sdp.plan(
        sdp.Problem([axis], moves, [stop], sdp.Stages(4, 2.0, "left", "s"), modes=("one", "other"))
    )


def _axes(count: int) -> list[Any]:
    wide = sdp.Axis("x", 0.1, 2.0, 21, "mm", "log", below="hold", above="hold")
    return [
        wide,
        *(sdp.Axis(name, 0.0, 1.0, 11, "", below="hold", above="hold") for name in "yz"[: count - 1]),
    ]


def _moves(go: Callable[..., Any]) -> list[Any]:
    by = {"by": sdp.Levels(0.0, 1.0, 21), "kind": [1.0, 2.0]}
    moved = sdp.Sampled(go, {"n": sdp.Normal(0.0, 0.1)})
    return [
        sdp.Move("go", by, moved, charge=lambda s, c: 0.1 * c.by * c.kind),
        sdp.Move("flip", {}, sdp.Stay(), charge=0.05, into="b"),
    ]


def one() -> Any:
    """One logarithmic axis with a deadline; two modes; a listed and a continuous control."""
    moves = _moves(lambda s, c, e: (s.x * (1.0 - 0.5 * c.by),))
    stop = sdp.Stop("end", lambda s: s.x**2 + 0.2 * (s.mode == 0))
    return sdp.plan(sdp.Problem(_axes(1), moves, [stop], sdp.Stages(3, 0.5, "left", "s"), modes=("a", "b")))


def two() -> Any:
    """Two axes, one logarithmic; two modes; a listed and a continuous control."""
    moves = _moves(lambda s, c, e: (s.x * (1.0 - 0.5 * c.by), s.y + e.n))
    stop = sdp.Stop("end", lambda s: s.x**2 + 0.1 * s.y + 0.2 * (s.mode == 0))
    return sdp.plan(sdp.Problem(_axes(2), moves, [stop], sdp.Stages(3, 0.5, "left", "s"), modes=("a", "b")))


def three() -> Any:
    """Three axes, one logarithmic; two modes."""
    moves = _moves(lambda s, c, e: (s.x * (1.0 - 0.5 * c.by), s.y + e.n, s.z + 0.1 * c.kind))
    stop = sdp.Stop("end", lambda s: s.x**2 + 0.1 * s.y + 0.1 * s.z**2 + 0.2 * (s.mode == 0))
    return sdp.plan(sdp.Problem(_axes(3), moves, [stop], sdp.Stages(3, 0.5, "left", "s"), modes=("a", "b")))


THINGS: dict[str, Callable[[], Any]] = {
    "bead": bead, "cycle": cycle, "stages": stages, "torque": torque, "press": press, "ring": ring, "table": table,
    "along": along, "inversion": inversion, "rough": rough,
    "hone": hone, "bent": bent, "one": one, "two": two, "three": three, "rows": rows, "rows_known": rows_known, "walk": walk,
    "walk_of_row": walk_of_row, "push": push, "ahead": ahead,
}  # fmt: skip
"""Name of each thing to how it is made."""
