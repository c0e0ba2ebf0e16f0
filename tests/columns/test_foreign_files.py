"""Files of other styles, each by the call at first try: right to 1e-6, or refused with the reason."""

import numpy as np
import pytest
from foreign_binaries import BINARIES, PROFILES
from foreign_machines import MACHINES
from foreign_texts import TEXTS

import hwsim
from centering import Profile

SERIES = TEXTS | MACHINES | BINARIES


def _held(found, truth):
    for name, values in truth.items():
        np.testing.assert_allclose(found(name), values, rtol=1e-6, atol=1e-12, err_msg=name)


def _refused(door, foreign):
    with pytest.raises(ValueError, match=foreign.truth) as told:
        door(foreign.data, **foreign.call)
    assert "\n" not in str(told.value)


@pytest.mark.filterwarnings("ignore:.*has no reading")
@pytest.mark.parametrize("style", SERIES)
def test_series(style, tmp_path):
    foreign = SERIES[style](tmp_path)
    if isinstance(foreign.truth, str):
        _refused(hwsim.Log.read, foreign)
    else:
        table = hwsim.Log.read(foreign.data, **foreign.call)["data"]
        _held(lambda name: table[name].values, foreign.truth)


@pytest.mark.filterwarnings("ignore:.*the file says")
@pytest.mark.parametrize("style", PROFILES)
def test_profile(style, tmp_path):
    foreign = PROFILES[style](tmp_path)
    if isinstance(foreign.truth, str):
        _refused(Profile.read, foreign)
    else:
        profile = Profile.read(foreign.data, **foreign.call)
        _held(lambda name: getattr(profile, name), foreign.truth)
