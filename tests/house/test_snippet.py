"""What a user writes runs as written: the tour of the interface, and the lines of the README."""

import re
from functools import partial

import pytest
from house_names import ROOT

from hwsim.cli import main

TOUR = """
import hwsim, sdpgrind
from sdpgrind import sdp, weldbead

process = weldbead.GrindingProcess(specific_energy=10.0, idle_power=100.0, friction_ratio=0.3,
                                   disk_radius=85.0, free_speed=500.0, speed_droop=0.0, bead_width=12.5)
problem = weldbead.SequenceProblem(
    process, bead_length=50.0, reset_time=2.0, durations=range(6, 21, 2), force_max=50.0,
    burn_limit=None,                              # or weldbead.ForceBurnLimit(16.0), PowerBurnLimit, MalkinBurnLimit
    scatter=weldbead.Scatter("C1", 0.15, law="rayleigh"),
    height_max=2.0, horizon=60.0, stage=2.0,
    height_charge=sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)),
    lateness_charge=None)                         # or sdp.Linear(0.25), sdp.Quadratic(0.01)
assert problem == weldbead.preset("P1")
problem = weldbead.preset("P1")                   # the same; P1..P5 and C0 of the spec

policy = weldbead.plan(problem)                   # default tolerance 1e-5 $; progress on a terminal when it takes long
policy.value(height=1.0, time_left=24.0)          # 0.070643; arrays go in, arrays come out
policy.action(height=1.0, time_left=24.0)         # .stop, .duration, .feed_rate, .normal_force, .mean_cut, .gap
policy.gradient(height=1.0, time_left=24.0)
policy.error                                      # estimated distance from converged, $
policy.simulate(runs=10_000, height=1.5, time_left=30.0, rng=0)
policy.plot(); policy.save("policy.nc"); policy = sdpgrind.load("policy.nc")

log = hwsim.run(hwsim.WeldBeadStand(problem), weldbead.SequenceController(policy), parts=20, rng=0)
log.outcome; log.plot(); log.save("run.nc")       # one row a bead: penalty planned and realised, passes, overground
estimate = weldbead.identify(log, "power")        # K1, K2 with covariance
policy = weldbead.plan(problem.updated(estimate))
"""

TIERS = """
import hwsim, numpy as np
from sdpgrind import units, weldbead
from sdpgrind.weldbead import force, passes

x = np.linspace(0, 150, 1501)
bead = passes.Contour(x, 1.0 + 0.15*np.sin(2*np.pi*x/60))
process = weldbead.GrindingProcess(specific_energy=12.8, idle_power=114.0, friction_ratio=0.33,
                                   disk_radius=88.9, free_speed=500.0, speed_droop=0.0, bead_width=12.7)
disc = passes.TiltedDisc(process, relaxed_angle=units.deg(20), rotational_stiffness=6e5)   # the same process as the sequence
problem = passes.PassProblem(disc, bead, mean_cut=0.25, feed_rate=20.0)      # problem.target by exact volume

plan = passes.plan(problem)                                                  # method="inverse" | "pi" | "static" | "collocation"
plan.normal_force, plan.fly_height, plan.contour, plan.shortfall; plan.plot()
plan.simulate(model=disc.replace(specific_energy=14.0)).removal_rate         # forward model, same plan, another truth

loop = force.PI.design(crossover=units.hz(3.0), drive=force.table_drive())
force.margins(loop, delay_samples=1)                                         # GM, PM, Ms, f_b by the slope-limited measure, runout response
controller = force.ForceController(plan, loop)                               # two degrees of freedom; feedforward=False for PI alone

policy = weldbead.plan(weldbead.preset("P4").replace(model=process, bead_length=150.0, durations=range(12, 41, 4), stage=4.0, horizon=120.0))
tiers = weldbead.Hierarchy(policy, disc, loop, reestimate=True)              # one controller: sequence -> pass -> force
log = hwsim.run(hwsim.ForceTableStand(problem), tiers, rng=1)                # log["sequence"], log["pass"], log["force"]
log.plot(); hwsim.compare(hwsim.ForceTableStand(problem), {"replan": tiers, "fixed": weldbead.Hierarchy(policy, disc, loop, reestimate=False)}, parts=5, rng=0)
"""


BEADS = """
import hwsim
from sdpgrind import weldbead

prior = weldbead.CoefficientScatter(specific_energy=0.15, idle_power=0.15, friction_ratio=0.15)
problem = weldbead.preset("P4").replace(scatter=weldbead.Scatter(("K1", "K2", "mu"), (0.15, 0.15, 0.15), law="lognormal"),
                                        bead_scatter=prior, lead_length=15.0)
policy = weldbead.plan(problem, time_limit=10.0, memory_limit=1e9)      # method="cautious" | "certain"
policy.error, policy.status

promise = policy.risk(height=1.5, time_left=30.0, error=0.01)           # follows the learning loop in the model
promise.mean, promise.error["mean"], promise.finished, promise.height, promise.learning, promise.knowing

stand = hwsim.WeldBeadStand(problem)                                    # draws each bead, then each pass
log = hwsim.run(stand, weldbead.SequenceController(policy), parts=40, rng=0)
found = weldbead.identify(log, "scatter", method="components", model=problem.model)
found.scatter, found.bead_scatter, found.interval["friction_ratio"]     # pass and bead sd with 95 % limits
problem = problem.updated(found)

belief = weldbead.BeadEstimator(problem)                                # streaming, as used inside
belief.update(normal_force=50.0, tangential_force=18.0, grinding_power=800.0, removal_rate=60.0)
belief.estimate                                                         # K1, K2, mu, covariance, status

simple = policy.simplified(loss=0.003, force_step=1.0)
simple.loss; simple.operator_table("bead.html"); simple.operator_table("bead.csv")
"""


PLUNGE = """
import hwsim
from sdpgrind import plunge

problem = plunge.preset("simulation")                    # or "experiment", or plunge.CycleProblem(plunge.PlungeModel(...), stock=..., ...)
best = plunge.plan(problem)                              # method="exact" | "dp" | "collocation"
best.time, best.error; best.plot(); best.trajectory      # 12.0195 s

controller = plunge.CycleController(problem.replace(wear_flat_area=0.9*0.026), safety_margin=0.05)
grinder = hwsim.PlungeGrinder(problem)                   # truth: the problem's own model unless told otherwise; noise=None switches noise off
log = hwsim.run(grinder, controller, rng=0)
log.outcome                                              # time, slack, part_slack, roundness, burned
log = hwsim.run(grinder, controller, parts=12, rng=0, journal="series.db",      # killed? run it again: it resumes
                adapt=plunge.learning.MarginBounding(step=0.25, noise_buffer=0.005, rule="printed"))
controller = controller.replace(safety_margin=0.0)       # a confidence needs none
log = hwsim.run(grinder, controller, parts=12, rng=0, adapt=plunge.adaptation(problem))     # the recommended chain
hwsim.compare(grinder, {"ours": controller, "three stages": plunge.StagedController(problem)}, parts=20, rng=0).plot()

estimate = plunge.identify(log, "time_constant", method="output_error")     # value, sd, or status "not identified" with its reason
problem = problem.updated(estimate)
"""


LOCUS = """
import hwsim
from sdpgrind import locus

problem = locus.Problem(                                  # s: hidden state, c: controls; written once, for CasADi and for floats
    controls={"u": (0.0, 5.0), "v": (0.0, 10.0)}, hidden={"x": (0.2, 20.0)},
    cost=lambda s, c: (c.u - 1)**2 + (c.v - 4)**2,
    constraints=[locus.Varying(response=lambda s, c: s.x*c.v + 16 - 4*c.v,       # what is measured
                               limit=lambda s, c: 17 + c.u - 4*c.v)])            # what it must stay under
curve = locus.plan(problem)                               # pieces, events, folds, jumps; curve.plot(), .save(), .dataset
curve.at(x=1.0)                                           # .controls (2, 3), .multipliers, .response 7, .slope, .margin
curve.retrieve(u=2.1, v=2.8, response=7.0)                # the right point for a measurement: state inversion
design = locus.gains.design_gain(curve, along="v", x=(0.758, 1.721))   # .gain, .stable, .violation_free, .noise_gain, .drift_margin
controller = locus.LocusController(curve, along="v", gain=design.gain, x=(0.758, 1.721), start="feasible")
controller.step(response=9.0)                             # -> {"u": ..., "v": ...}

grinding = locus.preset("grinding")                       # "turning", "koren-example", ...: compiled tracing
curve = locus.plan(grinding)
log = hwsim.run(hwsim.AdaptiveGrinder(grinding), locus.LocusController(curve, along="infeed_rate"), parts=5, rng=0)   # gain: designed
log.outcome; log.plot()
"""


FINISHING = """
import hwsim
from sdpgrind import finishing as fin, units

surface = fin.preset("nominal").surface                            # or fin.Surface.bspline(control_points, degree=(3, 3)), .nurbs(...)
path = fin.hilbert(surface, order=5, mapping="equal_area")         # or fin.zigzag(surface, pitch=0.2, mapping="equal_spacing")
path.metrics(footprint_radius=0.8); path.plot()                    # lengths, gaps, cell-area CV, coverage, with the sampling used
problem = fin.FinishingProblem(path, robot=fin.Arm.generic(), contact_angle=units.deg(30), lever_arm=95.0,
                               heading="fixed", feed_rate=25.0)    # joint limits are the arm's
motion = fin.plan(problem)                                         # method="trapezoid" | "toppra" | "min_time"
motion.poses, motion.joints, motion.time, motion.worst_violation; motion.plot()     # names what is violated, and where

axis = fin.TorqueAxis()
controllers = {kind: fin.TorqueController(axis, motion, normal_force=1.11, kind=kind) for kind in ("constant", "pidff", "lqg")}
controllers["pidff"].poles                                         # always with the observer
log = hwsim.run(hwsim.FinishingCell(problem), controllers["lqg"], rng=0)            # force trace, feed achieved, roughness
hwsim.compare(hwsim.FinishingCell(problem), controllers, parts=5, rng=0).plot()

study = fin.Study.published("wang-2001")                           # or fin.Study(fin.study.orthogonal_array("L18"), factors, response, ratio="smaller")
study.anova(); study.best(); study.predict(study.best(), confirm=1); study.power(rng=0); study.next_runs(3); print(study.report())
"""


CENTERING = """
import centering
from sdpgrind import units

estimator = centering.GeometryEstimator(noise_sd=0.04, confidence=0.999, rel_tol=0.03, abs_tol=0.002)   # mm; exact model by default
for a, r in stream:                                # rad, mm
    estimator.update(angle=a, reading=r)
    if estimator.valid: break
estimator.estimate                                 # radius, offset, offset_angle, covariance; status says what limits it and the arc still needed
estimator.reset(keep_radius=True)                  # after a push

circle = centering.identify((angle, reading), "circle", tip_radius=3.75, loss="huber")    # the same Estimate, from a batch
profile = centering.Profile(angle, reading, tip_radius=3.75)
clean = profile.remove_roller_error().filter("gaussian", upr=50)
clean.roundness("MZC")                             # LSC, MCC, MIC, MZC: value, centre, contacts, certificate
clean.harmonics(upr_max=60); clean.plot(); clean.save("ring.nc")
stock = centering.setup.Stock(mean=0.15, sd=0.02, roundness=0.010, roundness_sd=0.004, sigmas=3.0)
centering.plan_changeover(profile, stock, finish_radius=61.9, gap=0.010, approach_rate=units.mm_per_min(1.56))   # position, time saved, probability of contact
"""

PUSHES = """
import centering, hwsim
from sdpgrind import units

problem = centering.preset("printed").replace(part=centering.push.Part(mass=18.9, radius=89.5), tolerance=0.0025)   # or "identified"
push = centering.plan_push(problem, offset=1.0, follow_gap=7.928, spindle_speed=units.rpm(20), push_speed=10.0)
push.lead_angle, push.stroke, push.time                                   # exact direction on the turning table
trace = push.simulate(); trace.peak_force, trace.free_slide, trace.energy_balance; trace.plot()

friction = centering.FrictionEstimator(problem); friction.update(trace)   # recursive, from force, slide and stop position
problem = problem.updated(friction.estimate)

strategy = centering.plan(problem, spindle_speed="scheduled")             # an sdp policy over offset and friction belief
strategy.plot(); strategy.save("strategy.nc")
ours = centering.CenteringController(strategy)
source = centering.PrintedController(problem)                             # energy balance + free-sliding rules + discrete correction

machine = hwsim.CenteringMachine(problem)
log = hwsim.run(machine, ours, rng=0); log.outcome                        # time, pushes, final offset, finished
hwsim.compare(machine, {"source": source, "ours": ours}, parts=50, rng=0).plot()
hwsim.run(hwsim.Recording(log), ours)                                     # replay: the same commands, or the first difference
"""


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    monkeypatch.chdir(tmp_path)
    pyplot.switch_backend("agg")
    yield tmp_path
    pyplot.close("all")


@pytest.fixture
def coarse(monkeypatch):
    """Plans are as exact as 1e-3 $ where the tour leaves it open; the lines of the README are run with the
    default, and what the tour says of values is looked at there.
    """
    from sdpgrind import weldbead

    monkeypatch.setattr(weldbead, "plan", partial(weldbead.plan, tolerance=1e-3))


@pytest.fixture
def few(monkeypatch):
    """Two parts tell whether it runs; the source's controller turns the table for minutes on each heavy part."""
    import hwsim

    compare = hwsim.compare
    monkeypatch.setattr(
        hwsim, "compare", lambda *said, parts, **more: compare(*said, parts=min(parts, 2), **more)
    )


def test_the_tour_runs_as_written(elsewhere, coarse):
    names: dict = {}
    exec(compile(TOUR, "tour", "exec"), names)
    assert names["policy"].problem == names["problem"].updated(names["estimate"])
    assert sorted(path.name for path in elsewhere.iterdir()) == ["policy.nc", "run.nc"]


def test_the_tour_of_the_three_tiers_runs_as_written(elsewhere, coarse, few):
    names: dict = {}
    exec(compile(TIERS, "tiers", "exec"), names)
    plan = names["plan"]
    # limited on the crests, where it leaves something standing
    assert plan.normal_force.max() == pytest.approx(90.0)
    assert plan.volume + plan.shortfall == pytest.approx(0.25 * 12.7 * 150.0, rel=1e-4)
    log = names["log"]
    assert log.outcome.passes.item() >= 1
    assert len(log["sequence"].time) and len(log["pass"].time) and len(log["force"].time)
    assert not list(elsewhere.iterdir())


@pytest.mark.slow
def test_the_tour_of_beads_that_are_learned_runs_as_written(elsewhere, monkeypatch):
    """But for the number of beads of its promise, 5000 for 0.01 $, and the tolerance of its plan."""
    from sdpgrind import weldbead
    from sdpgrind.weldbead.sequence import _promise

    monkeypatch.setattr(_promise, "MOST", 10)
    monkeypatch.setattr(_promise, "BATCH", 10)
    monkeypatch.setattr(weldbead, "plan", partial(weldbead.plan, tolerance=1e-2))
    names: dict = {}
    exec(compile(BEADS, "beads", "exec"), names)
    assert names["policy"].status in ("time limit", "tolerance reached")
    assert names["promise"].error["mean"] > 0.01 and 0 <= names["promise"].finished <= 1
    assert names["found"].bead_scatter == names["problem"].bead_scatter
    assert names["simple"].loss <= 0.003
    assert sorted(path.name for path in elsewhere.iterdir()) == ["bead.csv", "bead.html"]


def test_the_tour_of_the_plunge_cycle_runs_as_written(elsewhere):
    names: dict = {}
    exec(compile(PLUNGE, "plunge", "exec"), names)
    assert names["best"].time == pytest.approx(12.0195, abs=1e-4)
    assert not names["log"].outcome.burned.any() and names["log"].outcome.time[-1] < 1.02 * names["best"].time
    assert names["problem"].time_constant == names["estimate"]["time_constant"]
    assert {path.name.split("-")[0] for path in elsewhere.iterdir()} == {"series.db"}


def test_the_tour_of_the_locus_runs_as_written(elsewhere):
    names: dict = {}
    exec(compile(LOCUS, "locus", "exec"), names)
    design = names["design"]
    assert 0 < design.gain < design.violation_free < design.stable
    assert set(names["controller"].command) == {"u", "v"}
    assert names["log"].outcome.sizes["part"] == 5 and names["log"].outcome.slack.min() > -1.0  # W
    assert not list(elsewhere.iterdir())


def test_the_tour_of_finishing_runs_as_written(elsewhere, few, capsys):
    names: dict = {}
    exec(compile(FINISHING, "finishing", "exec"), names)
    motion, outcome = names["motion"], names["log"].outcome
    assert motion.worst_violation.held and len(motion.poses) == len(motion.joints) == len(motion.time)
    assert names["controllers"]["pidff"].poles.slowest < 40.0  # 1/s: slower than its observer alone
    assert (
        outcome.normal_force.item() == pytest.approx(1.11, abs=0.02)
        and 3e-3 < outcome.roughness_ra.item() < 5e-3
    )
    assert motion.mean_feed_rate < outcome.feed.item() < 25.0  # mm/s; the table overshoots at corners
    assert "normal_force" in capsys.readouterr().out
    assert not list(elsewhere.iterdir())


def test_the_tour_of_centering_runs_as_written(elsewhere):
    import hwsim
    import sdpgrind

    ring = hwsim.Ring(62.0, 0.002, 0.7, lobes={2: (1e-3, 0.1), 3: (2e-3, 1.0)})
    off, on = ring.replace(offset=3.6), ring  # first as it was laid down, then as it lies when it is centred
    probe = hwsim.Probe(off, samples_per_turn=360)
    far = probe.replace(noise_sd=0.04).scan(turns=2, rng=1)
    near = probe.replace(ring=on).scan(turns=4, rng=2)
    names = {
        "stream": list(zip(far.angle, far.reading, strict=True)),
        "angle": near.angle,
        "reading": near.reading,
    }
    exec(compile(CENTERING, "centering", "exec"), names)
    assert names["circle"].radius == pytest.approx(62.0, abs=1e-3)
    assert names["circle"].offset == pytest.approx(0.002, abs=1e-3)
    assert names["clean"].roundness("MZC").value < names["clean"].roundness("LSC").value < 6e-3
    assert sdpgrind.load("ring.nc") == names["clean"]
    assert [path.name for path in elsewhere.iterdir()] == ["ring.nc"]


@pytest.mark.filterwarnings("ignore:the tolerance of:UserWarning")  # slow pushes move the heavy part by more
def test_the_tour_of_a_centering_machine_runs_as_written(elsewhere, few, few_pushes):
    import sdpgrind

    names: dict = {}
    exec(compile(PUSHES, "pushes", "exec"), names)
    assert sdpgrind.load("strategy.nc") == names["strategy"]
    assert names["log"].outcome.finished[0] == 1 and names["log"].outcome.offset[0] <= 0.0025  # mm
    assert [path.name for path in elsewhere.iterdir()] == ["strategy.nc"]


def readme():
    return (ROOT / "README.md").read_text()


def commands():
    """The one-line commands of the README."""
    return [block.strip() for block in re.findall(r"```sh\n(.*?)```", readme(), re.S)]


@pytest.mark.slow
def test_the_lines_of_the_readme_run_and_print_what_it_says(elsewhere, capsys):
    (lines,) = re.findall(r"```python\n(.*?)```", readme(), re.S)
    assert len(lines.strip().splitlines()) <= 6  # five and a blank
    names: dict = {}
    exec(compile(lines, "README.md", "exec"), names)
    assert len(names["log"]) == 20
    action, penalty = capsys.readouterr().out.rsplit(maxsplit=1)
    said = "duration=6 s, feed_rate=12.5 mm/s, normal_force=50 N, mean_cut=0.344 mm"
    assert said in action and float(penalty) == pytest.approx(0.067, abs=6e-4)
    # The tour makes the same plan.
    (value,) = re.findall(r"policy\.value\(height=1\.0, time_left=24\.0\) *# ([\d.]+)", TOUR)
    assert names["policy"].value(height=1.0, time_left=24.0) == pytest.approx(float(value), abs=1e-5)


def test_each_command_of_the_readme_sets_up_everything():
    demo, job, tests = commands()
    for command in (demo, job, tests):
        assert "\n" not in command
        assert command.startswith("python3 -m venv .venv && .venv/bin/pip install ")
    assert demo.endswith(".venv/bin/hwsim demo --out demo")
    assert ".venv/bin/hwsim weldbead examples/weldbead.toml" in job
    assert tests.endswith(".venv/bin/python -m pytest")


def test_the_files_that_the_readme_names_exist():
    links = re.findall(r"\]\(([^)]+)\)", readme())
    assert links
    for link in links:
        assert (ROOT / link).exists(), link


def test_the_main_job_runs(elsewhere, capsys):
    """The command of the README for two parts and a plan of less accuracy.

    In this process, which has imported everything already: how commands end as processes is seen elsewhere.
    """
    job = commands()[1].split("&&")[-1].split()
    arguments = [str(ROOT / word) if word.startswith("examples/") else word for word in job[1:]]
    arguments[arguments.index("--parts") + 1] = "2"
    assert main([*arguments, "--tolerance", "1e-2"]) == 0
    # An --out of several levels is made as it is needed.
    kept = {path.name for path in (elsewhere / "runs" / "weldbead").iterdir()}
    assert {"policy.nc", "run.nc", "run.db", "policy.png", "run.png"} <= kept
    assert "planned" in capsys.readouterr().out
