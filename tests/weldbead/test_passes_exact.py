"""The bead clipped as a polyline: conserved to rounding, of the order of the steps alone, the same physics as
at nodes.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind import units, weldbead
from sdpgrind.weldbead import passes

PROCESS = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
DISC = passes.TiltedDisc(PROCESS, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
RADIUS, ANGLE, WIDTH, FEED = 88.9, units.deg(20), 12.7, 20.0
XS = np.linspace(0, 150, 3001)
SMOOTH = passes.Contour(XS, 3 + 0.2 * np.sin(2 * np.pi * XS / 20))


def smooth_pass(spacing, exact=True, order=2):
    """The pass of 7 s of the nodal tests."""
    x = 5 + spacing * np.arange(round(140 / spacing) + 1)
    time = (x - 5) / FEED
    tip = np.where(time < 0.5, 3.5 - 1.0 * (1 - np.cos(np.pi * time / 0.5)), 1.5)
    way = {"center_x": x + RADIUS * np.cos(ANGLE), "fly_height": tip + RADIUS * np.sin(ANGLE)}
    return passes.simulate(DISC, SMOOTH, **way, feed_rate=FEED, order=order, exact=exact)


def gone(before, after):
    """Volume between two polylines."""
    x = np.union1d(before.x, after.x)
    return WIDTH * np.trapezoid(before.at(x) - after.at(x), x)


@pytest.fixture(scope="module")
def fine():
    return smooth_pass(0.00625)


def test_volume_is_conserved_and_that_of_the_reference(fine):
    assert gone(SMOOTH, fine.contour) == pytest.approx(fine.volume, rel=1e-12)
    # a stiff differential equation; its rounding, and the polyline
    assert fine.volume == pytest.approx(634.8198, rel=2e-6)
    assert np.trapezoid(fine.removal_rate, fine.time) == pytest.approx(fine.volume, rel=1e-7)


@pytest.mark.parametrize(("order", "least"), [(1, 0.95), (2, 1.85)])
def test_order_is_that_of_the_steps(fine, order, least):
    spacings, at = np.array([0.2, 0.1, 0.05, 0.025]), XS[(XS > 9) & (XS < 140)]
    after = [smooth_pass(spacing, order=order).contour.at(at) for spacing in spacings]
    errors = [np.sqrt(np.mean((z - fine.contour.at(at)) ** 2)) for z in after]
    assert np.polyfit(np.log(spacings), np.log(errors), 1)[0] >= least
    if order == 2:
        nodal = smooth_pass(0.05, exact=False).contour.at(at)
        assert errors[2] < np.sqrt(np.mean((nodal - fine.contour.at(at)) ** 2))


def test_the_nodes_converge_to_it(fine):
    nodal = smooth_pass(0.00625, exact=False)
    at = XS[(XS > 9) & (XS < 140)]
    np.testing.assert_allclose(nodal.contour.at(at), fine.contour.at(at), atol=2e-5)
    np.testing.assert_allclose(nodal.normal_force[2000:], fine.normal_force[2000:], atol=0.05)


def test_three_patches():
    x = np.linspace(0, 60, 6001)
    ridges = passes.Contour(
        x, 1 + 0.6 * np.exp(-(((x - 25) / 0.35) ** 2)) + 0.9 * np.exp(-(((x - 26.8) / 0.35) ** 2))
    )
    center = 77.0 + 0.02 * np.arange(2600)
    way = {
        "center_x": center,
        "fly_height": np.full(center.size, 0.3 + RADIUS * np.sin(ANGLE)),
        "feed_rate": FEED,
    }
    exact, nodal = (passes.simulate(DISC, ridges, **way, exact=choice) for choice in (True, False))
    assert exact.patches.max() == 3
    assert gone(ridges, exact.contour) == pytest.approx(exact.volume, rel=1e-12)
    assert exact.volume == pytest.approx(nodal.volume, rel=2e-4)
    assert exact.normal_force.max() == pytest.approx(nodal.normal_force.max(), rel=2e-3)


@settings(max_examples=25, deadline=None)
@given(
    heights=st.lists(st.floats(0.3, 2.0), min_size=3, max_size=12),
    depth=st.floats(-0.2, 0.5),
    wave=st.floats(0.0, 0.3),
    length=st.floats(3.0, 30.0),
)
def test_any_bead_is_only_cut(heights, depth, wave, length):
    """No metal is added, none is lost from the sum, and the disc is never deeper than its tip was."""
    bead = passes.Contour(np.linspace(0, 40, len(heights)), heights)
    center = RADIUS * np.cos(ANGLE) - 8.0 + 0.05 * np.arange(1060)
    height = 1.0 - depth + wave * np.sin(2 * np.pi * center / length) + RADIUS * np.sin(ANGLE)
    height += 4.0 * np.exp(-((center - center[0]) / 2.0))  # it comes from above
    record = passes.simulate(DISC, bead, center_x=center, fly_height=height, feed_rate=10.0, exact=True)
    x = np.union1d(bead.x, record.contour.x)
    assert np.all(record.contour.at(x) <= bead.at(x) + 1e-12)
    assert gone(bead, record.contour) == pytest.approx(record.volume, rel=1e-9, abs=1e-7)
    assert np.all(np.diff(record.contour.x) > 0)
    assert min(record.contour.z) >= min(min(heights), record.tip_z.min()) - 1e-12


def test_a_steady_cut_has_its_force():
    force = float(PROCESS.normal_force(0.3, FEED))
    center = 75.0 + 0.05 * np.arange(2400)
    height = np.full(center.size, 0.7 + RADIUS * np.sin(ANGLE - force * RADIUS / 6e5))
    flat = passes.Contour([0, 100], [1, 1])
    record = passes.simulate(DISC, flat, center_x=center, fly_height=height, feed_rate=FEED, exact=True)
    middle = (record.tip_x > 60) & (record.tip_x < 90)
    np.testing.assert_allclose(record.normal_force[middle], force, rtol=1e-9)


def test_what_it_refuses():
    x = 77.0 + 0.05 * np.arange(100)
    flat = passes.Contour([0, 50], [1, 1])
    way = {"center_x": x, "feed_rate": FEED, "exact": True}
    with pytest.raises(ValueError, match=r"the disc must start clear of the bead \(mm\)"):
        passes.simulate(DISC, flat, fly_height=np.full(x.size, 20.0), **way)
    with pytest.raises(ValueError, match="exact must be False where the width varies"):
        passes.simulate(DISC, flat, fly_height=np.full(x.size, 40.0), width=flat, **way)
    air = PROCESS.replace(free_speed=units.hz(50.0), speed_droop=0.0821)
    weak = passes.TiltedDisc(air, relaxed_angle=ANGLE, rotational_stiffness=6e5)
    deep = np.full(1200, 0.0 + RADIUS * np.sin(ANGLE))
    with pytest.raises(passes.GrinderStalled) as stalled:
        passes.simulate(
            weak, flat, center_x=78.0 + 0.05 * np.arange(1200), fly_height=deep, feed_rate=FEED, exact=True
        )
    with pytest.raises(passes.GrinderStalled) as nodal:
        passes.simulate(weak, flat, center_x=78.0 + 0.05 * np.arange(1200), fly_height=deep, feed_rate=FEED)
    assert stalled.value.time == pytest.approx(nodal.value.time, abs=0.01)
