"""The adaptive grinder with a dressed wheel: lead at dressing, roughness once a part, and its controller."""

import functools

import numpy as np
import pytest
from adaptive_fakes import burning, needed

import hwsim
import sdpgrind
from hwsim.devices import Gauge
from sdpgrind import locus

PROBLEM = locus.preset("grinding-roughness")
GRINDER = hwsim.AdaptiveGrinder(PROBLEM, dullness=1.3, dressing_state=0.85)
LEAD = 0.12  # mm
POINT = {"infeed_rate": 0.01, "work_rotation": 9.0, "dressing_lead": LEAD}


class Steady:
    """The same point in each sample, its lead changing where nobody asks for it."""

    period = 0.5

    def reset(self):
        self.samples = 0

    def step(self, **measured):
        self.samples += 1
        return POINT if self.samples == 1 else {**POINT, "dressing_lead": 0.4}


@functools.cache
def area():
    return locus.plan(PROBLEM)


def walking(**options):
    return locus.AreaController(area(), per_part="dressing_lead", period=0.5, **options)


def roughness_of(rate, lead, state):
    """mm; the law of Malkin and Koren with the preset's numbers."""
    chip = np.pi * 60.0 * rate / 30e3
    return state * 0.5e-3 * (lead / 0.1) ** 0.5 * (chip / 1e-4) ** 0.4


def area_of(lead, dullness):
    return 0.006 * (lead / 0.1) ** -0.35 * dullness


def test_power_and_roughness_are_those_of_the_laws():
    log = hwsim.run(GRINDER.replace(dulling=0.0), Steady())
    found = {name: log.figure(name)[0] for name in ("slack", "roughness", "roughness_slack", "dressing_lead")}
    assert found["dressing_lead"] == LEAD and np.all(log["controller"].dressing_lead.values[1:] == LEAD)
    assert log.outcome.true_wear_flat_area.values == pytest.approx(area_of(LEAD, 1.3), rel=1e-12)
    power = needed(0.01, 9.0, area_of(LEAD, 1.3))  # W; the slide has settled long before the end
    assert log.outcome.true_grinding_power.values[0, -1] == pytest.approx(power, rel=1e-7)
    assert found["slack"] == pytest.approx(burning(0.01, 9.0) - power, rel=1e-6)
    assert found["roughness"] == pytest.approx(roughness_of(0.01, LEAD, 0.85), rel=1e-6)
    assert found["roughness_slack"] == pytest.approx(0.8e-3 - found["roughness"], rel=1e-12)


def test_roughness_is_read_once_and_the_lead_after_dressing():
    log = hwsim.run(GRINDER, Steady(), parts=2)
    table = log["controller"]
    for part in (0, 1):
        rows = table.part.values == part
        read = table.roughness.values[rows]
        assert np.isnan(read[:-1]).all() and read[-1] == log.outcome.roughness.values[part]
        assert np.isnan(table.dressing_lead.values[rows][0])
    assert table.roughness.units == table.dressing_lead.units == "mm"
    noisy = GRINDER.replace(roughness_gauge=Gauge(noise_sd=1e-5), power_gauge=Gauge(noise_sd=5.0))
    read = [hwsim.run(noisy, Steady(), rng=k)["controller"].roughness.values[-1] for k in range(12)]
    # relative sd of a standard deviation of 12: 0.21
    assert np.std(np.array(read) - log.outcome.roughness.values[0]) == pytest.approx(1e-5, rel=0.65)


def test_a_wheel_dulls_until_it_is_dressed():
    often = hwsim.run(GRINDER, Steady(), parts=3).outcome
    np.testing.assert_allclose(often.true_wear_flat_area, area_of(LEAD, 1.3) + 1e-4, rtol=1e-4)
    seldom = GRINDER.replace(dress_at=area_of(LEAD, 1.3) + 2.5e-4)
    log = hwsim.run(seldom, Steady(), parts=4)
    np.testing.assert_allclose(
        log.outcome.true_wear_flat_area, area_of(LEAD, 1.3) + 1e-4 * np.array([1, 2, 3, 1]), rtol=1e-4
    )
    first = [log["controller"].dressing_lead.values[log["controller"].part.values == k][0] for k in range(4)]
    np.testing.assert_array_equal(first, [np.nan, LEAD, LEAD, np.nan])


def test_the_best_infeed_keeps_both_limits():
    """A wheel that is dull for the lead burns first, a rough one is rough first."""
    for dullness, state, binds in ((1.6, 0.7, "burning"), (0.8, 1.4, "roughness")):
        log = hwsim.run(GRINDER.replace(dullness=dullness, dressing_state=state, dulling=0.0), Steady())
        best = float(log.outcome.best_infeed_rate.values[0, 5])
        rough = roughness_of(best, LEAD, state)
        if binds == "roughness":
            assert rough == pytest.approx(0.8e-3, rel=1e-9)
        else:
            speeds = np.linspace(1.0, 60.0, 4001)
            slack = burning(best, speeds) - needed(best, speeds, area_of(LEAD, dullness))
            assert rough < 0.8e-3 and slack.max() == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize(("dullness", "state"), [(1.2, 1.0), (0.8, 1.4), (0.9, 0.75)])
def test_the_controller_learns_the_wheel_from_part_to_part(dullness, state):
    """No limit is exceeded but by what dulling does between two readings, and the lag of the slide adds."""
    grinder = hwsim.AdaptiveGrinder(PROBLEM, dullness=dullness, dressing_state=state)
    outcome = hwsim.run(grinder, walking(theta=0.8), parts=3, adapt=locus.LearnedStart()).outcome
    assert np.all(outcome.slack.values > -4.0)
    assert np.all(outcome.roughness_slack.values > -4e-6)
    error = np.abs(outcome.roughness_slack.values)
    assert error[-1] < 0.2 * max(error[0], 1e-4)
    best = area().at(dullness=dullness, dressing_state=state).controls
    assert outcome.time.values[-1] < 1.4 * 0.3 / best["infeed_rate"]
    assert outcome.dressing_lead.values[-1] == pytest.approx(best["dressing_lead"], rel=0.12)


def test_margins_for_drift_keep_both_limits():
    drift, kept = {"grinding_power": 3.0, "roughness": 4e-6}, []
    for dullness, state in ((1.2, 1.0),):
        grinder = hwsim.AdaptiveGrinder(PROBLEM, dullness=dullness, dressing_state=state)
        outcome = hwsim.run(grinder, walking(drift=drift), parts=2, adapt=locus.LearnedStart()).outcome
        kept += [outcome.slack.values.min() > 0, outcome.roughness_slack.values.min() > 0]
    assert all(kept)


def test_a_roughness_that_is_not_read_teaches_nothing():
    class Blind(hwsim.devices.Gauge):
        def read(self, value, normal):
            return np.nan

    log = hwsim.run(GRINDER.replace(roughness_gauge=Blind()), walking(), parts=2, adapt=locus.LearnedStart())
    np.testing.assert_allclose(log["controller"].dressing_state_planned.values[:-1][:20], 1.4, rtol=1e-12)
    assert log.outcome.dressing_lead.values[1] < log.outcome.dressing_lead.values[0]  # the wheel is sharper


def test_the_truth_may_differ_from_the_model():
    """A duller dresser is a greater dullness, a rougher law a greater dressing state."""
    model = PROBLEM.model
    rougher = model.grinding.roughness.replace(base=0.85 * model.grinding.roughness.base)
    truth = model.replace(area=1.3 * model.area, grinding=model.grinding.replace(roughness=rougher))
    other = hwsim.AdaptiveGrinder(PROBLEM, truth=truth)
    ours, theirs = hwsim.run(GRINDER, Steady()).outcome, hwsim.run(other, Steady()).outcome
    for name in ("slack", "roughness", "true_wear_flat_area", "time"):
        assert theirs[name].values == pytest.approx(ours[name].values, rel=1e-9)
    drawn = hwsim.run(other.replace(truth=lambda rng: truth), Steady()).outcome
    assert drawn.roughness.values == theirs.roughness.values


def test_logs_are_saved_drawn_and_told(tmp_path):
    log = hwsim.run(GRINDER, Steady(), parts=2)
    log.save(tmp_path / "log.nc")
    again = sdpgrind.load(tmp_path / "log.nc")
    assert again.outcome.roughness_slack.units == "mm"
    log.plot()
    log.report(tmp_path / "report.html")
    assert "roughness" in (tmp_path / "report.html").read_text()


def test_a_part_that_is_never_ground_has_no_roughness():
    machine = GRINDER.start(np.random.default_rng(0))
    seen = machine.step({**POINT, "infeed_rate": 0.0}, 50)
    assert np.isnan(seen["roughness"]) and seen["dressing_lead"] == LEAD and machine.time == 50
    outcome = machine.outcome()
    assert np.isnan(outcome["roughness"]) and np.isnan(outcome["roughness_slack"])
