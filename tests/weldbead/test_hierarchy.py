"""Three tiers in one controller: set-points, estimates, refusals, and that it grinds a bead better than the
blind ones.
"""

import numpy as np
import pytest

import hwsim
from sdpgrind import units, weldbead
from sdpgrind.weldbead import force, passes

PROCESS = weldbead.GrindingProcess(12.8, 114.0, 0.33, 88.9, 500.0, 0.0, 12.7)
DISC = passes.TiltedDisc(PROCESS, relaxed_angle=units.deg(20), rotational_stiffness=6e5)
LOOP = force.PI.design(crossover=units.hz(3.0))
SEQUENCE = weldbead.preset("P4").replace(
    model=PROCESS, bead_length=40.0, durations=range(6, 17, 2), stage=2.0, horizon=40.0, force_max=50.0
)
X = np.linspace(0, 40, 161)
BEAD = passes.Contour(X, 0.6 + 0.05 * np.sin(2 * np.pi * X / 20))
STAND = hwsim.ForceTableStand(passes.PassProblem(DISC, BEAD, mean_cut=0.2, feed_rate=10.0), time=30.0)


@pytest.fixture(scope="module")
def policy():
    return weldbead.plan(SEQUENCE, tolerance=None, nodes=101)


@pytest.fixture(scope="module")
def log(policy):
    return hwsim.run(STAND, weldbead.Hierarchy(policy, DISC, LOOP), rng=1)


def test_it_fits_the_stand(policy):
    tiers = weldbead.Hierarchy(policy, DISC, LOOP).tiers
    assert list(tiers) == ["sequence", "pass", "force"]


def test_every_tier_has_its_table(log):
    assert log.tiers == ("sequence", "pass", "force")
    passes_made = int(log.outcome.passes.item())
    assert passes_made >= 2
    assert log["sequence"].sizes["row"] == log["pass"].sizes["row"] == passes_made + 1
    assert log["force"].sizes["row"] > 100 * passes_made


def test_passes_with_their_leads_take_the_time_that_was_planned(log):
    """A stage that is begun is lost: no pass may take longer than on the lattice, nor much less."""
    left = log["sequence"]["time_left"].values
    took, feeds = -np.diff(left), log["sequence"]["planned_feed_command"].values[: len(left) - 1]
    planned = 40.0 / feeds + SEQUENCE.reset_time
    assert np.all(took <= planned) and np.all(took > planned - 0.3)
    assert np.all(log["pass"]["feed_rate_command"].values[: len(feeds)] > feeds)


def test_what_the_sequence_asks_for_is_what_the_pass_plans(log):
    sequence, planned = log["sequence"], log["pass"]
    going = ~np.isnan(sequence["mean_cut_command"].values)
    asked = sequence["mean_cut_command"].values[going] * PROCESS.bead_width * 40.0
    got = planned["volume_planned"].values[going] + planned["shortfall_planned"].values[going]
    np.testing.assert_allclose(got, asked, rtol=2e-2)
    np.testing.assert_array_equal(
        planned["mean_cut"].values[going], sequence["mean_cut_command"].values[going]
    )


def test_the_cut_is_near_what_was_asked_where_the_coefficients_are_known(policy):
    known = hwsim.ForceTableStand(
        STAND.problem, time=30.0, pass_scatter=type(STAND.pass_scatter)(0.0, 0.0, 0.0), runout=0.0
    )
    log = hwsim.run(known, weldbead.Hierarchy(policy, DISC, LOOP, reestimate=False), rng=2)
    asked = log["sequence"]["mean_cut_command"].values
    cut = log.outcome.true_cut_depth.values[0]
    made = np.isfinite(cut)
    short = log["pass"]["shortfall_planned"].values[: made.sum()] / (PROCESS.bead_width * 40.0)
    np.testing.assert_allclose(cut[made], asked[: made.sum()] - short, atol=0.02)


def test_estimates_go_towards_the_truth(policy):
    dull = hwsim.ForceTableStand(
        STAND.problem,
        time=30.0,
        truth=DISC.replace(specific_energy=17.0),
        pass_scatter=type(STAND.pass_scatter)(0.0, 0.0, 0.0),
    )
    log = hwsim.run(dull, weldbead.Hierarchy(policy, DISC, LOOP), rng=3)
    found = log["sequence"]["specific_energy_command"].values
    found = found[np.isfinite(found)]
    assert found[0] == 12.8 and abs(found[-1] - 17.0) < 0.6 * (17.0 - 12.8)
    blind = hwsim.run(dull, weldbead.Hierarchy(policy, DISC, LOOP, reestimate=False), rng=3)
    assert set(np.unique(blind["sequence"]["specific_energy_command"].values[:-1])) == {12.8}


def test_same_seed_same_bits(policy, log):
    again = hwsim.run(STAND, weldbead.Hierarchy(policy, DISC, LOOP), rng=1)
    assert again.outcome.identical(log.outcome)
    assert again["force"].identical(log["force"])


def test_scans_that_are_not_looked_at_cost(policy):
    dull = hwsim.ForceTableStand(STAND.problem, time=30.0, truth=DISC.replace(specific_energy=9.0))
    log = hwsim.compare(
        dull,
        {
            "looks": weldbead.Hierarchy(policy, DISC, LOOP),
            "does not": weldbead.Hierarchy(policy, DISC, LOOP, reestimate=False, replan=False),
        },
        parts=3,
        rng=0,
    )
    looks, blind = log.outcome.penalty.values
    assert looks.mean() < blind.mean()


def test_another_process_is_refused(policy):
    with pytest.raises(
        ValueError, match=r"policy must be for the process of the disc; got one for .*12.8.* and a disc .*14"
    ):
        weldbead.Hierarchy(policy, DISC.replace(specific_energy=14.0), LOOP)


def test_a_policy_for_another_bead_is_refused(policy):
    other = hwsim.ForceTableStand(
        passes.PassProblem(DISC, passes.Contour([0, 60], [1, 1]), mean_cut=0.2, feed_rate=10.0), time=30.0
    )
    with pytest.raises(ValueError, match="bead_length"):
        hwsim.run(other, weldbead.Hierarchy(policy, DISC, LOOP))


def test_late_beads_are_stopped(policy):
    late = hwsim.ForceTableStand(STAND.problem, time=3.0)
    log = hwsim.run(late, weldbead.Hierarchy(policy, DISC, LOOP), rng=1)
    assert int(log.outcome.passes.item()) == 0


def test_ingredients_of_another_kind():
    with pytest.raises(TypeError, match="policy must be a SequencePolicy, as "):
        weldbead.Hierarchy(None, DISC, LOOP)


def test_passes_are_parallel_to_the_parent():
    """A bead on a slope of 2 mm: what is left is level with the parent, and the parent is hardly touched."""
    parent = passes.Contour([0.0, 40.0], [0.0, 2.0])
    sloped = passes.Contour(X, np.asarray(BEAD.z) + parent.at(X))
    stand = STAND.replace(problem=STAND.problem.replace(bead=sloped, parent=parent, target_shape=parent))
    policy = weldbead.plan(SEQUENCE, tolerance=None, nodes=101)
    log = hwsim.run(stand, weldbead.Hierarchy(policy, DISC, LOOP, parent=parent), rng=1)
    level = hwsim.run(STAND, weldbead.Hierarchy(policy, DISC, LOOP), rng=1)
    assert float(log.outcome.overground_worst[0]) < float(level.outcome.overground_worst[0]) + 0.03
    with pytest.raises(ValueError, match="its parent is None, that of the plant Contour"):
        hwsim.run(stand, weldbead.Hierarchy(policy, DISC, LOOP), rng=1)


def test_more_force_than_brown_had():
    problem = SEQUENCE.replace(force_max=120.0, burn_limit=None)
    strong = weldbead.Hierarchy(weldbead.plan(problem, tolerance=None, nodes=101), DISC, LOOP)
    tall = STAND.problem.replace(bead=passes.Contour(X, 0.9 + 0.1 * np.sin(2 * np.pi * X / 20)))
    log = hwsim.run(STAND.replace(problem=tall, time=7.0), strong, rng=2)
    assert 90.0 < np.nanmax(log["force"]["force_demand_planned"].values) <= 120.1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"datum": 5.0}, "its datum is 0.0 mm, that of the plant 5.0 mm"),
        ({"lead_out": 50.0}, "its lead_out is 5.0 mm, that of the plant 50.0 mm"),
        (
            {"problem": STAND.problem.replace(disc=DISC.replace(relaxed_angle=units.deg(25)))},
            "its relaxed_angle is 0.349",
        ),
    ],
)
def test_a_machine_that_is_set_up_otherwise(policy, change, message):
    with pytest.raises(ValueError, match=message):
        hwsim.run(STAND.replace(**change), weldbead.Hierarchy(policy, DISC, LOOP), rng=1)


def test_a_datum_is_taken_into_account(policy, log):
    moved = hwsim.run(STAND.replace(datum=5.0), weldbead.Hierarchy(policy, DISC, LOOP, datum=5.0), rng=1)
    np.testing.assert_allclose(moved.outcome.height, log.outcome.height, atol=2e-3)


def test_light_passes_tell_of_the_idle_power_and_little_of_the_energy(policy):
    tier = weldbead.Hierarchy(policy, DISC, LOOP).tiers["sequence"]
    tier.step(height=0.5, time_left=20.0)
    light = 1.5 * PROCESS.threshold_force
    tier.step(
        height=0.4,
        time_left=14.0,
        grinding_power=100.0,
        removal_rate=9.0,
        normal_force=light,
        tangential_force=0.30 * light,
    )
    learned = tier._follow.problem.model
    moved = [np.log(learned.specific_energy / 12.8), np.log(learned.idle_power / 114.0)]
    assert moved[1] < -0.05 and abs(moved[0]) < 0.5 * abs(moved[1])
    assert learned.friction_ratio < 0.33 and learned == tier._model


DIFFERENT = SEQUENCE.replace(
    scatter=weldbead.Scatter(("K1", "K2", "mu"), (0.1, 0.1, 0.1), law="lognormal"),
    bead_scatter=weldbead.CoefficientScatter(0.15, 0.15, 0.15),
)
READ = ("normal_force", "tangential_force", "grinding_power", "removal_rate", "cut_depth")


@pytest.fixture(scope="module")
def different():
    return weldbead.plan(DIFFERENT, tolerance=None, nodes=101)


def test_where_beads_differ_the_pass_is_planned_with_what_is_believed(different):
    """Set-points of each pass are the process of the mean cut by an estimator that is told the same readings."""
    log = hwsim.run(STAND, weldbead.Hierarchy(different, DISC, LOOP), rng=3)
    table, belief = log["sequence"], weldbead.BeadEstimator(DIFFERENT)
    going = ~np.isnan(table["mean_cut_command"].values)
    assert going.sum() >= 3
    for k in np.flatnonzero(going):
        row = table.isel(row=k)
        if k:
            belief.learn(**{name: float(row[name]) for name in READ})
        expected = belief.believed.depths.expected(belief.believed.model)
        for name in ("specific_energy", "idle_power", "friction_ratio"):
            assert float(row[f"{name}_command"]) == pytest.approx(getattr(expected, name), rel=1e-12)
        assert float(row["learns_planned"]) == 1.0
    assert np.ptp(table["friction_ratio_command"].values[going]) > 0


def test_tiers_that_do_not_estimate_do_not_learn_the_bead(different):
    blind = weldbead.Hierarchy(different, DISC, LOOP, reestimate=False)
    assert "grinding_power" not in blind.tiers["sequence"].reads
    assert "learns" not in blind.tiers["sequence"].reports


def test_leads_that_the_plan_knows_are_not_added_twice(policy):
    """A pass has the time of its duration, whether the plan counts the leads or not."""
    x, z = BEAD.x, BEAD.z
    feeds = []
    for lead in (0.0, 15.0):
        led = policy.problem.replace(lead_length=lead)
        tiers = weldbead.Hierarchy(weldbead.plan(led, tolerance=None, nodes=101), DISC, LOOP).tiers
        command = tiers["pass"].step(
            profile=z, profile_x=x, mean_cut=0.1, planned_feed=led.feed_rate(10.0), specific_energy=12.8,
            idle_power=114.0, friction_ratio=0.33,
        )  # fmt: skip
        feeds.append(command["feed_rate"])
    assert feeds[0] == pytest.approx(feeds[1], rel=1e-12)
