"""Conversion of a profile to labelled arrays and back."""

import xarray as xr

from centering.roundness._origin import Made
from centering.roundness._part_readings import PartReadings
from sdpgrind.base import stored
from sdpgrind.base.checks import Floats

_COLUMNS = {
    "angle": ("rad", "spindle angle"),
    "reading": ("mm", "radial position of the contact"),
    "part_angle": ("rad", "angle about the part's centre"),
    "deviation": ("mm", "deviation from the part's circle"),
}


def dataset_of(profile: PartReadings, left: Floats | None, sd: Floats | None) -> xr.Dataset:
    """Samples and residuals with units; circle and origin as JSON."""
    columns = {name: ("sample", getattr(profile, name), _label(*label)) for name, label in _COLUMNS.items()}
    if left is not None:
        columns["residuals"] = ("measured", left, _label("mm", "what the last step left of each reading"))
    if sd is not None:
        columns["deviation_sd"] = ("sample", sd, _label("mm", "sd of the deviation"))
    scalars = {"tip_radius": profile.tip_radius, "tip_radius_unit": "mm", "internal": int(profile.internal)}
    return xr.Dataset(
        columns,
        attrs=scalars | {"circle": stored.encode(profile.circle), "origin": stored.encode(profile._origin)},
    )


def made_from(data: xr.Dataset) -> Made:
    """Samples and origin of a stored profile."""
    circle, origin = (stored.decode(data.attrs[name]) for name in ("circle", "origin"))
    left, sd = (data[name].values if name in data else None for name in ("residuals", "deviation_sd"))
    tip_radius, internal = float(data.attrs["tip_radius"]), bool(data.attrs.get("internal", 0))
    return Made(data["angle"].values, data["reading"].values, tip_radius, circle, origin, left, internal, sd)


def _label(unit: str, name: str) -> dict[str, str]:
    return {"units": unit, "long_name": name}
