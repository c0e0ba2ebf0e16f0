"""The job in a page, by which it is checked and run again: digests, versions, controller, seed."""

import contextlib
import dataclasses
import json
from collections.abc import Mapping
from importlib import import_module
from itertools import takewhile
from typing import Any

import numpy as np

from hwsim._log.fingerprint import fingerprint
from sdpgrind.base.plans import Plan
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable
from sdpgrind.base.sheets.origin import versions
from sdpgrind.base.sheets.record_page import arrays_digest, solved_of
from sdpgrind.base.stored import decode, encode

JOB = "job"
"""Name of the data of a job in a page."""
_CLASS, _KIND = "class", "kind of plan"  # keys of the address of a class, and of a plan in a controller
_OURS = ("sdpgrind", "centering", "hwsim")


def job_of(log: Any, plan: Any, command: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the job of a log as plain values; `command`: the command line, its file and options.

    ``plant`` and ``controller`` hold name, fingerprint and ``made_of``, which `made_again` reads (None: it
    holds a function); of a log read from a file they hold names only. ``controllers`` holds the same for each
    name of a comparison, else nothing, and ``adaptations`` for those that learn. ``log`` holds a SHA-256 of
    each table.
    """
    made = log.made_of or {}
    attrs = log.outcome.attrs
    return {
        "versions": versions(),
        "command": None if command is None else dict(command),
        "seed": _seed(made.get("rng", (command or {}).get("rng"))),
        "parts": len(log),
        "plant": _told(made.get("plant"), attrs.get("plant")),
        "controller": _told(made.get("controller"), attrs.get("controller")),
        "controllers": {name: _told(each, None) for name, each in made.get("controllers", {}).items()},
        "adapt": _told(made.get("adapt"), None),
        "adaptations": {name: _told(each, None) for name, each in made.get("adaptations", {}).items()},
        "plan": None if not hasattr(plan, "dataset") else solved_of(plan, plan.dataset),
        "log": {tier: arrays_digest(log[tier]) for tier in log.tiers}
        | {"outcome": arrays_digest(log.outcome)},
    }


def _seed(rng: Any) -> int | None:
    return int(rng) if isinstance(rng, int | np.integer) else None


def _told(thing: Any, name: Any) -> dict[str, Any] | None:
    if thing is None:
        return None if name is None else {"name": str(name), "fingerprint": None, "made_of": None}
    found = {"name": type(thing).__name__, "fingerprint": None, "made_of": None}
    with contextlib.suppress(Exception):  # of a user's own class, which may hold a socket: the page is made
        found["fingerprint"] = fingerprint(thing)
    with contextlib.suppress(TypeError):  # a field holds a function, or a state
        found["made_of"] = _plain(thing)
    return found


def _plain(thing: Any) -> Any:
    """A value for JSON, which `made_again` reads: as files store it, else class and fields of a dataclass.

    Of a plan its kind alone: it is solved again.
    """
    if isinstance(thing, Plan):
        return {_KIND: thing.kind}
    try:
        return json.loads(encode(thing))
    except TypeError:
        if not dataclasses.is_dataclass(thing):
            raise
    named = {field.name: getattr(thing, field.name) for field in dataclasses.fields(thing) if field.init}
    return {_CLASS: _address(type(thing)), "fields": {name: _plain(value) for name, value in named.items()}}


def _address(cls: type) -> str:
    """Public package and name of a class: the package above its first private name, or ``hwsim``."""
    public = ".".join(takewhile(lambda name: not name.startswith("_"), cls.__module__.split(".")))
    machines = getattr(import_module("hwsim"), cls.__name__, None) is cls
    return f"{'hwsim' if machines else public}:{cls.__name__}"


def made_again(plain: Any, plan: Any = None) -> Any:
    """Return the object of ``made_of`` with its `plan`: only public dataclasses of the library are made.

    Raises
    ------
    ValueError
        When the data name something else.
    """
    if isinstance(plain, dict) and _KIND in plain:
        if plan is None or plan.kind != plain[_KIND]:
            raise ValueError(f"the job must be reported with the plan of its controller, a {plain[_KIND]}")
        return plan
    if not isinstance(plain, dict) or _CLASS not in plain:
        return decode(json.dumps(plain))
    package, _, name = str(plain[_CLASS]).partition(":")
    found = getattr(import_module(package), name, None) if package.split(".")[0] in _OURS else None
    if not (isinstance(found, type) and dataclasses.is_dataclass(found)):
        raise ValueError(f"the job must be of classes of this library; got {plain[_CLASS]!r}")
    return found(**{field: made_again(value, plan) for field, value in plain["fields"].items()})


def digests_table(job: Mapping[str, Any]) -> AmountTable:
    """Return the table of seed and digests."""
    seed = "not known" if job["seed"] is None else str(job["seed"])
    rows = [Amounts.of("seed", [seed]), Amounts.of("parts", [str(job["parts"])])]
    known = {name: job[name] for name in ("plant", "controller", "adapt") if job[name] is not None}
    known |= {f"controller {name!r},": told for name, told in job["controllers"].items()}
    known |= {f"adapt of {name!r},": told for name, told in job["adaptations"].items()}
    rows += [Amounts.of(f"{n} {x['name']}", [x["fingerprint"]]) for n, x in known.items() if x["fingerprint"]]
    if job["plan"] is not None:
        rows.append(Amounts.of(f"plan {job['plan']['kind']}", [job["plan"]["arrays"]]))
    rows += [Amounts.of(f"log, {name}", [digest]) for name, digest in job["log"].items()]
    return AmountTable("Seed and SHA-256 digests", rows, ("what", "is"))
