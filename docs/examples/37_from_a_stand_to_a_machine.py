"""
From a stand to a machine
=========================

A controller that works on a simulated stand is taken to a real machine in three steps: it is rehearsed against the stand
behind OPC UA, which a client cannot tell from a machine; it listens to the machine's own control, in shadow; then it
commands. It is the same object in all of them. Everything here runs on this computer; on a real machine only the address
is another one, and keys and a password take the place of ``security="none"``.

This is no safety function: it replaces no interlock, limit switch or emergency stop of a machine.
"""

import matplotlib.pyplot as plt

import hwsim
from sdpgrind import plunge

problem = plunge.preset("simulation").replace(stock=0.02)  # mm; a short part
stand, controller = hwsim.PlungeGrinder(problem), plunge.CycleController(problem)
HERE = "opc.tcp://127.0.0.1:0"  # port 0: any that is free

# %%
# Lockstep: the same numbers over the wire
# ----------------------------------------
# In lockstep the stand advances by the steps of its client, and a run is that of a simulation to the last bit.

with hwsim.serve(stand, HERE, speed=None, security="none") as server:
    there = hwsim.run(hwsim.OpcuaPlant(server.url, security="none"), controller, parts=3, rng=1)
here = hwsim.run(stand, controller, parts=3, rng=1)
print("the same outcomes:", all((there.outcome[name] == here.outcome[name]).all() for name in here.outcome))

# %%
# Rehearsal: a machine that keeps time
# ------------------------------------
# Free running, the stand keeps wall time and has a watchdog, as a machine should: without a new heartbeat for 0.5 s it
# makes itself safe and takes no command until the next part. ``check`` reads the machine and moves nothing.

live = hwsim.Live(safe={"retract": 1.0}, deadline=0.5)
with hwsim.serve(stand, HERE, security="none") as server:
    machine = hwsim.OpcuaPlant(server.url, security="none")
    print(hwsim.check(machine, controller))
    log = hwsim.run(machine, controller, live=live)
outcome = log.outcome.isel(part=0)
print(f"aborted: {int(outcome.aborted)}, readings of bad quality: {int(outcome.bad_quality)}")

# %%
# A command now reaches the wheel a little later than in a simulation, and a reading is a little older. Both stand in the
# log: how old the readings were, and how late the steps. A plan that goes to the burn limit to the micrometre does not bear
# a delay that its controller does not know: one of a whole sample belongs into the job, as ``Drive(feed_delay=...)``.

table = log["controller"].isel(row=slice(0, -1))  # the last row has the final measurement
figure, axes = plt.subplots(figsize=(6, 3.3), layout="constrained")
axes.plot(table.time, 1e3 * table.sample_age, ".", label="age of the readings")
axes.plot(table.time, 1e3 * table.release_delay, ".", label="start of the step after its release")
axes.set(xlabel="time in the part, s", ylabel="ms", title="Delays on the way to a machine and back")
axes.set_ylim(bottom=0.0)
figure.legend(loc="outside lower center", ncols=2)

# %%
# Shadow: listen beside the real control
# --------------------------------------
# Here the machine has its own control. In shadow nothing is written to it; the log has what the controller would have
# commanded beside what the machine's control commanded.

with hwsim.serve(stand, HERE, security="none", controller=controller) as server:
    machine = hwsim.OpcuaPlant(server.url, security="none")
    shadow = hwsim.run(machine, controller, live=hwsim.Live(shadow=True, deadline=0.5))
    print("write lists and calls that reached the machine:", server.state["writes"])
would, did = (shadow["controller"][name].values for name in ("command_rate_command", "command_rate_actual"))
print(f"{would.size} steps; both fed at {did[2]:.4f} mm/s in the third: {abs(would[2] - did[2]) < 1e-9}")

# %%
# What goes wrong
# ---------------
# Whatever ends a part, the machine gets the safe command first; nothing follows it.


class Hanging(plunge.CycleController):
    """Its 20th step never ends."""

    def reset(self):
        super().reset()
        self.count = 0

    def step(self, **measured):
        self.count += 1
        while self.count == 20 and live.state != "aborted" and not live.tripped:
            pass
        return super().step(**measured)


live = hwsim.Live(safe={"retract": 1.0}, deadline=0.5)
with hwsim.serve(stand, HERE, security="none") as server:
    machine = hwsim.OpcuaPlant(server.url, security="none")
    try:
        hwsim.run(machine, Hanging(problem), live=live)
    except hwsim.Aborted as error:
        last = error.log.outcome.isel(part=-1)
        print(f"made safe by the {last.safe_by.values}: {last.abort_reason.values}")

plt.show()
