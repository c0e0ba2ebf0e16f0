"""Plants served in lockstep give every number of `hwsim.run`, bit for bit."""

import adaptive_fakes
import centering_fakes
import finishing_fakes
import force_table_fakes
import numpy as np
import pytest
from hwsim_fakes import Drain, Tank, noisy_tank

import centering
import hwsim
from hwsim.opcua import _packing
from sdpgrind import plunge, weldbead

ANY = "opc.tcp://127.0.0.1:0"
P1 = weldbead.preset("P1")
STAND = hwsim.WeldBeadStand(P1, height=1.5, time=30.0)
COARSE = {"tolerance": None, "nodes": 51}


def lockstep(plant):
    return hwsim.serve(plant, ANY, speed=None, security="none")


def behind(server):
    return hwsim.OpcuaPlant(server.url, security="none")


def assert_same(log, other):
    assert log.tiers == other.tiers and list(log.outcome) == list(other.outcome)
    for one, two in [(log[name], other[name]) for name in log.tiers] + [(log.outcome, other.outcome)]:
        for name in one:
            assert np.array_equal(one[name].values, two[name].values, equal_nan=True), name
            assert one[name].attrs == two[name].attrs and one[name].dims == two[name].dims


def plunging():
    problem = plunge.preset("simulation")
    return hwsim.PlungeGrinder(problem), plunge.CycleController(problem)


def table():
    stand = hwsim.ForceTableStand(force_table_fakes.problem(15.0))
    held = force_table_fakes.Held(force_table_fakes.platform(0.8))
    return stand, force_table_fakes.Tiers(sequence=force_table_fakes.Passes(1), force=held)


def cell():
    of = finishing_fakes.problem(order=1)
    return hwsim.FinishingCell(of), finishing_fakes.controller(of)


def probe():
    estimator = centering.GeometryEstimator(noise_sd=0.0012, tip_radius=3.75, confidence=0.999)
    return hwsim.Probe(hwsim.Ring(61.94, 3.6, 0.5)), centering.MeasuringController(estimator)


PLANTS = {
    "weldbead": lambda: (STAND, weldbead.SequenceController(weldbead.plan(P1, **COARSE))),
    "plunge": plunging,
    "locus": lambda: (hwsim.AdaptiveGrinder(adaptive_fakes.PROBLEM), adaptive_fakes.Printed()),
    "finishing": cell,
    "centering": lambda: (
        hwsim.CenteringMachine(centering_fakes.problem(mass=0.8)),
        centering_fakes.Follower(speed=4.0),
    ),
    "force table": table,
    "probe": probe,
}


@pytest.mark.parametrize("name", PLANTS)
def test_every_number_is_that_of_a_run_without_a_server(name):
    plant, controller = PLANTS[name]()
    with lockstep(plant) as server:
        remote = behind(server)
        assert hwsim.check(remote, controller)
        served = hwsim.run(remote, controller, parts=2, rng=3)
    assert_same(served, hwsim.run(plant, controller, parts=2, rng=3))


@pytest.fixture(scope="module")
def tank():
    with lockstep(noisy_tank()) as server:
        yield server


def test_a_wrong_command_has_the_machine_s_own_sentence():
    class Hard:
        period = None

        def reset(self): ...

        def step(self, **measured):
            return {"normal_force": 80.0, "duration": 10.0}

    with (
        lockstep(STAND) as server,
        pytest.raises(ValueError, match="normal_force must be <= force_max = 50") as said,
    ):
        hwsim.run(behind(server), Hard())
    with pytest.raises(ValueError) as here:
        hwsim.run(STAND, Hard())
    assert str(said.value) == str(here.value)


def test_declarations_cross_the_wire(tank):
    remote = behind(tank)
    for name in ("measures", "accepts", "outcomes", "description", "tick"):
        assert getattr(remote, name) == getattr(Tank(), name)
    with lockstep(STAND) as server:
        assert behind(server).job == STAND.job


def test_a_controller_for_another_job_is_refused():
    other = weldbead.plan(P1.replace(bead_length=60.0), **COARSE)
    with lockstep(STAND) as server:
        said = str(hwsim.check(behind(server), weldbead.SequenceController(other)))
    assert "its bead_length is 60.0 mm, that of the plant 50.0 mm" in said


def test_the_plant_needs_no_second_session_and_a_second_one_may_not_command(tank):
    first, second = behind(tank), behind(tank)
    hwsim.run(first, Drain())
    hwsim.run(first, Drain())
    with pytest.raises(PermissionError, match=f"{first.url} is commanded by another session"):
        hwsim.run(second, Drain())
    first.close()
    hwsim.run(second, Drain())
    second.close()


def test_a_journal_goes_on_after_a_lost_server(tmp_path):
    plant, file = noisy_tank(), tmp_path / "run.db"
    with lockstep(plant) as server:
        remote = behind(server)
        hwsim.run(remote, Drain(), parts=2, rng=5, journal=file)
    whole = hwsim.run(plant, Drain(), parts=4, rng=5)
    with lockstep(plant) as server:
        assert_same(hwsim.run(behind(server), Drain(), parts=4, rng=5, journal=file), whole)


@pytest.mark.parametrize(
    "seed",
    [0, 2**127 + 1, [1, 2, 3], np.random.SeedSequence(5, spawn_key=(3, 2**40)), np.random.SeedSequence(None)],
)
def test_seeds_cross_as_texts_without_loss(seed):
    rng = np.random.default_rng(seed)
    far = _packing.seeded(_packing.seed_text(rng))[0]
    np.testing.assert_array_equal([r.random() for r in rng.spawn(2)], [r.random() for r in far.spawn(2)])
    np.testing.assert_array_equal(rng.random(4), far.random(4))


def test_a_used_generator_is_refused_and_a_spawned_one_is_continued():
    rng = np.random.default_rng(1)
    rng.spawn(2)
    far = _packing.seeded(_packing.seed_text(rng))[0]
    assert rng.spawn(1)[0].random() == far.spawn(1)[0].random()
    rng.random()
    with pytest.raises(ValueError, match="rng must be an unused generator"):
        _packing.seed_text(rng)


@pytest.mark.parametrize("text", ["", "-1", "1.5", "{}", '{"entropy": ["x"]}', "[]", "null"])
def test_a_seed_that_is_none_is_refused(text):
    with pytest.raises(ValueError, match="seed must be a whole number >= 0 or"):
        _packing.seeded(text)


def test_mappings_of_numbers_and_arrays_are_packed_bit_for_bit():
    names = ("a", "b", "c", "d")
    table = np.array([[0.1, -0.0, 5e-324], [1 / 3, 1e300, -2.0]])
    values = {"b": 1 / 3, "c": table, "d": []}
    assert _packing.given(names, _packing.packed(names, values)).keys() == {"b", "c", "d"}
    far = _packing.unpacked(names, _packing.packed(names, values))
    assert np.isnan(far["a"]) and far["b"] == 1 / 3 and far["d"].shape == (0,)
    assert far["c"].tobytes() == table.tobytes() and far["c"].shape == table.shape


@pytest.mark.parametrize(
    "flat", [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0, 5.0, 1.0], [0.0, 0.0, 0.0, 1.0, -1.0]]
)
def test_a_packed_array_without_its_entries_is_refused(flat):
    with pytest.raises((ValueError, IndexError)):
        _packing.unpacked(("a", "b"), flat)


def test_outcomes_are_told_with_all_their_digits():
    import json

    outcome = {"x": 0.1 + 0.2, "none": float("nan"), "most": [1.0, -float("inf")], "text": "burned", "n": 3}
    told = json.loads(_packing.outcome_text(outcome))
    far = _packing.outcome_of(told)
    assert far["x"] == 0.1 + 0.2 and np.isnan(far["none"]) and far["text"] == "burned" and far["n"] == 3
    np.testing.assert_array_equal(np.asarray(far["most"], dtype=float), [1.0, -np.inf])
