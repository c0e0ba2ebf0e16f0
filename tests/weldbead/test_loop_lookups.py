"""Look-ups of the force loop against NumPy's, to the bit."""

import numpy as np

from sdpgrind.weldbead.force._reference import ForceReference


def test_a_plan_is_looked_up_as_numpy_interpolates():
    rng = np.random.default_rng(0)
    time, place = (np.cumsum(rng.uniform(0.01, 0.3, 60)) for _ in range(2))
    force, height = rng.uniform(0, 40, 60), rng.uniform(8, 10, 60)
    reference = ForceReference.arrays(time, force, height, 50.0, place)
    for t in [*rng.uniform(time[0] - 1, time[-1] + 1, 500), *time]:
        expected = np.interp(t, time, force, left=0.0, right=0.0), np.interp(t, time, height)
        assert reference.at(t) == expected
    for x in [*rng.uniform(place[0], place[-1], 500), *place]:
        assert reference.when(x) == np.interp(x, place, time)
