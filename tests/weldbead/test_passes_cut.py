"""The cut of a tilted disc: conservation, order, an independent differential equation, closed forms, several
patches.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from sdpgrind import units, weldbead
from sdpgrind.weldbead import passes

PROCESS = weldbead.GrindingProcess(
    specific_energy=12.8,
    idle_power=114.0,
    friction_ratio=0.33,
    disk_radius=88.9,
    free_speed=500.0,
    speed_droop=0.0,
    bead_width=12.7,
)
DISC = passes.TiltedDisc(PROCESS, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
RADIUS, ANGLE, WIDTH, FEED = 88.9, units.deg(20), 12.7, 20.0


def wave(x):
    return 3 + 0.2 * np.sin(2 * np.pi * x / 20)


BEAD = passes.Contour(np.linspace(0, 150, 30_001), wave(np.linspace(0, 150, 30_001)))


def smooth_pass(spacing, order=2, disc=DISC, bead=BEAD):
    """The spec's pass of 7 s: the tip goes down by a half cosine in 0.5 s and stays there."""
    x = 5 + spacing * np.arange(round(140 / spacing) + 1)
    time = (x - 5) / FEED
    tip = np.where(time < 0.5, 3.5 - 1.0 * (1 - np.cos(np.pi * time / 0.5)), 1.5)
    return passes.simulate(
        disc,
        bead,
        center_x=x + RADIUS * np.cos(ANGLE),
        fly_height=tip + RADIUS * np.sin(ANGLE),
        feed_rate=FEED,
        order=order,
    )


@pytest.fixture(scope="module")
def fine():
    return smooth_pass(0.003125)


def test_volume_of_the_steps_is_that_of_the_contours():
    record = smooth_pass(0.05)
    x = np.array(record.contour.x)
    gone = WIDTH * np.trapezoid(wave(x) - np.array(record.contour.z), x)
    assert record.volume == pytest.approx(gone, rel=1e-10)


def test_each_step_removes_what_its_balance_asks_for():
    """The root is known to 1e-13 rad; there the excess falls by less than 3e4 mm^3/rad: 3e-9 mm^3.

    As the volume in the way falls by at most width x radius x length of contact with the angle: 12.7 x 89 x 20.
    """
    record = smooth_pass(0.05, order=1)
    asked = np.diff(record.time) * record.removal_rate[1:]
    cut = asked > 0.0
    assert cut.sum() > 2000
    np.testing.assert_allclose(record.removed[1:][cut], asked[cut], rtol=0, atol=3e-9)


def test_volume_is_the_integral_of_the_removal_rate_and_that_of_the_reference():
    record = smooth_pass(0.05)
    assert np.trapezoid(record.removal_rate, record.time) == pytest.approx(record.volume, rel=1e-5)
    # the stiff differential equation of the specification
    assert record.volume == pytest.approx(634.8198, rel=2e-5)


@pytest.mark.parametrize(("order", "least"), [(1, 0.95), (2, 1.8)])
def test_order_of_the_balance(fine, order, least):
    spacings, errors = np.array([0.1, 0.05, 0.025, 0.0125]), []
    for spacing in spacings:
        after = smooth_pass(spacing, order).contour
        x = np.array(after.x)
        # but for where it first touches
        x, z = x[np.abs(x - 8.3) > 0.5], np.array(after.z)[np.abs(x - 8.3) > 0.5]
        errors.append(np.sqrt(np.mean((z - fine.contour.at(x)) ** 2)))
    assert np.polyfit(np.log(spacings), np.log(errors), 1)[0] >= least
    assert errors[1] < (1e-4 if order == 2 else 3e-4)


def by_differential_equation(begin, end):
    """Angle (rad) of the disc against the place of its tip (mm): one patch, whose front is the face's
    crossing with the wave.
    """
    height = 1.5 + RADIUS * np.sin(ANGLE)

    def front(angle, tip):
        low = height - RADIUS * np.sin(angle)
        return brentq(lambda x: wave(x) - low - (x - tip) * np.tan(angle), tip, tip + 12.0, xtol=1e-13)

    def slope(time, state):
        angle = state[0]
        tip = 5 + FEED * time + RADIUS * (np.cos(ANGLE) - np.cos(angle))
        length = (front(angle, tip) - tip) / np.cos(angle)
        power = 500.0 * 0.33 * 6e5 * (ANGLE - angle) / 1000
        rate = (power - 114.0) / (12.8 * WIDTH * length)
        return [(rate - FEED * np.sin(angle)) / (RADIUS - length / 2)]

    times = np.linspace(begin, end, 2001)
    found = solve_ivp(slope, (begin, end), [ANGLE - 0.009], "Radau", times, rtol=1e-9, atol=1e-12)
    return found.t, found.y[0]


def test_against_a_stiff_differential_equation():
    # It forgets its start within some tenths of a second; then tip and force must be those of the balance.
    time, angle = by_differential_equation(1.0, 6.5)
    record = smooth_pass(0.05)
    later = time > 2.5
    tip_x = 5 + FEED * time + RADIUS * (np.cos(ANGLE) - np.cos(angle))
    tip_z = 1.5 + RADIUS * (np.sin(ANGLE) - np.sin(angle))
    error = np.interp(tip_x[later], record.tip_x, record.tip_z) - tip_z[later]
    assert np.sqrt(np.mean(error**2)) < 1e-4
    force = 6e5 * (ANGLE - angle) / RADIUS
    np.testing.assert_allclose(
        np.interp(time[later], record.time, record.normal_force), force[later], atol=0.05
    )


@pytest.mark.parametrize(("depth", "feed"), [(0.1, 30.0), (0.25, 20.0), (0.6, 8.0)])
def test_steady_cut_is_that_of_the_sequence(depth, feed):
    # Brown's (4.5): the force of a steady flat cut; the height that holds it is known in closed form.
    force = float(PROCESS.normal_force(depth, feed))
    angle = ANGLE - force * RADIUS / 6e5
    x = 80.0 + 0.05 * np.arange(2400)
    height = np.full(x.size, 1.0 - depth + RADIUS * np.sin(angle))
    record = passes.simulate(
        DISC, passes.Contour([0, 100], [1, 1]), center_x=x - 5, fly_height=height, feed_rate=feed
    )
    middle = (record.tip_x > 60) & (record.tip_x < 90)
    np.testing.assert_allclose(record.tip_z[middle], 1.0 - depth, atol=2e-4 * depth)
    np.testing.assert_allclose(record.normal_force[middle], force, rtol=2e-4)


def test_a_free_and_a_rubbing_disc():
    # So little overlap that the spring's torque stays below what the idle power takes: nothing is removed,
    # the disc rides.
    x = 75.0 + 0.05 * np.arange(1500)
    height = np.full(x.size, 0.98 + RADIUS * np.sin(ANGLE))
    record = passes.simulate(
        DISC, passes.Contour([0, 50], [1, 1]), center_x=x, fly_height=height, feed_rate=FEED
    )
    assert record.volume == 0.0
    assert np.all(record.contour.z == np.array(1.0))
    inside = (record.tip_x > 1) & (record.tip_x < 49)
    np.testing.assert_allclose(record.tip_z[inside], 1.0, atol=1e-9)  # exactly on the metal
    assert np.all(record.grinding_power[inside] < 114.0)
    assert np.all(record.normal_force[record.tip_x > 50.1] == 0.0)


def ridges():
    """Two narrow ridges on a flat bead: up to three patches at once."""
    x = np.linspace(0, 60, 6001)
    return passes.Contour(
        x, 1 + 0.6 * np.exp(-(((x - 25) / 0.35) ** 2)) + 0.9 * np.exp(-(((x - 26.8) / 0.35) ** 2))
    )


def test_three_patches():
    x = 77.0 + 0.02 * np.arange(2600)
    record = passes.simulate(
        DISC, ridges(), center_x=x, fly_height=np.full(x.size, 0.3 + RADIUS * np.sin(ANGLE)), feed_rate=FEED
    )
    assert record.patches.max() == 3
    nodes = np.array(record.contour.x)
    gone = WIDTH * np.trapezoid(ridges().at(nodes) - np.array(record.contour.z), nodes)
    assert record.volume == pytest.approx(gone, rel=1e-10)
    assert np.trapezoid(record.removal_rate, record.time) == pytest.approx(record.volume, rel=1e-3)


def test_lift_off_and_back():
    # The disc is raised clear in mid pass and lowered again: no force, no removal, then the cut goes on.
    x = 80.0 + 0.05 * np.arange(1800)
    lift = 1.5 * np.exp(-(((x - 120.0) / 4.0) ** 2))
    record = passes.simulate(
        DISC,
        passes.Contour([0, 80], [1, 1]),
        center_x=x,
        fly_height=0.6 + lift + RADIUS * np.sin(ANGLE),
        feed_rate=FEED,
    )
    clear = np.abs(record.center_x - 120.0) < 1.0
    assert np.all(record.normal_force[clear] == 0.0)
    assert np.all(record.removed >= 0.0)
    after = (record.tip_x > 60) & (record.tip_x < 72)
    before = (record.tip_x > 15) & (record.tip_x < 22)
    np.testing.assert_allclose(
        record.normal_force[after].mean(), record.normal_force[before].mean(), rtol=1e-3
    )


def test_past_the_power_peak_the_grinder_stalls():
    air = PROCESS.replace(free_speed=2 * np.pi * 50, speed_droop=0.0821, friction_ratio=0.3, disk_radius=85.0)
    disc = passes.TiltedDisc(air, relaxed_angle=ANGLE, rotational_stiffness=6e5)
    x = 74.5 + 0.05 * np.arange(1200)
    down = 1.0 - 3.0 * np.clip((x - 80) / 20, 0, 1) + 85.0 * np.sin(ANGLE)
    with pytest.raises(
        passes.GrinderStalled, match=r"the grinder stalls at .* s, tip at .* mm: .* 300.5 W"
    ) as stalled:
        passes.simulate(disc, passes.Contour([0, 50], [1, 1]), center_x=x, fly_height=down, feed_rate=FEED)
    assert stalled.value.power == pytest.approx(300.5, abs=0.05)
    assert 0 < stalled.value.time < 3 and 0 < stalled.value.position < 50


def test_tilt_is_a_control_as_good_as_height():
    # Turning the relaxed disc by a small angle lowers its tip by R cos(angle): at fixed height the same cut
    # but for the face.
    x = 80.0 + 0.05 * np.arange(1800)
    height = np.full(x.size, 1.0 + RADIUS * np.sin(ANGLE))
    more = np.full(x.size, ANGLE + 0.006)
    record = passes.simulate(
        DISC,
        passes.Contour([0, 80], [1, 1]),
        center_x=x,
        fly_height=height,
        relaxed_angle=more,
        feed_rate=FEED,
    )
    same = passes.simulate(
        DISC.replace(relaxed_angle=ANGLE + 0.006),
        passes.Contour([0, 80], [1, 1]),
        center_x=x,
        fly_height=height,
        feed_rate=FEED,
    )
    np.testing.assert_array_equal(record.contour.z, same.contour.z)
    assert record.volume > 100


def test_wear_of_a_pass():
    # Volume over G is what the disc loses, spread over a ring 2 pi R* l: the face recedes by w L
    # sin(angle)/(2 pi R* G).
    worn = DISC.replace(grinding_ratio=20.0)
    x = 80.0 + 0.05 * np.arange(3300)
    force = float(PROCESS.normal_force(0.25, FEED))
    height = np.full(x.size, 0.75 + RADIUS * np.sin(ANGLE - force * RADIUS / 6e5))
    bead = passes.Contour([0, 150], [1, 1])
    fresh, used = (
        passes.simulate(disc, bead, center_x=x, fly_height=height, feed_rate=FEED).tip_z
        for disc in (DISC, worn)
    )
    # At fixed height the spring follows: what its force gives way by does not show in the contour.
    expected = WIDTH * 147 * np.sin(ANGLE) / (2 * np.pi * RADIUS * 20)
    assert expected == pytest.approx(0.06, abs=0.005)
    rise = used[-500] - fresh[-500]
    static = DISC.linearize(0.25, FEED).static_stiffness / DISC.contact_stiffness
    assert rise == pytest.approx(expected * (1 - static), rel=0.1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"relaxed_angle": 20.0},
            r"relaxed_angle must be in \(0, 1.3\] \(rad\); units.deg\(20\) for degrees; got 20.0",
        ),
        ({"relaxed_angle": 0.0}, r"relaxed_angle must be in \(0, 1.3\] \(rad\); got 0.0"),
        ({"rotational_stiffness": -1.0}, r"rotational_stiffness must be > 0 \(N mm/rad\); got -1"),
        ({"rotational_stiffness": None}, "either rotational_stiffness .* or compliance must be given"),
        ({"specific_energy": 12.8e3}, r"specific_energy must be in J/mm\^3"),
        (
            {"idle_power": 300.0, "speed_droop": 0.2},
            r"idle_power must be below the .* W that the grinder may use, or it cannot",
        ),
        ({"grinding_ratio": 0.0}, "grinding_ratio must be > 0"),
    ],
)
def test_discs_that_are_none(change, message):
    with pytest.raises(ValueError, match=message):
        DISC.replace(**change)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ([(0.0, 1.0), (0.1, 6e4)], "compliance must begin at no wind-up and no torque"),
        ([(0.0, 0.0), (0.1, 6e4), (0.1, 7e4)], "compliance must increase in both columns"),
        ([(0.0, 0.0)], "compliance must be pairs of wind-up and torque"),
    ],
)
def test_compliances_that_are_none(table, message):
    with pytest.raises(ValueError, match=message):
        DISC.replace(rotational_stiffness=None, compliance=table)


def test_a_straight_table_is_a_spring():
    table = DISC.replace(rotational_stiffness=None, compliance=[(0.0, 0.0), (0.005, 3e3), (0.02, 1.2e4)])
    np.testing.assert_allclose(smooth_pass(0.1, disc=table).contour.z, smooth_pass(0.1).contour.z, atol=1e-10)


def test_simulations_that_are_none():
    bead = passes.Contour([0, 50], [1, 1])
    x = 83.5 + 0.05 * np.arange(100)
    with pytest.raises(
        ValueError, match=r"the disc must start clear of the bead \(mm\); its tip starts in metal"
    ):
        passes.simulate(DISC, bead, center_x=x, fly_height=np.full(100, 30.9), feed_rate=FEED)
    with pytest.raises(ValueError, match="center_x and fly_height must be of one length"):
        passes.simulate(DISC, bead, center_x=x, fly_height=[1.0], feed_rate=FEED)


def test_linear_facts():
    # Section 3.5 and erratum E7: stiffness at nominal values, pole by depth and feed.
    assert DISC.contact_stiffness == pytest.approx(75.92, rel=1e-4)
    nominal = weldbead.GrindingProcess(10.0, 100.0, 0.3, 85.0, 500.0, 0.0, 12.5)
    disc = passes.TiltedDisc(nominal, relaxed_angle=ANGLE, rotational_stiffness=6e5)
    assert disc.contact_stiffness == pytest.approx(83.04, rel=1e-4)
    for depth, feed, hertz in [
        (0.2, 30, 9.8),
        (0.4, 20, 3.6),
        (0.7, 20, 2.0),
        (0.1, 30, 19.7),
        (0.7, 4, 0.95),
    ]:
        assert disc.linearize(depth, feed).pole / units.hz(1) == pytest.approx(hertz, rel=0.02)


def test_guard_of_the_air_motor():
    air = weldbead.GrindingProcess(10.0, 100.0, 0.3, 85.0, 2 * np.pi * 50, 0.0821, 12.5)
    disc = passes.TiltedDisc(air, relaxed_angle=ANGLE, rotational_stiffness=6e5)
    assert disc.peak_power == pytest.approx(300.5, rel=1e-3)
    assert disc.guarded_force == pytest.approx(41.48, rel=1e-3)
    assert disc.guarded_speed == pytest.approx(227.3, rel=1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"relaxed_angle": [0.3] * 5},
            r"relaxed_angle must have one entry for each position, 400 \(rad\); got shape \(5,\)",
        ),
        ({"relaxed_angle": 0.3}, r"relaxed_angle must have one entry for each position, 400 \(rad\)"),
        ({"relaxed_angle": np.full(400, 20.0)}, r"relaxed_angle must be in \(0, 1.3\] \(rad\); got 20.0"),
        ({"spacing": -1.0}, r"spacing must be > 0 \(mm\); got -1.0"),
        ({"spacing": float("nan")}, r"spacing must be finite \(mm\)"),
        ({"order": 3}, "order must be 1 or 2; got 3"),
        ({"width": passes.Contour([0, 50], [-5.0, 5.0])}, r"width must be > 0 \(mm\); got -5.0"),
    ],
)
def test_options_that_are_none(change, message):
    x = 77.0 + 0.05 * np.arange(400)
    way = {"center_x": x, "fly_height": np.full(x.size, 0.6 + RADIUS * np.sin(ANGLE)), "feed_rate": FEED}
    with pytest.raises(ValueError, match=message):
        passes.simulate(DISC, passes.Contour([0, 50], [1, 1]), **(way | change))


def test_a_cut_that_winds_the_spring_beyond_the_disc_is_not_linearised():
    with pytest.raises(
        ValueError,
        match=r"mean_cut must be less: .* N wind the spring beyond what the disc can lean back \(mm\)",
    ):
        DISC.linearize(50.0, 20.0)
