"""Things of the library as C: the same bits, in the loop, and with the compilers that are there."""

import copy
import json
import shutil

import numpy as np
import pytest
from codegen_inside import LocusTable

import hwsim
import sdpgrind
from sdpgrind import finishing, plunge, weldbead
from sdpgrind.weldbead import force

pytestmark = [
    pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed"),
    pytest.mark.usefixtures("few_blocks"),
]
STEPS = 3000  # enough for some chains of every thing; benchmarks take a million


def table():
    key = np.linspace(0.5, 4.0, 12)
    columns = np.column_stack([np.sin(key), key**2])
    units = {"wear": "mm", "feed": "mm/s", "speed": "mm/s"}
    return LocusTable(key, columns, np.column_stack([np.cos(key), 2.0 * key]), units)


def loop():
    plan = type("Plan", (), {"time": [0.0, 1.0], "normal_force": [30.0, 30.0], "fly_height": [10.0, 10.0]})
    return force.ForceController(plan, force.PI.design(crossover=sdpgrind.units.hz(3.0)))


def torque(kind):
    return finishing.TorqueController(finishing.TorqueAxis(), normal_force=1.111, kind=kind)


@pytest.fixture(scope="module")
def problem():
    return plunge.preset("simulation")


@pytest.fixture(scope="module")
def policy():
    return weldbead.plan(weldbead.preset("P1"), tolerance=None, nodes=81)


NONE = "same bits on every IEEE 754 target: no libm function is used"
CASES = {
    "table": (table, NONE),
    "force": (loop, NONE),
    "pidff": (lambda: torque("pidff"), NONE),
    "lqg": (lambda: torque("lqg"), NONE),
    "damped": (lambda: torque("damped"), NONE),
    "constant": (lambda: torque("constant"), NONE),
}


@pytest.mark.parametrize("name", CASES)
def test_small_things(tmp_path, name):
    thing, promise = CASES[name]
    made = sdpgrind.export(thing(), tmp_path / "thing")
    found = made.check(STEPS, ["gcc"], levels=["-O2"], targets=())
    assert found.status == "equal" and found.differing == 0, found.first
    assert made.promise == promise
    assert made.manifest["stack"] >= found.stack["-O2"] > 0


def test_a_table_has_the_names_of_its_columns(tmp_path):
    made = sdpgrind.export(table(), tmp_path / "thing")
    controller = made.controller()
    assert controller.step(wear=1.7) == dict(zip(("feed", "speed"), table().at(1.7).tolist(), strict=True))
    assert controller.status == 0
    assert controller.step(wear=9.0)["feed"] == np.sin(4.0) and controller.status == 2


def test_a_table_refuses_a_key_that_is_none(tmp_path):
    """It has no answer for NaN, and so neither header nor manifest lets one be missing."""
    made = sdpgrind.export(table(), tmp_path / "thing")
    assert not made.manifest["inputs"][0]["may_be_missing"]
    header = (made.path / "thing.h").read_text()
    assert "NaN: no reading" not in header and "a NaN is refused (-1)" in header
    with pytest.raises(ValueError, match=r"status -1.*wear=nan \(-1e\+09 to 1e\+09 mm\)"):
        made.controller().step(wear=np.nan)


def test_a_policy(tmp_path, policy):
    made = sdpgrind.export(policy, tmp_path / "bead")
    found = made.check(STEPS, ["gcc"], levels=["-O2"], targets=())
    assert found.differing == 0, found.first
    assert made.promise == NONE
    controller = made.controller()
    for height, time in ((1.0, 30.0), (0.3, 12.5), (1.73, 48.0), (0.0, 3.0)):
        wanted = policy.action(height, time)
        got = controller.step(height=height, time_left=time)
        if wanted.stop:
            assert got == {"stop": 1.0}
        else:
            assert (got["duration"], got["normal_force"]) == (wanted.duration, wanted.normal_force)
    with pytest.raises(ValueError, match="status -1"):
        controller.step(height=99.0, time_left=1.0)


def test_a_saved_policy_by_the_command(tmp_path, policy, capsys):
    from hwsim import cli

    policy.save(tmp_path / "bead.nc")
    assert cli.main(["export", str(tmp_path / "bead.nc"), str(tmp_path / "bead"), "--target", "c99"]) == 0
    assert "bead.h, bead.c" in capsys.readouterr().out
    again = sdpgrind.export(policy, tmp_path / "other", name="bead")
    assert (again.path / "bead.c").read_bytes() == (tmp_path / "bead" / "bead.c").read_bytes()
    asked = "duration,feed_rate,normal_force,value"
    less = ["--precision", "float32", "--lost-max", "0.01", "--outputs", asked]
    assert cli.main(["export", str(tmp_path / "bead.nc"), str(tmp_path / "less"), *less]) == 0
    told = json.loads((tmp_path / "less" / "manifest.json").read_text())
    assert told["precision"] == "float32" and 0.0 <= told["lost"]["all_stages"] <= 0.01
    names = {one["name"] for one in told["outputs"]}
    assert "value" in names and "gap" not in names


def test_what_no_command_exports_is_told(tmp_path, capsys):
    """A plan of another kind is wrong input (2), not a fault of the program (70)."""
    from hwsim import cli

    problem = plunge.preset("simulation")
    plunge.plan(problem).save(tmp_path / "cycle.nc")
    assert cli.main(["export", str(tmp_path / "cycle.nc"), str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert (
        "plan must be the file of a sequence policy, an sdp.Policy, a locus or a strategy;" in told
        and "holds a CyclePlan" in told
    )
    assert not (tmp_path / "out").exists()


def test_beads_in_the_loop(tmp_path, policy):
    """Nothing but C decides; what the plan expects comes from the library: the logs are equal in all columns."""
    plant = hwsim.WeldBeadStand(policy.problem)
    made = sdpgrind.export(policy, tmp_path / "bead")
    log = hwsim.run(plant, made.controller(), parts=4, rng=0)
    wanted = hwsim.run(plant, weldbead.SequenceController(policy), parts=4, rng=0)
    assert log.outcome.identical(wanted.outcome)
    assert log["sequence"].identical(wanted["sequence"])


def test_a_short_text_of_an_export(tmp_path):
    made = sdpgrind.export(table(), tmp_path / "thing")
    size = sum((tmp_path / "thing" / f"thing{ending}").stat().st_size for ending in (".h", ".c"))
    where, told = f"'thing' in {str(tmp_path / 'thing')!r}", f"LocusTable, {size / 1000:.0f} kB, 6 functions"
    assert repr(made) == f"Exported({where}: {told}; {NONE})"


def test_charges_that_are_not_exported_are_named(tmp_path):
    finish = weldbead.FinishCharge(0.4, reference_rate=12.5)
    policy = weldbead.plan(weldbead.preset("P1").replace(finish_charge=finish), tolerance=None, nodes=41)
    with pytest.raises(ValueError, match="without a charge for the finish"):
        sdpgrind.export(policy, tmp_path / "bead")


def test_an_ideal_observer_is_refused(tmp_path):
    controller = finishing.TorqueController(
        finishing.TorqueAxis(), normal_force=1.111, kind="pidff", observer="ideal"
    )
    with pytest.raises(ValueError, match="no sensor has the true contact torque"):
        sdpgrind.export(controller, tmp_path / "torque")


@pytest.mark.parametrize("kind", ["cycle", "stages", "printed"])
def test_plunge_in_the_loop(tmp_path, problem, kind):
    """Outcomes, readings and commands are identical, and so is what the log says of the run."""
    controller = {
        "cycle": lambda: plunge.CycleController(problem, safety_margin=0.05),
        "stages": lambda: plunge.StagedController(problem),
        "printed": lambda: plunge.CycleController(problem, safety_margin=0.05, sparkout="printed"),
    }[kind]()
    made = sdpgrind.export(controller, tmp_path / "cycle")
    assert made.check(STEPS, ["gcc"], levels=["-O1"], targets=()).differing == 0
    grinder = hwsim.PlungeGrinder(problem)
    log = hwsim.run(grinder, made.controller(), parts=2, rng=0)
    wanted = hwsim.run(grinder, controller, parts=2, rng=0)
    assert log.outcome.identical(wanted.outcome)


def test_copies_have_states_of_their_own(tmp_path, problem):
    first = sdpgrind.export(plunge.StagedController(problem), tmp_path / "stages").controller()
    second = copy.deepcopy(first)
    for _ in range(20):
        first.step(size=0.01, grinding_power=500.0)
    assert second.state.tolist() != first.state.tolist()
    first.reset()
    assert np.array_equal(first.state, second.state, equal_nan=True)
    assert first.period == problem.sample_time
