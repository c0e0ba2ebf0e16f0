"""Scatter of K1, K2 and mu from pass to pass and from bead to bead, from the passes of several beads.

Logarithms of a pass are those of its bead plus its own. The friction is told by ln(F_t/F_n) alone. The
energies are told by ln Q = ln(Pi - K2) - ln K1, linearised about K2; ordinary passes do not tell the scatter
of K2 from that of K1, which is taken to be the same unless both are asked for.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base import checks
from sdpgrind.base.brief import counted
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.weldbead._identify.components import (
    ALIKE,
    BeadReadings,
    Components,
    Ends,
    Reml,
    Tied,
    components,
)
from sdpgrind.weldbead._identify.widening import widening
from sdpgrind.weldbead.sequence._belief_update import MOST_IDLE
from sdpgrind.weldbead.sequence._coefficient_scatter import ASSUMED, COEFFICIENTS, CoefficientScatter
from sdpgrind.weldbead.sequence._process import GrindingProcess
from sdpgrind.weldbead.sequence._scatter import Scatter

_READ = {
    "normal_force": "N", "tangential_force": "N", "grinding_power": "W", "removal_rate": "mm^3/s", "part": "",
}  # fmt: skip
_ENOUGH = 4  # beads that tell a scatter between beads; derived: with three its interval is a decade wide
_LINEARISED = 4  # measured: ln K2 settles to 4e-4 or less on five logs of 20 beads
_VAGUE = 4.0  # source: upper over lower limit of an interval above which the specification has no component
_DRIFTS = 3.0  # t of a trend of bead means from which it is told; chosen: 3 of 1000 by chance


@dataclasses.dataclass(frozen=True, repr=False)
class BeadScatterEstimate(Frozen):
    """Scatter between passes and between beads, for `SequenceProblem.updated`.

    Attributes
    ----------
    scatter : Scatter
        From pass to pass: K1, K2 and mu, relative sd, unit 1.
    bead_scatter : CoefficientScatter
        From bead to bead, relative sd, unit 1.
    interval : mapping
        By coefficient: 95 % intervals of the relative sd (unit 1) from pass to pass, and from bead to bead.
    not_identified : tuple of str
        Components of K1 and K2, fitted apart, whose upper limit is above four times the lower one, as
        "idle_power between beads". `scatter` or `bead_scatter` then has one value for both coefficients, that
        of the fit in which they scatter alike.
    process : GrindingProcess
        Model with the mean coefficients of the beads: J/mm^3, W, 1.
    beads, passes : int
        Read.
    message : str
        Data behind it, what is assumed, and drift from bead to bead.
    """

    scatter: Scatter
    bead_scatter: CoefficientScatter
    interval: Mapping[str, tuple[Ends, Ends]]
    not_identified: tuple[str, ...]
    process: GrindingProcess
    beads: int
    passes: int
    message: str

    def __repr__(self) -> str:
        own = self.scatter.coefficients
        told = ", ".join(
            f"{name} {getattr(own, name):.3g} between passes,"
            f" {getattr(self.bead_scatter, name):.3g} between beads"
            for name in COEFFICIENTS
        )
        return f"BeadScatterEstimate({told}; {self.message})"


def estimate_components(
    data: Any,
    *,
    model: GrindingProcess | None,
    depth_noise: float = 0.0,
    tie: bool = True,
    conservative: bool = False,
) -> BeadScatterEstimate:
    """Estimate both scatters; see `identify`. Removal rates have the noise of the scans."""
    model = checks.kind("model", model, GrindingProcess, ", about whose idle power passes are linearised")
    read = _read(data, _READ | {"cut_depth": "mm"} if depth_noise else _READ)
    read = read.only((read["removal_rate"] > 0) & (read["normal_force"] > 0) & (read["tangential_force"] > 0))
    read.require(3)
    beads = list(_by_bead(read))
    if all(each["part"].size == 1 for each in beads):
        raise ValueError("data must have at least two passes of one bead; got one of each")
    friction = components([_friction(bead) for bead in beads])
    readings = _energies(beads, model, depth_noise)
    widened = partial(widening, beads=beads, readings=readings)
    energy = components(readings, ALIKE if tie else Tied(False, len(beads) < _ENOUGH), widened)
    vague = () if tie else tuple(_vague(energy, len(beads)))
    if vague:
        energy = _tied_where(vague, energy, readings)
    return _concluded(read, beads, model, friction, energy, vague, conservative)


def _vague(energy: Components, beads: int) -> Iterator[str]:
    """Components of K1 and K2 that the passes do not tell."""
    for level, intervals in (("passes", energy.passes_interval), ("beads", energy.beads_interval)):
        for name, (low, high) in zip(COEFFICIENTS, intervals, strict=False):
            if high > _VAGUE * low and not (level == "beads" and beads < _ENOUGH):
                yield f"{name} between {level}"


def _tied_where(vague: tuple[str, ...], apart: Components, readings: list[BeadReadings]) -> Components:
    """Fit K1 and K2 alike on a level of which a component is not identified; intervals are those apart."""
    passes, beads = (any(name.endswith(level) for name in vague) for level in ("passes", "beads"))
    tie = Tied(passes, beads or len(readings) < _ENOUGH)  # of few beads no scatter is told at all
    return components(readings, tie)._replace(
        passes_interval=apart.passes_interval, beads_interval=apart.beads_interval
    )


def _read(data: Any, names: dict[str, str]) -> idf.Readings:
    """Passes with the number of their bead; each log of a list has beads of its own."""
    if not isinstance(data, list | tuple):
        return idf.readings(data, names, tier="sequence", each="passes")
    found = [idf.readings(each, names, tier="sequence", each="passes") for each in data]
    first = 0.0
    for read in found:
        read.arrays["part"] = read["part"] - read["part"].min() + first
        first = float(read["part"].max()) + 1.0
    arrays = {name: np.concatenate([read[name] for read in found]) for name in names}
    return dataclasses.replace(found[0], arrays=arrays, dropped=sum(read.dropped for read in found))


def _by_bead(read: idf.Readings) -> Iterator[dict[str, Floats]]:
    parts = read["part"]
    for part in np.unique(parts):
        yield {name: values[parts == part] for name, values in read.arrays.items()}


def _friction(bead: Mapping[str, Floats]) -> BeadReadings:
    y = np.log(bead["tangential_force"] / bead["normal_force"])
    one = np.ones((y.size, 1))
    return BeadReadings(y, one, one, one, np.zeros(y.size))


def _energies(
    beads: list[dict[str, Floats]], model: GrindingProcess, depth_noise: float
) -> list[BeadReadings]:
    """Readings of ln K1 and ln K2, linearised anew about the mean of K2."""
    at, passes = float(np.log(model.idle_power)) if model.idle_power > 0 else -np.inf, ASSUMED
    for _ in range(_LINEARISED - 1):
        likelihood = Reml([_energy(bead, at, passes, depth_noise) for bead in beads], told=len(beads) > 1)
        passes = float(np.sqrt(likelihood.best[0][0]))
        if np.isfinite(at):
            at = float(likelihood.means[1])
    return [_energy(bead, at, passes, depth_noise) for bead in beads]


def _energy(bead: Mapping[str, Floats], at: float, passes: float, depth_noise: float) -> BeadReadings:
    """Reading -ln K1 - g ln K2 of each pass, g the idle over the removing power at ln K2 = `at`."""
    power = bead["grinding_power"]
    idle = np.minimum(np.exp(at), power * MOST_IDLE / (1 + MOST_IDLE))
    g = idle / (power - idle)
    own = 0.5 * passes**2 * (1 - g**2)  # of the pass's own K1 and K2, second order
    logs = np.log(idle) if np.isfinite(at) else np.zeros(g.size)
    y = np.log(bead["removal_rate"]) - np.log(power - idle) - g * logs - own
    loads = np.column_stack([-np.ones(g.size), -g]) if np.isfinite(at) else -np.ones((g.size, 1))
    noise = (depth_noise / bead["cut_depth"]) ** 2 if depth_noise else np.zeros(g.size)
    return BeadReadings(y, loads, loads, loads**2, noise)


def _relative(sd: float) -> float:
    return float(np.sqrt(np.expm1(sd**2)))


def _concluded(
    read: idf.Readings,
    beads: list[dict[str, Floats]],
    model: GrindingProcess,
    friction: Components,
    energy: Components,
    vague: tuple[str, ...],
    conservative: bool,
) -> BeadScatterEstimate:
    few = len(beads) < _ENOUGH
    found = dict(zip(COEFFICIENTS, ((energy, 0), (energy, -1), (friction, 0)), strict=True))
    interval = {
        name: (_ends(each.passes_interval[k]), (0.0, np.inf) if few else _ends(each.beads_interval[k]))
        for name, (each, k) in found.items()
    }
    passes = {name: _relative(each.passes[k]) for name, (each, k) in found.items()}
    between = {name: ASSUMED if few else _relative(each.beads[k]) for name, (each, k) in found.items()}
    if conservative:
        passes = {name: min(ends[0][1], 1.0) for name, ends in interval.items()}
        between = between if few else {name: min(ends[1][1], 1.0) for name, ends in interval.items()}
    return BeadScatterEstimate(
        scatter=Scatter(("K1", "K2", "mu"), tuple(passes.values()), law="lognormal"),
        bead_scatter=CoefficientScatter(**between, correlation=None),
        interval=interval,
        not_identified=vague,
        process=model.replace(**_means(energy, friction)),
        beads=len(beads),
        passes=read.points,
        message="; ".join(_told(read, beads, model, vague, conservative)),
    )


def _told(
    read: idf.Readings,
    beads: list[dict[str, Floats]],
    model: GrindingProcess,
    vague: tuple[str, ...],
    conservative: bool,
) -> Iterator[str]:
    yield f"{counted(len(beads), 'bead')}, {read.message}"
    yield from _drift(beads, model)
    if vague:
        yield f"not identified: {', '.join(vague)}; K1 and K2 are taken to scatter alike there"
    if conservative:
        which = "" if len(beads) >= _ENOUGH else " of the scatter from pass to pass"
        yield f"the plan is told the upper limits of the 95 % intervals{which}"
    if len(beads) < _ENOUGH:
        yield f"scatter between beads assumed: fewer than {_ENOUGH} beads do not tell it"


def _means(energy: Components, friction: Components) -> dict[str, float]:
    """Mean coefficients of the beads from the means of their logarithms; 0 without idle power."""
    idle = float(np.exp(energy.means[1] + 0.5 * energy.beads[1] ** 2)) if energy.means.size == 2 else 0.0
    k1, mu = (float(np.exp(each.means[0] + 0.5 * each.beads[0] ** 2)) for each in (energy, friction))
    return dict(zip(COEFFICIENTS, (k1, idle, mu), strict=True))


def _ends(sds: Ends) -> Ends:
    return _relative(sds[0]), _relative(sds[1])


def _drift(beads: list[dict[str, Floats]], model: GrindingProcess) -> Iterator[str]:
    """Sentences on bead means that rise or fall with the order of the beads."""
    if len(beads) < _ENOUGH:
        return
    order = np.column_stack([np.ones(len(beads)), np.arange(float(len(beads)))])
    for name, means in (
        ("friction_ratio", [float(np.mean(_friction(bead).y)) for bead in beads]),
        ("specific_energy", [_mean_energy(bead, model) for bead in beads]),
    ):
        line = idf.least_squares(order, np.array(means), names=("mean", "trend"), throw=False)
        if line.ok and abs(line["trend"]) > _DRIFTS * line.sd[1]:
            yield f"{name} drifts by {100 * np.expm1(line['trend']):+.2g} % a bead, which no plan knows of"


def _mean_energy(bead: Mapping[str, Floats], model: GrindingProcess) -> float:
    """Mean of ln K1 of a bead at the model's K2."""
    left = np.maximum(bead["grinding_power"] - model.idle_power, 0.1 * bead["grinding_power"])
    return float(np.mean(np.log(left / bead["removal_rate"])))
