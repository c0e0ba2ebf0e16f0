"""A weld-bead job as a TOML file: the planning problem, and the stand on which it is tried.

Keys are the names of the Python interface; numbers are in the library's units (mm, s, N, J, W, rad, $) or texts with a
unit. Every fault is one line that names the key.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from hwsim.command._quantities import quantity
from hwsim.command._toml import Table
from hwsim.command._toml import read as read_toml
from hwsim.command._weldbead import _weldbead_jobs as jobs
from hwsim.command._weldbead._weldbead_stand_toml import job_of
from sdpgrind import sdp, weldbead
from sdpgrind.base.quantities import units_of

_BurnLimit: TypeAlias = weldbead.ForceBurnLimit | weldbead.PowerBurnLimit | weldbead.MalkinBurnLimit


def read(path: Path, *, simple: bool = False) -> jobs.Job:
    """Read the job in the file at `path`; ValueError names the file and the key."""
    one_draw, three_tiers = read_toml(path, lambda table: job_of(_problem(table), table, read_scatter))
    return one_draw if simple else three_tiers


def _problem(job: Table) -> weldbead.SequenceProblem:
    return weldbead.SequenceProblem(
        job.table("process").one(weldbead.GrindingProcess),
        **job.values(weldbead.SequenceProblem),
        durations=job.list_of("durations", units_of(weldbead.SequenceProblem)["durations"]),
        scatter=read_scatter(job.table("scatter")),
        burn_limit=_burn_limit(job.table("burn_limit")) if job.has("burn_limit") else None,
        height_charge=_height_charge(job.table("height_charge")),
        lateness_charge=_one_sided(job.table("lateness_charge"), "s") if job.has("lateness_charge") else None,
        finish_charge=job.table("finish_charge").one(weldbead.FinishCharge) if job.has("finish_charge") else None,
    )


def read_scatter(table: Table) -> weldbead.Scatter:
    names, relative = table.take("attribution"), table.take("relative_sd")
    several = isinstance(names, list)
    sds = relative if isinstance(relative, list) else [relative]
    numbers = tuple(quantity(table.path("relative_sd"), value, "") for value in sds)
    options = table.values(weldbead.Scatter)
    if table.has("sample"):
        options["sample"] = tuple(quantity(table.path("sample"), value, "") for value in table.take("sample"))
    table.done()
    return table.made(weldbead.Scatter, tuple(names) if several else names, numbers if several else numbers[0], **options)


def _height_charge(table: Table) -> sdp.Charge:
    sides = {side: _one_sided(table.table(side), "mm") for side in ("under", "over") if table.has(side)}
    table.done()
    return table.made(sdp.Charge, **sides)


def _one_sided(table: Table, unit: str) -> sdp.OneSided:
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


def _burn_limit(table: Table) -> _BurnLimit:
    makers: dict[str, Callable[[Table], _BurnLimit]] = {
        "force": lambda t: t.one(weldbead.ForceBurnLimit),
        "power": lambda t: t.one(weldbead.PowerBurnLimit),
        "malkin": _malkin,
    }
    limit = makers[table.text("kind", makers)](table)
    table.done()
    return limit


def _malkin(table: Table) -> weldbead.MalkinBurnLimit:
    if table.has("u0") or table.has("B"):
        return table.one(weldbead.MalkinBurnLimit)
    return table.made(weldbead.MalkinBurnLimit.published, **table.values(weldbead.MalkinBurnLimit, skip=("u0", "B")))
