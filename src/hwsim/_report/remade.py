"""Plan and log of a page made again, from the data in it and nothing else."""

import contextlib
import json
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType
from typing import Any

from hwsim._log.fingerprint import fingerprint
from hwsim._report.again import PLAN
from hwsim._report.job import JOB, made_again
from sdpgrind.base import stored
from sdpgrind.base.sheets.record_page import arrays_digest

PAGE = "report.html"
"""Name of the page in a folder."""
# Kind of a plan -> package with ``plan(problem)``; a table, since a page must not name code to import
_PACKAGES = {
    "centering.strategy": "centering",
    "finishing.motion": "sdpgrind.finishing",
    "locus.curve": "sdpgrind.locus",
    "plunge.cycle": "sdpgrind.plunge",
    "weldbead.sequence": "sdpgrind.weldbead",
}


_MEASURED = {
    "centering.cylinder": "a sheet of a measured cylinder",
    "centering.profile": "a measured profile",
    "centering.roundness": "a sheet of a measured ring",
    "centering.sections": "a page of measured sections",
    "centering.separation": "a page of measured profiles",
    "identify.doubts": "a page of doubts on measured data",
}


def refuse_unable(data: Mapping[str, Any]) -> None:
    """Refuse a page from which nothing can be made again, with the reason."""
    if reason := _of_log(data[JOB]) if JOB in data else _of_plan(data):
        raise ValueError(f"--rerun needs a page that holds its whole job; {reason}")


def _of_plan(data: Mapping[str, Any]) -> str:
    if PLAN not in data:
        return "this one holds neither a run nor a plan"
    if (kind := data[PLAN]["kind"]) not in _PACKAGES:
        told = _MEASURED.get(kind)
        return f"{told} cannot be made again" if told else f"this one is of a plan of its own kind, {kind}"
    return "" if "problem" in data else "the problem of this one holds functions of its own"


def _of_log(job: Mapping[str, Any]) -> str:
    """Reason why a log cannot be made again; "": it can, if need be with a plan made again."""
    if job["command"] is not None:
        return ""
    plant = job["plant"]
    if plant is None or plant["fingerprint"] is None:
        return "the log of this one was read from a file"
    if plant["made_of"] is None:
        return f"the {plant['name']} of this one holds functions or a class of your own"
    if job["seed"] is None:
        return "the seed of this one was a generator, not a whole number"
    several = job.get("controllers", {})
    learning = job.get("adaptations", {})
    for told in (*(several.values() or [job["controller"]]), *learning.values(), job["adapt"]):
        if told is not None and told["made_of"] is None and job["plan"] is None:
            return (
                f"the {told['name']} of this one cannot be told by values, and no plan was reported with it"
            )
    return ""


def make(data: Mapping[str, Any], folder: Path) -> None:
    """Make plan, log and page again in a folder.

    Raises
    ------
    ValueError
        When the plan, a controller or an adaptation cannot be made again from what the page holds.
    """
    problem = stored.decode(json.dumps(data["problem"])) if "problem" in data else None
    job = data.get(JOB)
    plan = _planned(data[PLAN] if job is None else job["plan"], problem)
    if plan is not None:
        plan.save(folder / "plan.nc")
    if job is None:
        plan.report(folder / PAGE)
        return
    log = _run(job, plan, problem)
    log.save(folder / "run.nc")
    log.report(folder / PAGE, plan=plan, problem=problem)


def _planned(told: Mapping[str, Any] | None, problem: Any) -> Any:
    """The plan solved again with the options of the page.

    Where the page holds none, as of a plan from a file, those may have been the defaults: the plan counts if
    it is equal.
    """
    if told is None or problem is None or told["kind"] not in _PACKAGES:
        return None
    package: Any = import_module(_PACKAGES[told["kind"]])
    if (options := told.get("options")) is not None:
        given = {name: stored.decode(json.dumps(value)) for name, value in options.items()}
        return package.plan(problem, **given)
    plan = package.plan(problem, **({"method": told["method"]} if told.get("method") else {}))
    if _changed(plan, told):
        raise ValueError(
            "the plan of this page cannot be made again: it was solved with options that the page does not"
            " hold, or by another version; report the plan as plan(...) returned it, not one from a file"
        )
    return plan


def _changed(plan: Any, told: Mapping[str, Any]) -> bool:
    """Whether a plan differs from that of the page."""
    return bool(arrays_digest(plan.dataset) != told["arrays"])


def _run(job: Mapping[str, Any], plan: Any, problem: Any) -> Any:
    from hwsim._loop.compare import compare
    from hwsim._loop.loop import run

    package = None if plan is None else import_module(_PACKAGES[job["plan"]["kind"]])
    changed = plan is not None and _changed(plan, job["plan"])

    def follower(told: Mapping[str, Any]) -> Any:
        ways = [lambda of=of: _public(package, told["name"])(of) for of in (plan, problem)]
        return _same(told, ways, changed, plan)

    def learner(told: Mapping[str, Any]) -> Any:
        named = _public(package, told["name"])
        learns = [lambda: _public(package, "adaptation")(problem), named, lambda: named(problem)]
        return _same(told, learns, changed, plan)

    drawn = {"parts": job["parts"], "rng": job["seed"]}
    plant = made_again(job["plant"]["made_of"])
    if several := job.get("controllers"):
        followers = {name: follower(told) for name, told in several.items()}
        learning = {name: learner(told) for name, told in job.get("adaptations", {}).items()}
        return compare(plant, followers, adapt=learning or None, **drawn)
    adapt = None if job["adapt"] is None else learner(job["adapt"])
    return run(plant, follower(job["controller"]), adapt=adapt, **drawn)


def _public(package: ModuleType | None, name: str) -> Any:
    """What a package, or one of its public sub-packages, has by a name; None: neither has it."""
    if package is None:
        return None
    within = [each.name for each in iter_modules(package.__path__) if not each.name.startswith("_")]
    places = [package, *(import_module(f"{package.__name__}.{each}") for each in within)]
    return next((getattr(one, name) for one in places if name in getattr(one, "__all__", ())), None)


def _same(told: Mapping[str, Any], ways: Sequence[Callable[[], Any]], changed: bool, plan: Any) -> Any:
    """The object of the page, of its fingerprint: of its values, else made in a usual way."""
    if told["made_of"] is not None:
        ways = [lambda: made_again(told["made_of"], plan)]
    for make_it in ways:
        with contextlib.suppress(Exception):  # not the way that this class is made
            if fingerprint(thing := make_it()) == told["fingerprint"]:
                return thing
    if changed:
        raise ValueError(
            f"the {told['name']} of this page cannot be made again: the plan comes out differently here"
        )
    raise ValueError(
        f"--rerun needs a {told['name']} that is made of the plan or the problem of the page alone; the one"
        " of this page was made with more"
    )
