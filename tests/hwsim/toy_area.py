"""A whole area of the command line, as small as it can be: a tank that is drained at a planned flow."""

import dataclasses
import json
from dataclasses import dataclass

import xarray as xr
from hwsim_fakes import Drain, Tank
from hwsim_inside import parts_table, read, summary_head, summary_line

from hwsim.command.base import AreaCommand
from sdpgrind.base import checks, records


@dataclass(frozen=True)
class Draining:
    """How much, and in what time."""

    level: float = 10.0
    duration: float = 5.0

    def __post_init__(self):
        checks.positive("duration", self.duration, "s")


@dataclass(frozen=True)
class Flow:
    """The plan: one flow."""

    problem: Draining
    error: float | None = 1e-3

    @property
    def flow(self):
        return self.problem.level / self.problem.duration

    def plot(self):
        from matplotlib import pyplot

        return pyplot.figure()

    def save(self, path):
        text = json.dumps([dataclasses.asdict(self.problem), self.error])
        records.write(xr.Dataset(attrs={"plan": text}), path, "toy.flow")

    @classmethod
    def from_file(cls, path):
        problem, error = json.loads(records.read(path).attrs["plan"])
        return cls(Draining(**problem), error)


@dataclass(frozen=True)
class Job:
    problem: Draining
    stand: Tank

    def controller(self, plan):
        return Drain(plan.flow)


class Toy(AreaCommand):
    name, about = "toy", "drain a tank"
    made_for, part = "a tank", "drain"
    presets, units = "full, half", "mm, s"
    error_unit, tolerance = "mm/s", "of the flow, mm/s"
    switches = {"--no-leak": "a tank that is tight"}  # noqa: RUF012

    def read(self, path, arguments):
        return self.job_of(read(path, self._problem), arguments)

    def _problem(self, table):
        return table.made(Draining, **table.given({"level": "mm", "duration": "s"}))

    def preset(self, name):
        return Draining({"full": 10.0, "half": 5.0}[checks.one_of("name", name, ("full", "half"))])

    def job_of(self, problem, arguments):
        return Job(problem, Tank(problem.level, leak=0.0 if arguments.no_leak else 0.5))

    def plan_class(self):
        return Flow

    def plan(self, job, arguments, progress):
        return Flow(job.problem, 1e-3 if arguments.tolerance is None else arguments.tolerance)

    def report(self, title, log, plan, job):
        lines = parts_table(log, "drain", [("time", ".2f"), ("leak", ".3f")], {"leak": "lost"})
        head = summary_head(len(log), len(log), "drain")
        summary = [head, summary_line("time (s)", log.outcome.time.values, ".2f", job.problem.duration)]
        return "\n".join([f"{title}: {plan.flow:g} mm/s", *lines, *summary])


AREA = Toy()
