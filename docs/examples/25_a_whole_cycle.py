"""
A whole cycle
=============

The pieces come together in a simulated machine: a slide with its drive, a probe, a force sensor, a table that
has to be run up, the tasks of a computer that share one processor, and rings whose friction is not what was
believed. The same controller would run on a real one."""

import matplotlib.pyplot as plt
import numpy as np

import centering
import hwsim
from sdpgrind import units

# %%
# One ring
# --------
# 0.8 kg, from somewhere between 1 and 10 mm to 2.5 µm. The controller measures while the table runs up, and
# pushes as soon as it is sure enough that waiting would cost more.
problem = centering.preset("printed").replace(
    part=centering.push.Part(mass=0.8, radius=61.95), tolerance=0.0025
)
strategy = centering.plan(problem)
ours = centering.CenteringController(strategy)
machine = hwsim.CenteringMachine(problem)
log = hwsim.run(machine, ours, rng=0)
outcome = log.outcome.isel(part=0)
print(
    f"{float(outcome.time):.2f} s, {int(outcome.pushes)} pushes, {1e3 * float(outcome.offset):.2f} µm off at the end"
)
log.plot()

# %%
# What the controller knew when it was sure enough to push, and at the end:
table = log["control"]
state, offset = table.state_planned.values, table.offset_planned.values
for k in np.flatnonzero(np.diff(state, prepend=-1) != 0):
    now = centering.cycle.CycleState(int(state[k]))
    if now in (centering.cycle.CycleState.WAIT, centering.cycle.CycleState.CENTERED):
        print(f"{float(table.time[k]):5.2f} s  {now.name.lower():9} offset {1e3 * offset[k]:8.2f} µm")

# %%
# Beside the source's controller
# ------------------------------
# The same rings, and the same speeds of the table. The source's controller pushes over the whole offset at
# the speed of the energy balance, aligns at the end of the push by times that are too long, and waits for its
# rule of validity before each.
source = centering.PrintedController(problem, scheduled=strategy)
both = hwsim.compare(machine, {"source": source, "ours": ours}, parts=5, rng=1)
for name in ("source", "ours"):
    found = both.outcome.sel(controller=name)
    print(
        f"{name:7} {float(found.time.mean()):5.2f} s, {float(found.pushes.mean()):4.1f} pushes, "
        f"{int(found.finished.sum())} of {found.sizes['part']} within tolerance"
    )
both.plot()

# %%
# One of your own
# ---------------
# A controller is any object with these names. This one measures a whole turn before each push, and believes
# in the nominal friction; whatever the machine measures comes in, whatever it accepts may go out.


class Mine:
    """Follow the rim for a turn, fit a circle, push by the nominal plan; again until the offset is small."""

    period, speed, gap = 0.01, 2.0, problem.limits.follow_gap  # s, rad/s, mm
    reads = {name: machine.measures[name] for name in ("angle", "slide", "probe", "pushing")}
    commands = machine.accepts

    def reset(self):
        self.rim, self.since = [], 1.0  # rad: by then the table has its speed

    def step(self, *, angle, slide, probe, pushing, **others):
        follow = {
            "spindle_speed": self.speed,
            "velocity": -25.0 * (probe + self.gap) if np.isfinite(probe) else 0.0,
        }
        if angle < self.since or pushing:
            return follow
        self.rim.append((angle, slide + probe))
        if angle < self.since + 2 * np.pi:
            return follow
        circle, self.rim = centering.fit_circle(*np.transpose(self.rim), tip_radius=machine.tip_radius), []
        if circle.offset < 0.9 * problem.tolerance:
            return {"finished": 1.0}
        push = centering.plan_push(problem, offset=circle.offset, spindle_speed=self.speed, push_speed=10.0)
        start = angle + (circle.offset_angle - push.lead_angle - angle) % (2 * np.pi)
        self.since = start + self.speed * (push.time + 0.5)
        return follow | {"profile": push.profile, "profile_angle": start}


mine = hwsim.run(machine, Mine(), parts=3, rng=1).outcome
print(
    f"{float(mine.time.mean()):.1f} s, {float(mine.pushes.mean()):.1f} pushes, {int(mine.finished.sum())} of 3 within tolerance"
)

# %%
# A part that nobody has pushed yet
# ---------------------------------
# Its friction need not be known before: a few pushes of a cycle that is planned with a guess tell it. No push
# is made for that alone. Here 18.9 kg that slides better than was guessed; parts differ by some 8 %.
guess = centering.preset("printed").replace(pushes_max=4)
slippery = hwsim.CenteringMachine(guess, truth=guess.model.replace(mu_static=0.16, mu_kinetic=0.11))
tried = hwsim.run(slippery, centering.PrintedController(guess), parts=2, rng=2)
found = [centering.identify(tried, "friction", problem=guess, part=part, throw=False) for part in range(2)]
for each, static, kinetic in zip(
    found, tried.outcome.true_mu_static, tried.outcome.true_mu_kinetic, strict=True
):
    print(
        f"static {each['mu_static']:.3f} +- {each.sd[0]:.3f} (true {float(static):.3f}), "
        f"kinetic {each['mu_kinetic']:.3f} +- {each.sd[1]:.3f} (true {float(kinetic):.3f})"
    )
friction = {name: float(np.mean([each[name] for each in found])) for name in ("mu_static", "mu_kinetic")}
known = guess.replace(pushes_max=60, **friction)  # for centering.plan
print(f"guessed {guess.model.mu_kinetic:.3f}, planned with {known.model.mu_kinetic:.3f}")

# %%
# A film strip
# ------------
# The centre after each push, of both, on the same ring. The angle is that on the table; the radius is
# logarithmic.
figure, axes = plt.subplots(1, 2, figsize=(9, 4.6), layout="constrained", subplot_kw={"projection": "polar"})
worst = int(np.argmax(both.outcome.pushes.sel(controller="source").values))
for axis, name in zip(axes, ("source", "ours"), strict=True):
    part = both.outcome.sel(controller=name).isel(part=worst)
    centers = np.column_stack([part.center_x, part.center_y])
    centering.circle.plot_centers(centers[np.isfinite(centers[:, 0])], problem.tolerance, ax=axis)
    axis.set_title(f"{name}: {int(part.pushes)} pushes, {float(part.time):.1f} s")

# %%
# ``hwsim centering --preset printed --out DIR`` keeps such a strip of the last part, with what tip and rim
# did in each push; ``--live`` shows the chart in the terminal while the machine runs; ``--source`` compares.
#
# The tasks of its computer
# -------------------------
# Control, data, model and communication share one processor; a more urgent task interrupts a less urgent one.
# Time is counted in whole nanoseconds, so that 60 Hz does not drift, and the same seed gives the same trace,
# byte for byte. Here the model task gets too much to do:
busy = hwsim.Scheduler(
    [
        hwsim.Task("control", period=0.01, priority=1, execution_time=(0.0005, 0.00005), jitter=2e-5),
        hwsim.Task("model", angle_step=units.deg(5), priority=3, execution_time=(0.006, 0.002)),
        hwsim.Task("communication", period=0.1, priority=4, execution_time=(0.005, 0.0015)),
    ],
    spindle_speed_max=units.rpm(100),
)
# s, rad/s, rad/s^2: run up, then 100 turns a minute
turning = [[1.0, 0.0, units.rpm(100)], [1.0, units.rpm(100), 0.0]]
schedule = busy.run(2.0, rng=0, spindle=turning)
for task, line in schedule.report.items():
    print(task, line)
schedule.plot()

# %%
# Replay
# ------
# A log is a machine, too: it answers with what was recorded, and says whether the controller commands what it
# commanded then, to the last entry of the profile of a push.
again = hwsim.run(hwsim.Recording(log), ours).outcome.isel(part=0)
print("same commands" if again.same else f"differs at {float(again.difference_time)} s")
changed = centering.CenteringController(strategy, settings=centering.CycleSettings(margin=0.6))
again = hwsim.run(hwsim.Recording(log), changed).outcome.isel(part=0)
print(
    f"with another margin: first difference at {float(again.difference_time):.2f} s, in {again.difference_name.item()}"
)

# %%
# What the host is told
# ---------------------
# A link delays and loses. A courier on either side loses no record, even where the link breaks in between.
sent = [f"push {k}" for k in range(40)]
near, far = hwsim.QueueLink(latency=0.02, loss=0.2).start(rng=0)
at_machine, at_host, arrived = hwsim.Courier(near), hwsim.Courier(far), []
for tick in range(2000):
    now = tick / 100.0
    if tick < 40:
        at_machine.send(sent[tick].encode())
    if tick == 20:
        near.close()
    if tick == 100:
        near, far = hwsim.QueueLink(latency=0.02, loss=0.2).start(rng=1)
        at_machine.attach(near)
        at_host.attach(far)
    at_machine.advance(now)
    at_host.advance(now)
    arrived += [record.decode() for record in at_host.receive()]
    if len(arrived) == len(sent):
        break
print(f"all {len(arrived)} records in order after {now:.1f} s" if arrived == sent else "something is missing")

# %%
# When the cable is pulled
# ------------------------
# After a second the cable is pulled: the host is silent; 0.2 s later the watchdog stops the spindle and draws the slide
# back. Once there is a cable again, the host gets every step that it missed. This is simulated; between real computers
# the machine has a watchdog of its own and the cable carries OPC UA (:doc:`/machines`).
cable = hwsim.QueueLink(latency=0.005)
near, far = cable.start(rng=0)
at_machine, at_host, steps = hwsim.Courier(near), hwsim.Courier(far), 0
safe = {"spindle_speed": 0.0, "retract": 1.0}
guarded = hwsim.Watchdog(ours, at_machine, timeout=0.2, safe_command=safe)
guarded.reset()
part = machine.start(np.random.default_rng(0))
measured = part.step({}, 0)
while not part.done:
    measured, steps = part.step(guarded.step(**measured), 10), steps + 1
    if part.time < 1000:  # ticks of 1 ms
        at_host.advance(part.time / 1000)
    else:
        near.close()
print(f"the host is silent from 1 s on; made safe at {part.time / 1000:.2f} s: {guarded.tripped}")

received = at_host.receive()
near, far = cable.start(rng=1)
at_machine.attach(near)
at_host.attach(far)
now = at_machine.time
while at_machine.waiting:
    now += 0.01
    at_machine.advance(now)
    at_host.advance(now)
    received += at_host.receive()
print(f"{len(received)} records of {steps} steps have arrived")
plt.show()
