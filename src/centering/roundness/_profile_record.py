"""A profile as labelled arrays, and back."""

from typing import TYPE_CHECKING

import xarray as xr

from centering.roundness._origin import Made
from sdpgrind.base import stored

if TYPE_CHECKING:
    from centering.roundness._profile import Profile

_COLUMNS = {
    "angle": ("rad", "spindle angle"),
    "reading": ("mm", "radial position of the contact"),
    "part_angle": ("rad", "angle about the part's centre"),
    "deviation": ("mm", "deviation from the part's circle"),
}


def dataset_of(profile: "Profile") -> xr.Dataset:
    """Samples and what is left of them, with units; circle and origin as JSON."""
    columns = {name: ("sample", getattr(profile, name), _label(*told)) for name, told in _COLUMNS.items()}
    if profile._left is not None:
        columns["residuals"] = ("measured", profile._left, _label("mm", "what the last step left of each reading"))
    if profile._sd is not None:
        columns["deviation_sd"] = ("sample", profile._sd, _label("mm", "sd of the deviation"))
    told = {"tip_radius": profile.tip_radius, "tip_radius_unit": "mm", "internal": int(profile.internal)}
    return xr.Dataset(columns, attrs=told | {"circle": stored.encode(profile.circle), "origin": stored.encode(profile._origin)})


def made_from(data: xr.Dataset) -> Made:
    """What a profile is made from again."""
    circle, origin = (stored.decode(data.attrs[name]) for name in ("circle", "origin"))
    left, sd = (data[name].values if name in data else None for name in ("residuals", "deviation_sd"))
    tip_radius, internal = float(data.attrs["tip_radius"]), bool(data.attrs.get("internal", 0))
    return Made(data["angle"].values, data["reading"].values, tip_radius, circle, origin, left, internal, sd)


def _label(unit: str, name: str) -> dict[str, str]:
    return {"units": unit, "long_name": name}
