"""Components of variance of logs of several beads: analysis of variance, likelihood, simulated logs."""

import re

import numpy as np
import pytest
from scipy import linalg, stats
from stand_job import BEADS, BOTH, PROCESS

import hwsim
from sdpgrind import weldbead
from sdpgrind.weldbead._identify.components import BeadReadings, Reml, Tied, _anova, components
from sdpgrind.weldbead._identify.scatter_of_beads import _energies
from sdpgrind.weldbead._identify.widening import widening

TRUE = np.sqrt(np.log1p(0.15**2))


def drawn(beads, passes, seed, missing=0.0, trend=0.0, forces=(25.0, 35.0, 50.0)):
    """Readings of beads at three forces; a share of passes is missing, but one of each bead."""
    rng, rows = np.random.default_rng(seed), []
    own = BOTH.scatter.coefficients
    for number in range(beads):
        bead = BEADS.drawn(PROCESS, rng)
        bead = bead.replace(friction_ratio=bead.friction_ratio * np.exp(trend * number))
        kept = rng.random(passes) >= missing
        kept[rng.integers(passes)] = True
        for force in rng.choice(forces, passes)[kept]:
            now = own.drawn(bead, rng)
            tangential, power = now.friction_ratio * force, float(now.grinding_power(force))
            rows.append((number, force, tangential, power, float(now.removal_rate(force))))
    names = ("part", "normal_force", "tangential_force", "grinding_power", "removal_rate")
    return dict(zip(names, np.array(rows).T, strict=True))


def found(data, **options):
    return weldbead.identify(data, "scatter", method="components", model=PROCESS, **options)


def one_way(y):
    return [
        BeadReadings(
            row, np.ones((row.size, 1)), np.ones((row.size, 1)), np.ones((row.size, 1)), np.zeros(row.size)
        )
        for row in y
    ]


def test_likelihood_of_balanced_data_is_the_analysis_of_variance():
    """Restricted likelihood equals it where the scatter between beads is not 0; its formula by hand."""
    rng = np.random.default_rng(1)
    y = TRUE * rng.standard_normal((30, 1)) + TRUE * rng.standard_normal((30, 5))
    one, other = _anova(y), Reml(one_way(y)).components()
    within, between = y.var(axis=1, ddof=1).mean(), 5 * y.mean(axis=1).var(ddof=1)
    assert one.passes[0] == pytest.approx(np.sqrt(within), rel=1e-12)
    assert one.beads[0] == pytest.approx(np.sqrt((between - within) / 5), rel=1e-12)
    assert other.passes + other.beads == pytest.approx(one.passes + one.beads, rel=1e-4)
    assert other.means == pytest.approx(one.means, rel=1e-12)
    assert np.allclose(other.passes_interval, one.passes_interval, rtol=0.02)
    assert np.allclose(other.beads_interval, one.beads_interval, rtol=0.08)


def test_the_deviance_is_that_of_a_normal_law_integrated_over_the_means():
    """Density of y with flat means by the sum over a grid of the mean, one fixed effect."""
    rng = np.random.default_rng(2)
    beads = one_way([rng.standard_normal(size) * 0.2 for size in (2, 4, 1, 3)])
    reml = Reml(beads)
    grid = np.linspace(-3, 3, 6001)

    def density(passes, between):
        logs = np.zeros(grid.size)
        for bead in beads:
            size = bead.y.size
            law = stats.multivariate_normal(np.zeros(size), passes**2 * np.eye(size) + between**2)
            logs += law.logpdf(bead.y[None, :] - grid[:, None]).reshape(grid.size)
        return np.log(np.exp(logs - logs.max()).sum() * (grid[1] - grid[0])) + logs.max()

    difference = -2 * (density(0.3, 0.2) - density(0.15, 0.1))
    ours = [reml.deviance(np.square(sds))[0] for sds in ((0.3, 0.2), (0.15, 0.1))]
    assert ours[0] - ours[1] == pytest.approx(difference, rel=1e-9)


def test_statsmodels_agrees_on_friction_with_passes_missing():
    statsmodels = pytest.importorskip("statsmodels.api")
    data = drawn(25, 5, seed=3, missing=1 / 3)
    y = 10 * np.log(data["tangential_force"] / data["normal_force"])  # its search stops early near 0
    fit = statsmodels.MixedLM(y, np.ones((y.size, 1)), groups=data["part"]).fit(reml=True)
    ours = components(one_way([y[data["part"] == part] for part in np.unique(data["part"])]))
    assert ours.passes[0] ** 2 == pytest.approx(fit.scale, rel=1e-3)
    assert ours.beads[0] ** 2 == pytest.approx(float(fit.cov_re[0, 0]), rel=1e-3)


@pytest.mark.parametrize("missing", [0.0, 1 / 3])
def test_forty_beads_tell_both_scatters_and_the_coefficients(missing):
    """Within three standard errors of what 600 logs of 40 beads gave: 0.011 and 0.022, K1 4 %, K2 8 % high."""
    told = found(drawn(40, 4, seed=4, missing=missing))
    own = told.scatter.coefficients
    for name in ("specific_energy", "friction_ratio"):
        assert getattr(own, name) == pytest.approx(0.15, abs=3 * 0.013)
        assert getattr(told.bead_scatter, name) == pytest.approx(0.15, abs=3 * 0.026)
        for low, high in told.interval[name]:
            assert low < 0.15 < high
    assert own.idle_power == own.specific_energy
    assert told.process.specific_energy == pytest.approx(12.8, rel=0.1)
    assert told.process.idle_power == pytest.approx(114.0, rel=0.25)
    assert told.process.friction_ratio == pytest.approx(0.33, rel=0.1)


def test_noise_of_the_scans_is_no_scatter_of_the_passes():
    """Depths known to 0.04 mm: told, the passes scatter by 0.15 as before; untold, they seem to by half as much more."""
    data = drawn(40, 4, seed=10)
    depth = data["removal_rate"] / (PROCESS.bead_width * 15.0)
    read = depth + 0.04 * np.random.default_rng(11).standard_normal(depth.size)
    kept = read > 0.02
    noisy = {name: values[kept] for name, values in data.items()}
    noisy |= {"cut_depth": read[kept], "removal_rate": read[kept] * PROCESS.bead_width * 15.0}
    told = weldbead.identify(noisy, "scatter", method="components", model=PROCESS, depth_noise=0.04)
    untold, exact = found(noisy), found(data)
    scatter = [each.scatter.coefficients.specific_energy for each in (told, untold, exact)]
    assert abs(scatter[0] - scatter[2]) < 0.5 * abs(scatter[1] - scatter[2])


def test_a_log_of_the_loop_closes_it():
    stand = hwsim.WeldBeadStand(BOTH, height=1.0, time=60.0)
    policy = weldbead.plan(BOTH, tolerance=None, nodes=101)
    log = hwsim.run(stand, weldbead.SequenceController(policy, learn=False), parts=12, rng=0)
    told = found(log)
    closed = BOTH.updated(told)
    assert (closed.scatter, closed.bead_scatter) == (told.scatter, told.bead_scatter)
    assert told.beads == 12 and "12 beads" in repr(told)
    two = found([log, log])
    assert two.beads == 24 and two.scatter.coefficients.friction_ratio == pytest.approx(
        told.scatter.coefficients.friction_ratio, rel=1e-3
    )


def test_few_beads_do_not_tell_how_beads_differ():
    told = found(drawn(3, 6, seed=5))
    assert told.bead_scatter == weldbead.CoefficientScatter(0.15, 0.15, 0.15)
    assert "scatter between beads assumed: fewer than 4 beads" in told.message
    assert told.interval["friction_ratio"][1] == (0.0, np.inf)
    one = found(drawn(1, 20, seed=6))
    assert one.beads == 1 and 0.08 < one.scatter.coefficients.friction_ratio < 0.25


def test_a_component_of_zero_is_an_estimate():
    rng = np.random.default_rng(7)
    y = rng.standard_normal((6, 4))
    y += -y.mean(axis=1, keepdims=True)  # all means alike
    none = _anova(y)
    assert none.beads[0] == 0.0 and none.beads_interval[0][0] == 0.0
    assert Reml(one_way(y)).components().beads[0] < 1e-6


@pytest.mark.parametrize("tie", [Tied(), Tied(beads=False), Tied(False, False)])
def test_the_gradient_of_the_deviance_is_its_difference_quotient(tie):
    """Beads of two sizes with their own loads; the error of a central quotient is of order step^2 = 1e-10."""
    rng = np.random.default_rng(12)

    def bead(size):
        loads = -np.column_stack([np.ones(size), rng.uniform(0.2, 0.9, size)])
        return BeadReadings(rng.standard_normal(size), loads, loads, loads**2, np.full(size, 0.01))

    reml = Reml([bead(size) for size in (4, 3, 4, 2, 5)], tie)
    at = rng.uniform(0.2, 0.6, 4 - tie.passes - tie.beads)
    gradient, step = reml.deviance(at)[1], 1e-5
    sides = [[reml.deviance(at + sign * step * one)[0] for sign in (1, -1)] for one in np.eye(at.size)]
    assert gradient == pytest.approx([(up - down) / (2 * step) for up, down in sides], rel=1e-6, abs=1e-6)


def test_forms_of_the_score_are_those_of_the_whole_matrix():
    """One matrix of all readings, P = V^-1 - V^-1 X (X'V^-1 X)^-1 X'V^-1, and dV by blocks."""
    rng = np.random.default_rng(17)
    loads = [-np.column_stack([np.ones(size), rng.uniform(0.2, 0.9, size)]) for size in (4, 2, 3)]
    beads = [BeadReadings(rng.standard_normal(each.shape[0]), each, each, each**2, np.full(each.shape[0], 0.1))
             for each in loads]  # fmt: skip
    reml = Reml(beads)
    passes, between = reml.best[0]
    own = np.diag(np.concatenate([np.sum(each**2, axis=1) for each in loads]))
    shared, x = linalg.block_diag(*[each @ each.T for each in loads]), np.concatenate(loads)
    inverse = np.linalg.inv(passes * own + between * shared + 0.1 * np.eye(9))
    p = inverse - inverse @ x @ np.linalg.inv(x.T @ inverse @ x) @ x.T @ inverse
    y = rng.standard_normal((5, 9))
    expected = [[row @ p @ change @ p @ row for change in (own, shared)] for row in y]
    assert reml.squares(np.split(y, [4, 6], axis=1)) == pytest.approx(np.array(expected), rel=1e-9)


def test_intervals_of_energies_are_wider_where_readings_are_less_normal():
    """No idle power: chi-square as it is. Light passes, whose power is half idle, widen most."""

    def factors(forces, idle_power=114.0):
        model = PROCESS.replace(idle_power=idle_power)
        data = drawn(20, 4, seed=18, forces=forces)
        data = {name: values[data["removal_rate"] > 0] for name, values in data.items()}
        parts = data["part"]
        beads = [{name: values[parts == part] for name, values in data.items()} for part in range(20)]
        readings = _energies(beads, model, 0.0)
        return widening(Reml(readings), beads, readings)

    assert np.all(factors([25.0, 50.0], idle_power=0.0) == 1.0)
    heavy, light = factors([45.0, 50.0]), factors([20.0, 22.0])
    assert 1.0 <= heavy[0] < 1.3 < light[0]


def test_four_components_are_told_apart_only_where_passes_tell_them():
    """40 beads at 20, 35 and 50 N tell those of K1 and not how K2 differs between beads."""
    told = found(drawn(40, 4, seed=13, forces=[20.0, 35.0, 50.0]), tie=False)
    alike = found(drawn(40, 4, seed=13, forces=[20.0, 35.0, 50.0]))
    assert "idle_power between beads" in told.not_identified and "not identified: " in told.message
    for name in told.not_identified:
        coefficient, level = name.split(" between ")
        low, high = told.interval[coefficient][level == "beads"]
        assert high > 4 * low
    assert told.bead_scatter.idle_power == told.bead_scatter.specific_energy
    assert alike.not_identified == () and "not identified" not in alike.message
    assert BOTH.updated(told).bead_scatter == told.bead_scatter


def test_of_few_beads_nothing_is_untied():
    """Two beads tell no scatter between them: the mean idle power must not rest on one that is made up."""
    data = drawn(2, 8, seed=4)
    apart, tied = found(data, tie=False, conservative=True), found(data)
    assert apart.process.idle_power == pytest.approx(tied.process.idle_power, rel=0.1)
    assert "upper limits of the 95 % intervals of the scatter from pass to pass" in apart.message


def test_four_components_of_a_linear_law_are_recovered():
    """80 beads of 6 passes, drawn as the likelihood assumes: within three standard errors of the truth."""
    rng, true = np.random.default_rng(14), ((0.1, 0.2), (0.16, 0.12))

    def bead():
        loads = -np.column_stack([np.ones(6), rng.choice([0.2, 0.9], 6)])
        deviations = true[1] * rng.standard_normal(2) + true[0] * rng.standard_normal((6, 2))
        return BeadReadings(np.sum(loads * deviations, axis=1), loads, loads, loads**2, np.zeros(6))

    told = components([bead() for _ in range(80)], Tied(False, False))
    for values, intervals, sds in zip(
        told[:2], (told.passes_interval, told.beads_interval), true, strict=True
    ):
        for value, (low, high), sd in zip(values, intervals, sds, strict=True):
            assert abs(value - sd) < 3 * (high - low) / (2 * 1.96) and low < value < high


def test_a_careful_plan_is_told_the_upper_limits():
    data = drawn(20, 4, seed=15)
    told, careful = found(data), found(data, conservative=True)
    own = careful.scatter.coefficients
    for name in ("specific_energy", "idle_power", "friction_ratio"):
        assert (getattr(own, name), getattr(careful.bead_scatter, name)) == tuple(
            high for _, high in told.interval[name]
        )
    assert careful.interval == told.interval and careful.process == told.process
    assert "upper limits" in careful.message and "upper limits" not in told.message
    few = found(drawn(3, 6, seed=5), conservative=True)
    assert few.bead_scatter == weldbead.CoefficientScatter(0.15, 0.15, 0.15)
    assert few.scatter.coefficients.specific_energy == few.interval["specific_energy"][0][1]


def test_a_trend_from_bead_to_bead_is_told():
    told = found(drawn(30, 4, seed=8, trend=0.03))
    assert re.search(r"friction_ratio drifts by \+[234]\.?\d* % a bead", told.message)
    assert "drifts" not in found(drawn(30, 4, seed=8)).message


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({name: values[:2] for name, values in drawn(2, 2, seed=9).items()}, "at least 3 passes"),
        (drawn(5, 1, seed=9), "at least two passes of one bead"),
    ],
)
def test_refused(data, message):
    with pytest.raises(ValueError, match=message):
        found(data)


def test_a_model_is_asked_for():
    with pytest.raises(TypeError, match="model must be"):
        weldbead.identify(drawn(5, 4, seed=9), "scatter", method="components")
