"""Designed experiment in the finishing cell: runs, analysis, confirmation, plan of repeated passes."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._log.log import Log
from hwsim._study.bench import Bench
from hwsim.plants._finishing.beyond import unknown
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import one_blas_thread
from sdpgrind.base.progress import ProgressOption, quiet
from sdpgrind.base.rng import Seed, children
from sdpgrind.base.warned import warn

if TYPE_CHECKING:
    from hwsim.plants._finishing.plant import FinishingCell
    from sdpgrind import finishing
    from sdpgrind.sdp import Policy

UNITS = {"tool_diameter": "mm", "feed_rate": "mm/s", "normal_force": "N"}
ARRAY, REFERENCE = "L18", 0.01  # array; roughness at 0 dB, mm; source: Wang and Jan (2001)
_MODEL = ("pattern", "tool_diameter", "normal_force")  # what the roughness model knows
_TOLD = ("normal_force", "normal_force_sd", "lift_off", "feed", "path_deviation", "roughness_ra", "time")


@dataclass(frozen=True, eq=False, repr=False)
class FinishingStudy:
    """Result of a designed experiment in the cell; see `finishing_study`.

    Attributes
    ----------
    study : finishing.Study
        Analysis of R_a, mm.
    outcome : mapping of str to array, (runs, replicates)
        Outcomes of the runs: force (N), feed (mm/s), roughness (mm), time (s); names as in `FinishingCell`.
    best : mapping of str to level
        Setting of the confirmation, in its own units.
    prediction : finishing.study.Prediction
        Prediction at that setting, in dB and mm.
    confirmation : Log
        Confirmation runs.
    """

    study: "finishing.Study"
    outcome: Mapping[str, Floats]
    best: Mapping[str, Any]
    prediction: "finishing.study.Prediction"
    confirmation: Log

    @property
    def confirmed(self) -> float:
        """Mean signal-to-noise ratio of the confirmation runs, dB."""
        from sdpgrind import finishing

        study = self.study
        read = self.confirmation.outcome.roughness_ra.values.reshape(-1, study.readings.shape[1])
        return float(np.mean(finishing.study.sn_ratio(read, study.ratio, reference=study.reference)))

    def __repr__(self) -> str:
        best = ", ".join(f"{name} {level}" for name, level in self.best.items())
        told = (
            f"{self.prediction.mean:.2f} dB expected, "
            f"{self.confirmed:.2f} dB found in {self.prediction.confirm} runs"
        )
        return f"FinishingStudy({best}: {told}{', within the interval' if self.held else ''})"

    @property
    def held(self) -> bool:
        """Whether the ratio of the confirmation runs, in dB, is within the interval of the prediction."""
        width = self.prediction.ci_confirm
        return width is not None and abs(self.confirmed - self.prediction.mean) <= width

    @cached_property
    def model(self) -> "finishing.roughness.RoughnessModel":
        """Roughness model learned from the readings (mm) of the experiment."""
        from sdpgrind import finishing

        return finishing.roughness.RoughnessModel.published().updated(
            finishing.identify(self.study, "roughness")
        )

    def refinishing(
        self,
        *,
        tolerance: float | None = None,
        roughness_charge: float = 1e4,
        machine_charge: float = 60.0 / 3600.0,
        passes: int = 3,
    ) -> "Policy":
        """Plan when to finish a specimen again, since settings cannot remove all scatter.

        After each pass the roughness is read, and the specimen is delivered or finished again along a path of
        the experiment, with the best tool and force. A pass costs its mean time in the cell.

        Parameters
        ----------
        tolerance : float, optional
            Roughness without charge, mm. Default: prediction at the best setting.
        roughness_charge : float
            Charge for roughness above the tolerance, $/mm. Default: 10 $ a micrometre.
        machine_charge : float
            Charge for machine time, $/s. Default: 60 $ an hour.
        passes : int
            Number of passes for which there is time.

        Returns
        -------
        sdp.Policy
            Policy with ``action(roughness=, passes_left=)`` (mm).

        Raises
        ------
        ValueError
            When the roughness model does not know the paths of the experiment.
        """
        from sdpgrind import finishing, sdp

        level = float(self.prediction.response or 0.0) if tolerance is None else tolerance
        held = {"tool_diameter": self.best["tool_diameter"], "normal_force": self.best["normal_force"]}
        settings = {name: {"pattern": name, **held} for name in map(str, self.study.levels("pattern"))}
        pattern, time = self.study.settings["pattern"], self.outcome["time"].mean(axis=1)
        charges = {name: machine_charge * float(time[pattern == name].mean()) for name in settings}
        charge = sdp.Linear(roughness_charge, tolerance=level)
        problem = finishing.roughness.refinish_problem(
            self.model,
            settings,
            pass_charge=charges,
            roughness_charge=charge,
            passes=passes,
            extrapolate=True,
        )
        return sdp.plan(problem)

    def report(self, *, rng: Seed = 0) -> str:
        """Return the report as text, in µm, N, mm/s and dB; `rng`: source of simulated repetitions."""
        from hwsim._study.report import report

        return report(self, rng)

    def plot(self) -> Any:
        """Draw the mean ratio (dB) for the levels of each factor; return the figure."""
        return self.study.plot()


@quiet
def finishing_study(
    cell: "FinishingCell",
    *,
    tool_diameter: Sequence[float] = (4.0, 3.0),
    pattern: Sequence[str] = ("hilbert5", "hilbert4", "zigzag"),
    feed_rate: Sequence[float] = (12.5, 25.0, 37.5),
    normal_force: Sequence[float] = (0.556, 1.111, 1.667),
    pitch: float | None = None,
    kind: str = "lqg",
    method: str = "trapezoid",
    replicates: int = 1,
    confirm: int = 3,
    rng: Seed = 0,
    folder: str | os.PathLike[str] | None = None,
    progress: ProgressOption = None,
) -> FinishingStudy:
    """Vary tool, path, feed and force in a simulated cell by an L18 array (Wang and Jan, 2001), and confirm.

    Parameters
    ----------
    cell : FinishingCell
        Surface, arm, axis, and scatter of parts. Its own path is not used.
    tool_diameter : sequence of 2 floats
        Tool diameters, mm.
    pattern : sequence of 3 names
        Paths that the roughness model knows: "hilbert4", "hilbert5", "zigzag".
    feed_rate, normal_force : sequence of 3 floats
        Feed rates, mm/s, and normal forces, N.
    pitch : float, optional
        Pitch of the zigzag, mm. None: that of the cell's own path.
    kind : str
        Kind of torque controller.
    method : str
        Time law of the motions.
    replicates : int
        Specimens in each run.
    confirm : int
        Runs at the best setting.
    rng : int, Generator or SeedSequence
        Random source.
    folder : path, optional
        Folder of the journals of all runs; after an interruption the same call resumes from them.
    progress : callable(share, text), True or None
        Called with the completed share (0..1) and a text; True: a line with the time left. Default: silent.

    Returns
    -------
    FinishingStudy
        Readings, analysis, confirmation (mm, dB).

    Raises
    ------
    ValueError
        When a value is out of range, a motion cannot be planned, or the motor cannot press a force.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import finishing
    >>> cell = hwsim.FinishingCell(finishing.preset("specimen"), scatter=hwsim.CellScatter())
    >>> found = hwsim.finishing_study(cell, rng=1)
    >>> found.best["pattern"], found.study.anova()["pattern"].p < 0.01
    ('hilbert5', True)
    """
    replicates, confirm = checks.count("replicates", replicates), checks.count("confirm", confirm)
    assert callable(progress)  # made by the decorator
    factors = {
        "tool_diameter": tuple(tool_diameter),
        "pattern": tuple(pattern),
        "feed_rate": tuple(feed_rate),
        "normal_force": tuple(normal_force),
    }
    bench = Bench(cell, pitch, kind, method, None if folder is None else Path(folder))
    for name in pattern:
        bench.refuse_unknown(name)
    model, settings = cell.problem.model, _settings(factors)
    if told := unknown(model, pattern[0], tool_diameter, normal_force):
        warn(f"what the study finds of roughness is extrapolated: its model does not know {told}")
    extrapolated = sum(not model.covers(*(each[name] for name in _MODEL)) for each in settings)
    *of_runs, of_confirmation = children(rng, len(settings) + 1)
    logs = []
    for k, setting in enumerate(settings):
        with one_blas_thread():
            logs.append(bench.finish(setting, replicates, of_runs[k], f"run-{k + 1:02d}"))
        progress((k + 1) / (len(of_runs) + 1), f"run {k + 1} of {len(of_runs)}")
    outcome = {name: np.array([log.outcome[name].values for log in logs]) for name in _TOLD}
    study = _study(factors, outcome["roughness_ra"], extrapolated)
    best = dict(study.best())
    kept = {name: level for name, level in best.items() if name not in study.best().arbitrary}
    log = bench.finish(best, confirm * replicates, of_confirmation, "confirm")
    progress(1.0, "confirmed")
    return FinishingStudy(study, outcome, best, study.predict(kept, confirm=confirm), log)


def _study(factors: Mapping[str, Any], roughness: Floats, extrapolated: int = 0) -> "finishing.Study":
    """Study of the readings, mm; its name says in how many runs the model is extrapolated."""
    from sdpgrind import finishing

    beyond = f", extrapolated in {extrapolated} of {len(roughness)} runs"
    return finishing.Study(
        ARRAY,
        factors,
        roughness,
        columns=(1, 2, 3, 4),
        reference=REFERENCE,
        name="roughness R_a" + beyond * bool(extrapolated),
        unit="mm",
        units=UNITS,
    )


def _settings(factors: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Setting of each run."""
    from sdpgrind import finishing

    blank = np.ones(len(finishing.study.orthogonal_array(ARRAY).matrix))
    table = _study(factors, blank).settings
    return [{name: values[k].item() for name, values in table.items()} for k in range(len(blank))]
