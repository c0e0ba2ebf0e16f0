"""A weld-bead job as a TOML file: the planning problem, and the stand on which it is tried.

Keys are the names of the Python interface; numbers are in the library's units (mm, s, N, J, W, rad, $) or texts with a
unit. Every fault is one line that names the key.
"""

import difflib
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from hwsim._quantities import quantity
from hwsim.plants._weldbead import WeldBeadStand
from sdpgrind import sdp, weldbead

_PROCESS = {
    "specific_energy": "J/mm^3",
    "idle_power": "W",
    "friction_ratio": "",
    "disk_radius": "mm",
    "free_speed": "rad/s",
    "speed_droop": "rad/(s N mm)",
    "bead_width": "mm",
}
_BEAD = {
    "bead_length": "mm",
    "reset_time": "s",
    "force_max": "N",
    "height_max": "mm",
    "horizon": "s",
    "stage": "s",
}
_OPTIONAL = {"pass_charge": "$", "min_cut": "mm", "late_window": "s"}
_STAND = {"height": "mm", "time": "s", "height_noise": "mm", "power_noise": "W", "force_noise": "N"}
Made = TypeVar("Made")
_BurnLimit: TypeAlias = weldbead.ForceBurnLimit | weldbead.PowerBurnLimit | weldbead.MalkinBurnLimit


@dataclass
class _Table:
    """A table of the file; what is not taken out of it in the end is a wrong key."""

    name: str  # "" for the file itself
    entries: dict[str, Any]
    known: set[str] = field(default_factory=set)

    def path(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key

    def has(self, key: str) -> bool:
        self.known.add(key)
        return key in self.entries

    def take(self, key: str) -> Any:
        if not self.has(key):
            close = difflib.get_close_matches(key, self.entries.keys() - self.known)
            raise ValueError(f"{self.path(key)} is missing" + (f"; is {self.path(close[0])} meant?" if close else ""))
        return self.entries[key]

    def number(self, key: str, unit: str) -> float:
        return quantity(self.path(key), self.take(key), unit)

    def numbers(self, units: Mapping[str, str]) -> dict[str, float]:
        return {key: self.number(key, unit) for key, unit in units.items()}

    def given(self, units: Mapping[str, str]) -> dict[str, float]:
        return {key: self.number(key, unit) for key, unit in units.items() if self.has(key)}

    def text(self, key: str, choices: Mapping[str, Any] | tuple[str, ...]) -> str:
        value = self.take(key)
        if value not in choices:
            raise ValueError(f"{self.path(key)} must be one of {', '.join(choices)}; got {value!r}")
        return str(value)

    def table(self, key: str) -> "_Table":
        value = self.take(key)
        if not isinstance(value, dict):
            raise ValueError(f"{self.path(key)} must be a table; got {value!r}")
        return _Table(self.path(key), value)

    def made(self, make: Callable[..., Made], *values: Any, **options: Any) -> Made:
        """What `make` makes of values of this table; what it refuses is told with the name of the table."""
        try:
            return make(*values, **options)
        except (ValueError, TypeError) as error:
            raise ValueError(f"[{self.name}] {error}") from None

    def done(self) -> None:
        """Refuse the first key that nobody asked for."""
        for key in self.entries:
            if key not in self.known:
                close = difflib.get_close_matches(key, self.known, 1)
                meant = f"is {self.path(close[0])} meant?" if close else f"keys here are {', '.join(sorted(self.known))}"
                raise ValueError(f"{self.path(key)} is not a key; {meant}")


def read(path: Path) -> WeldBeadStand:
    """Read the job in the file at `path`; ValueError names the file and the key."""
    try:
        with path.open("rb") as file:
            return _stand(_Table("", tomllib.load(file)))
    except (ValueError, TypeError) as error:  # tomllib's error is a ValueError
        raise ValueError(f"{path}: {error}") from None


def _stand(job: _Table) -> WeldBeadStand:
    problem = _problem(job)
    if job.has("stand"):
        table = job.table("stand")
        options: dict[str, Any] = dict(table.given(_STAND))
        if table.has("truth"):
            options["truth"] = _truth(problem, table.table("truth"))
        table.done()
        job.done()
        return table.made(WeldBeadStand, problem, **options)
    job.done()
    return WeldBeadStand(problem)


def _truth(problem: weldbead.SequenceProblem, table: _Table) -> weldbead.SequenceProblem:
    """What the stand really is: coefficients of the process that differ, another scatter."""
    process = table.given(_PROCESS)
    scatter = _scatter(table.table("scatter")) if table.has("scatter") else problem.scatter
    table.done()
    model = table.made(problem.model.replace, **process)
    return table.made(problem.replace, scatter=scatter, model=model)


def _problem(job: _Table) -> weldbead.SequenceProblem:
    process = job.table("process")
    model = process.made(weldbead.GrindingProcess, **process.numbers(_PROCESS))
    process.done()
    return weldbead.SequenceProblem(
        model,
        **job.numbers(_BEAD),
        durations=_durations(job),
        scatter=_scatter(job.table("scatter")),
        burn_limit=_burn_limit(job.table("burn_limit")) if job.has("burn_limit") else None,
        height_charge=_height_charge(job.table("height_charge")),
        lateness_charge=_one_sided(job.table("lateness_charge"), "s") if job.has("lateness_charge") else None,
        finish_charge=_finish_charge(job.table("finish_charge")) if job.has("finish_charge") else None,
        **job.given(_OPTIONAL),
    )


def _durations(job: _Table) -> list[float]:
    values = job.take("durations")
    if not isinstance(values, list):
        raise ValueError(f"durations must be a list of numbers (s); got {values!r}")
    return [quantity(f"durations[{k}]", value, "s") for k, value in enumerate(values)]


def _scatter(table: _Table) -> weldbead.Scatter:
    names, relative = table.take("attribution"), table.take("relative_sd")
    several = isinstance(names, list)
    sds = relative if isinstance(relative, list) else [relative]
    numbers = tuple(quantity(table.path("relative_sd"), value, "") for value in sds)
    options: dict[str, Any] = {"law": table.take("law")} if table.has("law") else {}
    if table.has("sample"):
        options["sample"] = tuple(quantity(table.path("sample"), value, "") for value in table.take("sample"))
    options |= table.given({"bandwidth": ""})
    table.done()
    return table.made(weldbead.Scatter, tuple(names) if several else names, numbers if several else numbers[0], **options)


def _height_charge(table: _Table) -> sdp.Charge:
    sides = {side: _one_sided(table.table(side), "mm") for side in ("under", "over") if table.has(side)}
    table.done()
    return table.made(sdp.Charge, **sides)


def _one_sided(table: _Table, unit: str) -> sdp.OneSided:
    """One charge: ``linear = 2.0``, ``quadratic = ...`` or ``constant = ...``, and a tolerance."""
    kinds: dict[str, tuple[Callable[..., sdp.OneSided], str]] = {
        "linear": (sdp.Linear, f"$/{unit}"),
        "quadratic": (sdp.Quadratic, f"$/{unit}^2"),
        "constant": (sdp.Constant, "$"),
    }
    named = [kind for kind in kinds if table.has(kind)]
    tolerance = table.given({"tolerance": unit})
    table.done()
    if len(named) != 1:
        raise ValueError(f"{table.name} must have one of {', '.join(kinds)}; got {', '.join(named) or 'none'}")
    make, rate_unit = kinds[named[0]]
    return table.made(make, table.number(named[0], rate_unit), **tolerance)


def _finish_charge(table: _Table) -> weldbead.FinishCharge:
    numbers = table.given({"exponent": "", "reference_rate": "mm/s"})
    charge = table.made(weldbead.FinishCharge, table.number("charge", "$"), **numbers)
    table.done()
    return charge


def _burn_limit(table: _Table) -> _BurnLimit:
    makers: dict[str, Callable[[_Table], _BurnLimit]] = {
        "force": lambda t: t.made(weldbead.ForceBurnLimit, t.number("burn_coefficient", "N/(mm/s)^(1/2)")),
        "power": lambda t: t.made(weldbead.PowerBurnLimit, t.number("burn_coefficient", "W/(mm/s)^(1/2)")),
        "malkin": _malkin,
    }
    limit = makers[table.text("kind", makers)](table)
    table.done()
    return limit


def _malkin(table: _Table) -> weldbead.MalkinBurnLimit:
    diameter = table.number("diameter", "mm")
    if not (table.has("u0") or table.has("B")):
        return table.made(weldbead.MalkinBurnLimit.published, diameter)
    numbers = table.number("u0", "J/mm^3"), table.number("B", "J/(mm^2 s^(1/2))"), diameter
    return table.made(weldbead.MalkinBurnLimit, *numbers)
