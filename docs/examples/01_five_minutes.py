"""
Five minutes with the planner
=============================

A weld bead stands 1.5 mm above the sheet. A disc grinder takes it off in passes, and in 30 seconds the part
has to move on. How much a pass removes can be predicted on average only: two passes with the same settings
differ by 15 % and more. Grinding too little leaves work for somebody else. Grinding into the sheet is worse.

What should the first pass be? What should the second be, once the bead has been measured again? And when is
it better to stop? That is what a plan answers."""

# %%
# The process
# -----------
# First the physics: how much power removes how much metal. These numbers come from cutting tests; how to get
# them from measurements is the subject of :doc:`04_law_and_attribution`. Everything is in mm, s, N, J and W.

import hwsim
import sdpgrind
from sdpgrind import sdp, weldbead

process = weldbead.GrindingProcess(
    specific_energy=10.0,  # J to remove one mm^3
    idle_power=100.0,  # W that are lost before anything is removed
    friction_ratio=0.3,  # tangential over normal force
    disk_radius=85.0,  # mm
    free_speed=500.0,  # rad/s of the disc without load
    speed_droop=0.0,  # loss of speed under torque, rad/(s N mm)
    bead_width=12.5,  # mm
)
print(f"Below {process.threshold_force:.2f} N the disc only rubs.")
print(f"A pass at 12.5 mm/s and 50 N removes {process.mean_cut(50.0, 12.5):.3f} mm on average.")

# %%
# The problem
# -----------
# Then the job: how long a pass may take, the strongest force, how the depth scatters, and what errors cost. A
# height of 0 mm is the target. Here a mm of metal left costs 2 $, a mm ground into the sheet 10 $. The ratio
# of the two matters most: it decides how boldly the last pass should go for the target.

problem = weldbead.SequenceProblem(
    process,
    bead_length=50.0,  # mm
    reset_time=2.0,  # s to go back and to measure the bead
    durations=range(6, 21, 2),  # s that a pass may take, reset included
    force_max=50.0,  # N
    burn_limit=None,  # this steel does not burn at 50 N
    scatter=weldbead.Scatter("C1", 0.15, law="rayleigh"),
    height_max=2.0,  # mm: the highest bead that the plan shall know
    horizon=60.0,  # s: the longest time that the plan shall know
    stage=2.0,  # s: the lattice of time
    height_charge=sdp.Charge(under=sdp.Linear(2.0), over=sdp.Linear(10.0)),
)

# %%
# The plan
# --------
# One call solves it for every height and every time left. The plan knows how far it is from exact.

policy = weldbead.plan(problem, tolerance=1e-4)
print(policy)
print(f"error at most about {policy.error:.1e} $")

# %%
# Ask it what to do now:

print(policy.action(height=1.5, time_left=30.0))
print(f"expected penalty: {policy.value(height=1.5, time_left=30.0):.4f} $")

# %%
# The first pass is a strong one. Say that it left 0.64 mm and that 18 s remain. Look it up again:

print(policy.action(height=0.64, time_left=18.0))

# %%
# And with 0.05 mm left, 6 s before the deadline? One light pass, a little above the force below which the
# disc only rubs. With 4 s left there is no time for a pass, and the plan says stop.

print(policy.action(height=0.05, time_left=6.0))
print(policy.action(height=0.05, time_left=4.0))

# %%
# The whole plan in one picture: what it is expected to cost, how long the next pass should take, how hard it
# should press. Where the bead is high the force is at its limit. Near the target it falls, and it falls more
# gently the more time is left: there will be another pass to correct this one.

_ = policy.plot()

# %%
# How sure is that? The expected penalty is a mean. The distribution behind it is known too, without
# Monte-Carlo, and how far:

print(policy.risk(height=1.5, time_left=30.0, confidence=0.95))

# %%
# Run it
# ------
# A plan is followed by a controller, and a controller runs a machine. Here the machine is simulated: the
# stand draws what each pass really removes, and measures heights, powers and forces with noise. Five hundred
# beads:

stand = hwsim.WeldBeadStand(problem, height=1.5, time=30.0)
log = hwsim.run(stand, weldbead.SequenceController(policy), parts=500, rng=3)

penalty = log.outcome.penalty
print(f"planned  {float(log.outcome.penalty_planned.mean()):.4f} $ a bead")
print(f"realised {float(penalty.mean()):.4f} +- {float(penalty.std() / len(log) ** 0.5):.4f} $ a bead")

# %%
# Most beads cost a few cents; a few are ground deep and cost many times the mean. With a law as lopsided as
# this, some hundreds of beads are needed before a mean says much.

_ = log.plot()

# %%
# Keep it
# -------
# Plans and logs are files, and one function opens them all. The problem is inside: a plan that was loaded can
# be looked up, simulated and planned again.

import tempfile
from pathlib import Path

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "policy.nc"
    policy.save(path)
    print(sdpgrind.load(path).action(height=1.5, time_left=30.0))

# %%
# Next: :doc:`02_reading_a_policy`. The same job from the command line, with its numbers in a file: ``hwsim
# weldbead examples/weldbead.toml --parts 20 --out runs/weldbead``.
