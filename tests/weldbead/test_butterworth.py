"""Low-passes of the force sensor are those of SciPy, whose import takes long, to the bit."""

import numpy as np
import pytest
import scipy.signal

from sdpgrind.weldbead.force import _butterworth as butterworth


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_filters_are_those_of_scipy(order):
    rng = np.random.default_rng(order)
    for cutoff, share in zip(np.exp(rng.uniform(0, 9, 100)), rng.uniform(0.01, 0.99, 100), strict=True):
        sample_time = share * np.pi / cutoff
        for made, known in (
            (butterworth.analogue(order, cutoff), scipy.signal.butter(order, cutoff, analog=True)),
            (
                butterworth.digital(order, cutoff, sample_time),
                scipy.signal.butter(order, cutoff, fs=2 * np.pi / sample_time),
            ),
        ):
            assert [each.tolist() for each in made] == [each.tolist() for each in known]
