"""
Scaling out
===========

One plan takes a second. A study takes thousands: every preset with every law, a sweep over charges, a million
simulated beads. Whatever takes long has an argument ``executor=`` and takes any executor of Python's
``concurrent.futures``: threads, processes, a cluster.

Two promises hold for all of them. Results do not depend on the executor nor on the number of workers, not
even in the last bit: the work is cut by the problem, never by the workers. And without an executor everything
runs here and now."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np

import hwsim
from sdpgrind import sdp, weldbead

problem = weldbead.preset("P1")

# %%
# What can be spread
# ------------------
# ============================================  ============================================================
# what                                          one piece of work
# ============================================  ============================================================
# ``sequence.sweep``, ``sequence.sensitivity``  one plan
# ``policy.simulate``                           a block of sequences
# ``hwsim.run``, ``hwsim.compare``              some parts (not with ``adapt``: a part needs the one before)
# ``sdp.plan`` with two or three coordinates    a block of the grid, at each stage
# ============================================  ============================================================
#
# A plan with one coordinate, such as the weld bead's, ignores the executor: its stages are so quick that
# waiting for workers would cost more than it gains.
#
# Threads
# -------
# The compiled parts of the solver let go of Python's lock, so threads help, and they need nothing else.

charges = {
    f"{rate:g} $/mm": problem.replace(height_charge=sdp.Charge(sdp.Linear(2.0), sdp.Linear(rate)))
    for rate in (4, 10, 25)
}
state = {"height": 1.0, "time_left": 24.0}

if __name__ == "__main__":  # the reason comes below
    with ThreadPoolExecutor(max_workers=2) as threads:
        values = weldbead.sequence.sweep(charges, **state, tolerance=1e-3, executor=threads)
    for name, value in values.items():
        print(f"grinding into the work costs {name}: {value:.4f} $ expected")
    print("the same without threads:", values == weldbead.sequence.sweep(charges, **state, tolerance=1e-3))

# %%
# Processes
# ---------
# A simulated part is mostly Python, and Python runs on one core a process. So processes help there. Start
# them by *spawn*, which is the same on every system and safe with compiled code; *fork* copies a process in
# whatever state its threads are.
#
# A spawned process begins by importing your script, to find the functions in it. Without a guard it would
# come to the line that starts processes, and start more. Hence the rule: what does work stands under ``if
# __name__ == "__main__":``, and only imports, definitions and what is quickly made stand at the top. A worker
# takes some seconds to start, since it imports the library: start an executor once and use it for everything.

if __name__ == "__main__":
    policy = weldbead.plan(problem, tolerance=1e-2)
    stand = hwsim.WeldBeadStand(problem, height=1.5, time=30.0)
    controller = weldbead.SequenceController(policy)
    here = hwsim.run(stand, controller, parts=100, rng=0)
    with ProcessPoolExecutor(max_workers=2, mp_context=get_context("spawn")) as processes:
        spread = hwsim.run(stand, controller, parts=100, rng=0, executor=processes)
        runs = policy.simulate(runs=100_000, height=1.5, time_left=30.0, rng=0, executor=processes)
    print("the same beads:", np.array_equal(here.outcome.penalty, spread.outcome.penalty))
    print(runs)

# %%
# What is sent to a process has to be picklable. Problems, policies and controllers of the library are. A
# function of your own is, if it stands at the top of a module; a lambda is not. ``sdp.check`` names the
# callbacks that are not:

own = sdp.Problem(
    [sdp.Axis("error", -3, 3, 61, "mm", below="stop", above="stop")],
    [
        sdp.Move(
            "bend",
            {"by": sdp.Levels(0, 5, 51)},
            sdp.Shift("error", lambda s, c: sdp.Normal(c.by, 0.1 * c.by)),
        )
    ],
    [sdp.Stop("done", sdp.Charge(under=sdp.Linear(1.0), over=sdp.Linear(4.0)))],
    sdp.Stages(3, 1.0, "hits_left", ""),
)

if __name__ == "__main__":
    print(sdp.check(own))

# %%
# A cluster
# ---------
# There is no distributed code in this library, because there is no need: a ``dask`` client has an executor,
# and so do MPI and many batch systems. With the extra ``dask`` installed, and for example two workers on this
# machine:
#
# .. code-block:: python
#
#    from dask.distributed import Client, LocalCluster
#
#    if __name__ == "__main__":
#        with LocalCluster(n_workers=2, threads_per_worker=1) as cluster, Client(cluster) as client:
#            log = hwsim.run(stand, controller, parts=100_000, rng=0, executor=client.get_executor())
#
# Replace ``LocalCluster`` by the address of a scheduler, and the same lines run on a thousand cores. (They
# are not run for this page, but the tests run them.) For series that take hours give ``hwsim.run`` a
# ``journal=`` as well: killed, it goes on where it was.
#
# Random numbers
# --------------
# ``rng=0`` is enough. Part number k always draws from the k-th child of that seed, whoever runs it. So more
# parts leave the first ones as they are, and two controllers in ``compare`` meet the same luck.
