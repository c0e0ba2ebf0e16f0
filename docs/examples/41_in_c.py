"""
In C
====

A controller becomes C99 that gives the same bits. It is compiled, run, compared, and closes the loop in place of the
controller it was made from."""

import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import hwsim
import sdpgrind
from sdpgrind import plunge

folder = TemporaryDirectory()
problem = plunge.preset("simulation")
controller = plunge.StagedController(problem)
stages = sdpgrind.export(controller, Path(folder.name) / "stages")
print(stages.promise)
print("\n".join((stages.path / "stages.h").read_text().splitlines()[24:52]))

# %%
# The self-test
# -------------
# It goes with the C, to whatever target. Here the target is this computer.
compiler = shutil.which("gcc")
if compiler is None:
    print("no C compiler here: the C is written, and not run")
else:
    sources = [str(path) for path in sorted(stages.path.glob("*.c"))]
    program = str(Path(folder.name) / "t")  # not into the export, which is replaced as a whole
    subprocess.run(
        [compiler, "-std=c99", "-O2", "-ffp-contract=off", *sources, "-lm", "-o", program], check=True
    )
    print(subprocess.run([program], capture_output=True, text=True, check=True).stdout.strip())

# %%
# Against the library
# -------------------
# States, outputs and status after every step, with missing readings, outliers and restarts, at several levels of optimisation.
# A compiler that is not found is named.
found = stages.check(states=5_000, compilers=["gcc"], levels=["-O0", "-O2"])
print(found.status, found.builds, "not found:", found.missing)

# %%
# In the loop
# -----------
# Nothing but C decides, and no part differs in any bit.
if compiler is not None:
    grinder = hwsim.PlungeGrinder(problem)
    log = hwsim.run(grinder, stages.controller(), parts=5, rng=0)
    assert log.outcome.identical(hwsim.run(grinder, controller, parts=5, rng=0).outcome)
    print(log.outcome["time"].values.round(2), "s")
folder.cleanup()
