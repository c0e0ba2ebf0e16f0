"""Exports in C against the library: ``python benchmarks/exports.py [--only NAME] [--things NAME ...]``.

Bits of each thing by each compiler and level, loops in hwsim with C inside, mutants that the self-test finds,
branches that it reaches, time of a step.
"""

import argparse
import ctypes
import importlib.util
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from exports_mutants import FLAGS, mutants
from exports_things import THINGS, along, bead, cycle, ring, torque
from measure import clock

import centering
import hwsim
import sdpgrind
from centering.circle._estimator import estimator as of_rings
from sdpgrind import weldbead
from sdpgrind.codegen import Exported, Recipe
from sdpgrind.codegen._files.shell import reset_state
from sdpgrind.codegen._files.vectors import rows_of
from sdpgrind.codegen._proof.builds import TARGETS
from sdpgrind.codegen._proof.check import LEVELS
from sdpgrind.codegen._proof.compilers import compiled

NATIVE = {
    "gcc": ("-O2 -march=native -std=gnu99 -ffp-contract=fast", TARGETS),
    "clang": ("-O2 -march=native -std=gnu99 -ffp-contract=on", ("sanitizers",)),
}
"""As each compiler contracts by default in its GNU mode, for this processor: the C says "off"; further builds."""

# -- bits --------------------------------------------------------------------------------------------------


def bits(name: str, steps: int) -> None:
    """Print the steps that differ from the library, of many by gcc -O2 and of a tenth by all builds."""
    with tempfile.TemporaryDirectory() as kept:
        made = sdpgrind.export(THINGS[name](), Path(kept) / "thing")
        steps = steps if made.recipe.program is None else steps // 100  # a program takes a millisecond
        begin = clock()
        most = made.check(steps, ("gcc",), levels=("-O2",), targets=(), rng=1)
        rate = steps / (clock() - begin)
        runs = [
            made.check(steps // 10, (one,), levels=(*LEVELS, level), targets=targets, rng=2)
            for one, (level, targets) in NATIVE.items()
        ]
    told = ", ".join(one for run in runs for one in run.missing) or "none"
    each = {build: differ for run in runs for build, differ in run.builds.items()}
    differ = ", ".join(f"{build} {count}" for build, count in each.items() if count) or "0"
    print(
        f"| {name} | {most.differing} | {differ} of {len(each)} builds | {told} | {rate:.0f} |",
        flush=True,
    )


# -- loops -------------------------------------------------------------------------------------------------


def loops(parts: int) -> None:
    print(f"\n## {parts} parts in hwsim, C inside\n| what | differing outcomes, tables |\n|---|---|")
    with tempfile.TemporaryDirectory() as kept:
        for name, run in (
            ("bead", _bead),
            ("cycle", _cycle),
            ("torque", _torque),
            ("along", _along),
            ("ring", _ring),
        ):
            pairs = run(Path(kept) / name, parts)
            print(f"| {name} | {_differing(*pairs)} |", flush=True)


def _differing(log: Any, wanted: Any) -> list[str]:
    """Return names of what differs: outcomes, and what was read and commanded in each tier."""
    found = [str(name) for name in wanted.outcome if not log.outcome[name].identical(wanted.outcome[name])]
    for tier in wanted.tiers:
        names = [str(name) for name in wanted[tier] if not str(name).endswith("_planned")]
        pairs = {name: (log[tier][name], wanted[tier][name]) for name in names}
        found += [f"{tier}.{name}" for name, (one, other) in pairs.items() if not one.identical(other)]
    return found


def _bead(place: Path, parts: int) -> tuple[Any, Any]:
    policy = bead()
    plant, made = hwsim.WeldBeadStand(policy.problem), sdpgrind.export(policy, place)
    controllers = made.controller(), weldbead.SequenceController(policy)
    return tuple(hwsim.run(plant, one, parts=parts, rng=0) for one in controllers)


def _cycle(place: Path, parts: int) -> tuple[Any, Any]:
    controller = cycle()
    plant, made = hwsim.PlungeGrinder(controller.problem), sdpgrind.export(controller, place)
    return tuple(hwsim.run(plant, one, parts=parts, rng=0) for one in (made.controller(), controller))


def _torque(place: Path, parts: int) -> tuple[Any, Any]:
    controller = torque()
    plant, made = hwsim.FinishingCell(controller.motion.problem), sdpgrind.export(controller, place)
    return tuple(hwsim.run(plant, one, parts=parts, rng=0) for one in (made.controller(), controller))


def _along(place: Path, parts: int) -> tuple[Any, Any]:
    controller = along()
    plant, made = hwsim.AdaptiveGrinder(controller.curve.problem), sdpgrind.export(controller, place)
    return tuple(hwsim.run(plant, one, parts=parts, rng=0) for one in (made.controller(), controller))


def _ring(place: Path, parts: int) -> tuple[Any, Any]:
    """Centring with the C in place of the estimator's kernel: it works on the same array."""
    problem = centering.preset("printed").replace(mass=0.8, radius=44.45)
    plant = hwsim.CenteringMachine(problem)
    made: dict[tuple[float, ...], Any] = {}

    def step(state: Any, angle: float, reading: float) -> int:
        settings = tuple(state[:14])
        if settings not in made:
            recipe = replace(ring().__export__(), state=state)
            made[settings] = sdpgrind.export(recipe, f"{place}_{len(made)}", name="ring").controller()
        out = np.zeros(6)
        return int(made[settings]._library.step(state, np.array([angle, reading]), out))

    strategy = centering.plan(problem)
    wanted = hwsim.run(plant, centering.CenteringController(strategy), parts=parts, rng=0)
    with mock.patch.object(of_rings, "update_step", step):
        log = hwsim.run(plant, centering.CenteringController(strategy), parts=parts, rng=0)
    assert made, "the C was not called"
    return log, wanted


def folder(parts: int, math: str) -> None:
    """Print how far a loop with functions of a folder is from one with those of the C library."""
    print(f"\n## {parts} parts in hwsim, C with functions of a folder inside")
    if not math:
        print("not run: --math names no folder")
        return
    controller = cycle()
    grinder = hwsim.PlungeGrinder(controller.problem)
    with tempfile.TemporaryDirectory() as kept:
        c = sdpgrind.export(controller, Path(kept) / "cycle", math=math).controller()
    logs = [hwsim.run(grinder, one, parts=parts, rng=0) for one in (c, controller)]
    print("| what | differing | largest |\n|---|---|---|")
    for tier in ("outcome", *logs[1].tiers):
        tables = [log.outcome if tier == "outcome" else log[tier] for log in logs]
        for name in tables[0]:
            off = np.abs(np.asarray(tables[0][name], float) - np.asarray(tables[1][name], float))
            print(f"| {tier}.{name} | {np.count_nonzero(off > 0.0)} | {np.nanmax(off):.3g} |", flush=True)


# -- the self-test -----------------------------------------------------------------------------------------


def fast(name: str) -> None:
    """Print whether the self-test finds that multiply-adds are fused: clang ignores the pragma of the C."""
    with tempfile.TemporaryDirectory() as kept:
        made = sdpgrind.export(THINGS[name](), Path(kept) / "thing")
        sources = sorted(made.path.glob("*.c"))
        command = [
            "clang",
            "-std=c99",
            "-O2",
            "-mfma",
            "-ffp-contract=fast",
            "-w",
            *sources,
            "-lm",
            "-o",
            "t",
        ]
        if not shutil.which("clang") or subprocess.run(command, cwd=kept).returncode:
            print(f"| {name} | not run | |", flush=True)
            return
        run = subprocess.run(["./t"], cwd=kept, capture_output=True, text=True)
        print(
            f"| {name} | {'found' if run.returncode == 1 else 'not found'} | {run.stdout.strip().splitlines()[-1]} |",
            flush=True,
        )


def branches(name: str) -> None:
    """Print the share of branches of the C that the self-test takes, by gcov, and of those that are no guards."""
    with tempfile.TemporaryDirectory() as kept:
        made = sdpgrind.export(THINGS[name](), Path(kept) / "thing")
        taken, guards, every = branches_taken(made)
        reached = taken / max(every - guards, 1)
        print(
            f"| {name} | {every} | {100 * taken / every:.1f} % | {guards} | {100 * reached:.1f} % |",
            flush=True,
        )


def branches_taken(made: Exported) -> tuple[int, int, int]:
    """Return branches taken at least once, guards among the others, and all.

    Guards are named in the C, ``/* guard */``, or ends of loops that are always left before their bound.
    """
    taken = guards = every = 0
    line = ""
    for text in _covered(made).splitlines():
        found = re.match(r"branch +\d+ (?:taken (\d+)|never executed)", text)
        if not found:
            line = text if re.match(r" *[^ ]+: *\d+:", text) else line
            continue
        every += 1
        if int(found[1] or 0):
            taken += 1
        elif "/* guard */" in line or re.search(r": +for \(", line):
            guards += 1
    return taken, guards, every


def _covered(made: Exported) -> str:
    """Return the source with the counts of gcov after a run of the self-test."""
    with tempfile.TemporaryDirectory() as kept:
        for path in made.path.glob("*.[ch]"):
            shutil.copy(path, kept)
        sources = sorted(path.name for path in Path(kept).glob("*.c"))
        subprocess.run(["gcc", *FLAGS, "-O0", "--coverage", *sources, "-lm", "-o", "t"], cwd=kept, check=True)
        subprocess.run(["./t"], cwd=kept, check=True, capture_output=True)
        name = str(made.manifest["name"])
        command = ["gcov", "-b", "-c", "-o", f"t-{name}.gcda", f"{name}.c"]
        subprocess.run(command, cwd=kept, check=True, capture_output=True)
        return (Path(kept) / f"{name}.c.gcov").read_text()


# -- time --------------------------------------------------------------------------------------------------


_LOOP = """\
#include "thing.h"
#include <string.h>
double thing_loop(thing_state *state, int64_t count, const double *rows, const uint8_t *resets);
double thing_loop(thing_state *state, int64_t count, const double *rows, const uint8_t *resets)
{
    double total = 0.0;
    for (int64_t k = 0; k < count; k++) {
        thing_input in;
        thing_output out;
        memcpy(&in, &rows[k * (int64_t)(sizeof in / sizeof(double))], sizeof in);
        memset(&out, 0, sizeof out);
        if (resets[k] != 0) {
            thing_reset(state);
        }
        thing_step(state, &in, &out);
        total += *(double *)&out;
    }
    return total;
}
"""


def speed(name: str, steps: int) -> None:
    """Print the time of a step in a compiled loop: C by gcc -O2, and numba."""
    with tempfile.TemporaryDirectory() as kept:
        made = sdpgrind.export(THINGS[name](), Path(kept) / "thing")
        recipe = made.recipe
        if recipe.program is not None:
            print(f"| {name} | a program between its kernels: not in a loop of numba | | |", flush=True)
            return
        rows, resets = rows_of(recipe, np.random.default_rng(1), steps)
        usable = recipe.usable(rows)
        rows, resets = np.ascontiguousarray(rows[usable]), np.diff(np.cumsum(resets)[usable], prepend=0) > 0
        runs = _c_loop(made, Path(kept), rows, resets), _numba_loop(recipe, Path(kept), rows, resets)
        for run in runs:
            run()
        times = np.array([[_timed(one) for one in runs] for _ in range(15)])
        found = 1e9 * times.min(axis=0) / len(rows)
    print(f"| {name} | {found[0]:.0f} | {found[1]:.0f} | {found[0] / found[1]:.2f} |", flush=True)


def _timed(run: Callable[[], object]) -> float:
    begin = clock()
    run()
    return clock() - begin


def _c_loop(made: Exported, folder: Path, rows: Any, resets: Any) -> Callable[[], object]:
    (folder / "loop.c").write_text(_LOOP)
    sources = [made.path / "thing.c", folder / "loop.c"]
    compiled("gcc", sources, folder / "loop.so", "-shared", "-fPIC", f"-I{made.path}", "-O2")
    library, state = ctypes.CDLL(str(folder / "loop.so")), np.zeros(made.recipe.state.size)
    library.thing_loop.restype = ctypes.c_double

    def run() -> object:
        places = [ctypes.c_void_p(one.ctypes.data) for one in (state, rows, resets)]
        library.thing_reset(places[0])
        return library.thing_loop(places[0], ctypes.c_int64(len(rows)), *places[1:])

    return run


def _numba_loop(recipe: Recipe, folder: Path, rows: Any, resets: Any) -> Callable[[], object]:
    """Loop as that of the C: rows in, the first output summed."""
    law = "".join(f"l{k}, " for k in range(len(recipe.law)))
    after = "".join(f"a{k}, " for k in range(len(recipe.after)))
    given = "".join(f"rows[k, {j}], " for j in range(rows.shape[1]))
    file = folder / "loop_of_step.py"
    file.write_text(
        "from sdpgrind.base.compiling.compiled import compiled\n\n\n"
        "def made(step):\n"
        '    @compiled(error_model="numpy")\n'
        f"    def loop(state, {law}{after}rows, resets, fresh, out):\n"
        "        total = 0.0\n"
        "        for k in range(rows.shape[0]):\n"
        "            if resets[k]:\n"
        "                for j in range(state.size):\n"
        "                    state[j] = fresh[j]\n"
        "            for j in range(out.size):\n"
        "                out[j] = 0.0\n"
        f"            step(state, {law}{given}{after}out)\n"
        "            total += out[0]\n"
        "        return total\n\n"
        "    return loop\n"
    )
    spec = importlib.util.spec_from_file_location(file.stem, file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    loop, out, fresh = module.made(recipe.step), np.zeros(len(recipe.outputs)), reset_state(recipe)
    return lambda: loop(fresh.copy(), *recipe.law, *recipe.after, rows, resets, fresh, out)


PARTS = {
    "bits": lambda asked: _each(
        "1e6 steps, gcc -O2: differ | 1e5 steps each: differ | left out | steps a second",
        lambda one: bits(one, asked.steps),
    ),
    "loops": lambda asked: loops(asked.parts),
    "folder": lambda asked: folder(asked.parts, asked.math),
    "mutants": lambda asked: _each(
        "self-test finds | without effect | missed", lambda one: mutants(one, 100, asked.steps)
    ),
    "fast": lambda asked: _each("clang -ffp-contract=fast | told", fast),
    "branches": lambda asked: _each("branches | taken | guards | taken of others", branches),
    "speed": lambda asked: _each("C, ns | numba, ns | ratio", lambda one: speed(one, 20_000)),
}


def _each(told: str, run: Callable[[str], None]) -> None:
    print(f"\n| what | {told} |\n|{'---|' * (told.count('|') + 2)}")
    for name in THINGS:
        run(name)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument("--parts", type=int, default=1000)
    parser.add_argument("--math", default="", metavar="FOLDER", help="C sources of a libm")
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--things", nargs="*", default=list(THINGS))
    asked = parser.parse_args()
    for name in [one for one in THINGS if one not in asked.things]:
        del THINGS[name]
    for name, run in PARTS.items():
        if asked.only in (None, name):
            run(asked)


if __name__ == "__main__":
    main()
