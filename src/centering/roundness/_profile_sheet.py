"""Page of a profile: four reference circles, limits kept or not, largest undulations."""

import os
from collections.abc import Mapping
from typing import Any

from centering.roundness._roundness import Roundness
from sdpgrind.base import checks
from sdpgrind.base.by_name import called
from sdpgrind.base.quantities import another_unit
from sdpgrind.base.sheets.amounts import Amounts, Interval
from sdpgrind.base.sheets.blocks import AmountTable, Block, Heading, Listing, Picture, Sentences
from sdpgrind.base.units import UM

_CIRCLES = ("LSC", "MZC", "MCC", "MIC")
_FORM = {"RONt": "value", "RONp": "ron_p", "RONv": "ron_v", "RONq": "ron_q"}  # source: ISO 12181-1
_LARGEST = 8  # undulations in a table; chosen: the others are below them
_USUAL, _TYPICAL = (1e-6, 0.5), 0.003  # mm; chosen: limits of roundness, from a gauge's ball to a forged ring
_SURE = 2.0  # standard deviations; source: coverage factor of a 95 % interval


def report(profile: Any, path: str | os.PathLike[str] | None, limits: Mapping[str, float] | None) -> str:
    """Write the page of a profile, or return its text."""
    given = {
        checks.one_of("limits", name, _FORM): _limit(name, each) for name, each in (limits or {}).items()
    }
    form = profile.roundness("LSC")
    more: list[Block] = [_circles(profile), _undulations(profile), Picture("LSC", form.plot)]
    if given:
        more.insert(0, Sentences([_verdict(form, name, limit) for name, limit in given.items()], strong=True))
    if (source := profile.source) is not None:
        more += [Heading("Source of the data"), Listing(str(source))]
    return str(called("sdpgrind.base.sheets.record_page:report", profile, path, tuple(more)))


def _limit(name: str, given: float) -> float:
    """Limit in mm; one in micrometres is refused."""
    limit = checks.positive(f"limits[{name!r}]", given, "mm")
    if not _USUAL[0] <= limit <= _USUAL[1]:
        raise ValueError(another_unit(f"limits[{name!r}]", limit, "mm", _USUAL, _TYPICAL))
    return limit


def _verdict(form: Roundness, name: str, limit: float) -> str:
    """Sentence on a limit; RONt has an interval, so it may be undecided."""
    value, sd = getattr(form, _FORM[name]), form.value_sd if name == "RONt" else None
    half = 0.0 if sd is None else _SURE * sd
    known = f" ± {UM * half:.2g}" if half else ""
    found = "kept" if value + half <= limit else "exceeded" if value - half > limit else "not decided"
    return f"{name} (LSC) {UM * value:.4g}{known} µm, limit {UM * limit:.4g} µm: {found}"


def _circles(profile: Any) -> AmountTable:
    columns: dict[str, list[Any]] = {name: [] for name in ("circle", *_FORM)}
    for kind in _CIRCLES:
        try:
            found = profile.roundness(kind)
        except ValueError:  # no such circle about this profile
            continue
        sd = found.value_sd
        columns["circle"].append(kind)
        columns["RONt"].append(found.value if sd is None else Interval(found.value, _SURE * sd))
        for name, field in list(_FORM.items())[1:]:
            columns[name].append(getattr(found, field))
    amounts = [Amounts.of(name, values, "mm" if name != "circle" else "") for name, values in columns.items()]
    return AmountTable("Roundness about each reference circle (interval: noise of the readings)", amounts)


def _undulations(profile: Any) -> AmountTable:
    largest = profile.spectrum().largest(_LARGEST)
    columns = (
        Amounts.of("upr", [int(upr) for upr, _ in largest], heading="undulations per revolution"),
        Amounts.of("amplitude", [amplitude for _, amplitude in largest], "mm"),
    )
    return AmountTable("Largest undulations", columns)
