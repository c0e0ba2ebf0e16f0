"""Conversion of sections and scans to labelled arrays and back."""

import json
from collections.abc import Sequence

import numpy as np
import xarray as xr

from centering.roundness._profile import Profile
from centering.roundness._scan import PathScan
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats

_OF_PROFILE = ("circle", "origin")  # attributes of one profile, kept as lists
_NAMES = "names"  # attribute of all
_NUMBERS = {"sample": "section_of_sample", "measured": "section_of_measured"}
_LABELS = {
    "angle": ("rad", "spindle angle"),
    "height": ("mm", "height of the reading"),
    "reading": ("mm", "radial position of the contact"),
}


def of_sections(profiles: Sequence[Profile], heights: Floats, names: tuple[str, ...]) -> xr.Dataset:
    """Samples of all sections and the residuals of their last steps, with the number of each section."""
    parts = [profile.dataset for profile in profiles]
    whole = xr.Dataset({"height": ("section", heights, _label("height"))})
    for dim, number in _NUMBERS.items():
        sizes = [part.sizes.get(dim, 0) for part in parts]
        if any(sizes):
            whole[number] = (dim, np.repeat(np.arange(len(parts)), sizes), {"long_name": "section"})
    for name, one in {str(name): part[name] for part in parts for name in part.data_vars}.items():
        dim = str(one.dims[0])
        whole[name] = (dim, np.concatenate([_held(part, name, dim) for part in parts]), one.attrs)
    lists = {key: json.dumps([part.attrs[key] for part in parts]) for key in _OF_PROFILE}
    return whole.assign_attrs(parts[0].attrs | lists | {_NAMES: json.dumps(names)})


def names_of(data: xr.Dataset) -> tuple[str, ...]:
    """Names of the sections of a file."""
    return tuple(json.loads(data.attrs.get(_NAMES, "[]")))


def profiles_of(data: xr.Dataset) -> list[Profile]:
    """Profiles of the sections of a file."""
    lists = {key: json.loads(data.attrs[key]) for key in _OF_PROFILE}
    found = []
    for k in range(data.sizes["section"]):
        kept = {dim: data[number].values == k for dim, number in _NUMBERS.items() if number in data}
        part = data.drop_vars("height").isel({dim: np.flatnonzero(each) for dim, each in kept.items()})
        missing = [
            name for name in ("residuals", "deviation_sd") if name in part and part[name].isnull().all()
        ]
        own = {key: each[k] for key, each in lists.items()}
        found.append(Profile.restored(part.drop_vars(missing).assign_attrs(own)))
    return found


def of_scan(scan: PathScan) -> xr.Dataset:
    """Readings along any path."""
    columns = {name: ("sample", getattr(scan, name), _label(name)) for name in _LABELS}
    attrs = {"tip_radius": scan.tip_radius, "tip_radius_unit": "mm", "internal": int(scan.internal)}
    return xr.Dataset(columns, attrs=attrs)


def scan_from(data: xr.Dataset) -> PathScan:
    """Readings of a file."""
    angle, height, reading = (lasting(data[name].values) for name in _LABELS)
    return PathScan(angle, height, reading, float(data.attrs["tip_radius"]), bool(data.attrs["internal"]))


def _held(part: xr.Dataset, name: str, dim: str) -> Floats:
    """Values of a section; NaN where it has none."""
    return np.asarray(part[name].values if name in part else np.full(part.sizes.get(dim, 0), np.nan))


def _label(name: str) -> dict[str, str]:
    unit, words = _LABELS[name]
    return {"units": unit, "long_name": words}
