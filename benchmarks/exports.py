"""Exports in C against the library: ``python benchmarks/exports.py [--only NAME] [--parts N] [--steps N]``.

Loops in hwsim with C inside, mutants that the self-test finds, branches that it reaches, time of a step.
"""

import argparse
import random
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from measure import clock

import centering
import hwsim
import sdpgrind
from centering.circle._estimator import estimator as of_rings
from sdpgrind import finishing, plunge, units, weldbead
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.codegen import Exported, Recipe
from sdpgrind.codegen._files.vectors import ROWS, Varied, rows_of
from sdpgrind.codegen._proof.check import _wrong
from sdpgrind.codegen._proof.library import Library
from sdpgrind.weldbead import force

FLAGS = ("-std=c99", "-ffp-contract=off", "-w")


def cycle() -> Any:
    return plunge.CycleController(plunge.preset("simulation"), safety_margin=0.05)


def motion() -> Any:
    path = finishing.hilbert(finishing.surface.flat_surface(6.4), 2, mapping="parametric")
    return finishing.plan(finishing.FinishingProblem(path, friction_ratio=0.0))


def torque() -> Any:
    return finishing.TorqueController(finishing.TorqueAxis(), motion(), normal_force=1.111, kind="lqg")


def press() -> Any:
    time = np.array([0.0, 0.4, 1.0, 2.0])
    planned = {"time": time, "normal_force": [30.0, 30.0, 55.0, 20.0], "fly_height": [10.0, 9.9, 9.8, 10.0]}
    plan = type("Plan", (), {**planned, "center_x": 30.0 * time})
    return force.ForceController(plan, force.PI.design(crossover=units.hz(3.0)))


def bead() -> Any:
    return weldbead.plan(weldbead.preset("P1"), tolerance=1e-3)


def ring() -> Any:
    return centering.GeometryEstimator(noise_sd=0.002)


THINGS: dict[str, Callable[[], Any]] = {
    "bead": bead, "cycle": cycle, "torque": torque, "press": press, "ring": ring,
}  # fmt: skip


# -- loops -------------------------------------------------------------------------------------------------


def loops(parts: int) -> None:
    print(f"\n## {parts} parts in hwsim, C inside\n| what | differing outcomes, tables |\n|---|---|")
    with tempfile.TemporaryDirectory() as kept:
        for name, run in (("bead", _bead), ("cycle", _cycle), ("torque", _torque), ("ring", _ring)):
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


def _ring(place: Path, parts: int) -> tuple[Any, Any]:
    """Centring with the C in place of the estimator's kernel: it works on the same array."""
    problem = centering.preset("printed").replace(mass=0.8, radius=44.45)
    plant = hwsim.CenteringMachine(problem)
    made: dict[tuple[float, ...], Any] = {}

    def step(state: Any, angle: float, reading: float) -> int:
        settings = tuple(state[:14])
        if settings not in made:
            recipe = sdpgrind.codegen.Recipe(**{**vars(ring().__export__()), "state": state})
            made[settings] = sdpgrind.export(recipe, f"{place}_{len(made)}", name="ring").controller()
        out = np.zeros(6)
        return int(made[settings]._library.step(state, np.array([angle, reading]), out))

    strategy = centering.plan(problem)
    wanted = hwsim.run(plant, centering.CenteringController(strategy), parts=parts, rng=0)
    with mock.patch.object(of_rings, "update_step", step):
        log = hwsim.run(plant, centering.CenteringController(strategy), parts=parts, rng=0)
    assert made, "the C was not called"
    return log, wanted


# -- the self-test -----------------------------------------------------------------------------------------

SWAP = {
    "+": "-", "-": "+", "*": "/", "/": "*", "<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "==",
    "&&": "||", "||": "&&",
}  # fmt: skip
SIGN = r"(?<= )(\+|-|\*|/|<=|>=|<|>|==|!=|&&|\|\|)(?= )"
NUMBER = r"(?<![\w.\[])(\d+\.\d+(?:e-?\d+)?|0x[0-9a-f.]+p[+-]?\d+|\d+)(?![\w.])"
LEFT_OUT = (r"/\*.*?\*/", r"^#.*?$", r"^static [^;{]*;$", r"\b[a-z0-9_]+ \*?\w+\[\d+\](?= = |;)")


def mutants(name: str, count: int, steps: int) -> None:
    """Change operators and numbers one by one; of those that change any of many steps, count the found."""
    with tempfile.TemporaryDirectory() as kept:
        place = Path(kept)
        made = sdpgrind.export(THINGS[name](), place / "thing")
        text, found = (place / "thing/thing.c").read_text(), {"found": 0, "missed": 0, "no effect": 0}
        test = place / "test.o"
        subprocess.run(["gcc", *FLAGS, "-O2", "-c", place / "thing/thing_selftest.c", "-o", test], check=True)
        for k, changed in enumerate(_changed(text)):
            if found["found"] + found["missed"] >= count:
                break
            folder = place / f"m{k}"
            folder.mkdir()
            (folder / "thing.c").write_text(changed)
            shutil.copy(place / "thing/thing.h", folder)
            told = _judged(made.recipe, place / "thing", folder, test, steps)
            if told:
                found[told] += 1
    print(
        f"| {name} | {found['found']} of {found['found'] + found['missed']} | {found['no effect']} |",
        flush=True,
    )


def _changed(text: str) -> Iterator[str]:
    blank = text
    for pattern in LEFT_OUT:
        blank = re.sub(pattern, lambda m: " " * len(m[0]), blank, flags=re.S | re.M)
    start = text.index("FP_CONTRACT")
    places = [m for m in re.finditer(f"{SIGN}|{NUMBER}", blank) if m.start() > start]
    rng = random.Random(1)
    rng.shuffle(places)
    for m in places:
        yield text[: m.start()] + _other(m, rng) + text[m.end() :]


def _other(m: re.Match[str], rng: random.Random) -> str:
    if m[1]:
        return SWAP[m[1]]
    if re.fullmatch(r"\d+", m[2]):
        return str(max(0, int(m[2]) + rng.choice([-1, 1]))) if int(m[2]) else "1"
    number = float.fromhex(m[2]) if m[2].startswith("0x") else float(m[2])
    return repr(number * 1.01 if number else 0.5)


def _judged(recipe: Recipe, good: Path, folder: Path, test: Path, steps: int) -> str:
    """Return "found", "missed", "no effect"; "" where it does not compile."""
    done = subprocess.run(
        ["gcc", *FLAGS, "-O1", folder / "thing.c", test, "-lm", "-o", folder / "t"], capture_output=True
    )
    if done.returncode:
        return ""
    try:
        if subprocess.run([folder / "t"], capture_output=True, timeout=120).returncode:
            return "found"
    except subprocess.TimeoutExpired:
        return "found"
    sizes = (len(recipe.inputs), len(recipe.outputs), recipe.state.size)
    pair = [Library(one, folder, "thing", sizes, "gcc", "-O1") for one in (good, folder)]
    varied = Varied(recipe, *rows_of(recipe, np.random.default_rng(7), 4 * ROWS))
    for _ in range(steps // 20_000):
        given = varied.take(20_000)
        if _wrong(*(one.take(*given) for one in pair)).any():
            return "missed"
    return "no effect"


def branches(name: str) -> None:
    """Print the share of branches of the C that the self-test takes, by gcov."""
    with tempfile.TemporaryDirectory() as kept:
        made = sdpgrind.export(THINGS[name](), Path(kept) / "thing")
        print(f"| {name} | {100 * branch_share(made):.1f} % |", flush=True)


def branch_share(made: Exported) -> float:
    """Return the share of branches that are taken at least once."""
    with tempfile.TemporaryDirectory() as kept:
        for path in made.path.glob("*.[ch]"):
            shutil.copy(path, kept)
        sources = sorted(path.name for path in Path(kept).glob("*.c"))
        subprocess.run(["gcc", *FLAGS, "-O0", "--coverage", *sources, "-lm", "-o", "t"], cwd=kept, check=True)
        subprocess.run(["./t"], cwd=kept, check=True, capture_output=True)
        name = f"{made.manifest['name']}.c"
        told = subprocess.run(
            ["gcov", "-b", "-o", f"t-{name[:-2]}.gcda", name], cwd=kept, capture_output=True, text=True
        )
        lines = (Path(kept) / f"{name}.gcov").read_text()
        del told
    taken = [
        int(one) for one in re.findall(r"^branch +\d+ (?:taken (\d+)%|never executed)", lines, re.M) if one
    ]
    every = len(re.findall(r"^branch +\d+", lines, re.M))
    return sum(one > 0 for one in taken) / max(every, 1)


# -- time --------------------------------------------------------------------------------------------------


def speed(name: str, steps: int) -> None:
    """Print the time of a step in a compiled loop: C by gcc -O2, and numba."""
    with tempfile.TemporaryDirectory() as kept:
        made = sdpgrind.export(THINGS[name](), Path(kept) / "thing")
        recipe = made.recipe
        sizes = (len(recipe.inputs), len(recipe.outputs), recipe.state.size)
        library = Library(made.path, Path(kept), "thing", sizes, "gcc", "-O2")
        rows, resets = rows_of(recipe, np.random.default_rng(1), steps)
        usable = recipe.usable(rows)
        rows, resets = np.ascontiguousarray(rows[usable]), np.zeros(int(usable.sum()), dtype=bool)
        found = [_best(lambda: library.take(rows, resets)), _best(_numba_loop(recipe, rows))]
    each = [1e9 * one / len(rows) for one in found]
    print(f"| {name} | {each[0]:.0f} | {each[1]:.0f} | {each[0] / each[1]:.2f} |", flush=True)


def _best(run: Callable[[], object]) -> float:
    times = []
    for _ in range(7):
        begin = clock()
        run()
        times.append(clock() - begin)
    return min(times)


def _numba_loop(recipe: Recipe, rows: Any) -> Callable[[], object]:
    """Loop as that of the C: rows in, states and outputs kept."""
    step, law = recipe.step, ", ".join(f"l{k}" for k in range(len(recipe.law)))
    given = ", ".join(f"rows[k, {j}]" for j in range(rows.shape[1]))
    text = (
        f"def loop(state, {law + ',' if law else ''} rows, states, outs):\n"
        "    for k in range(rows.shape[0]):\n"
        f"        step(state, {law + ',' if law else ''} {given}, outs[k])\n"
        "        for j in range(state.size):\n"
        "            states[k, j] = state[j]\n"
    )
    known: dict[str, Any] = {"step": step}
    exec(text, known)
    loop = compiled(known["loop"])
    states, outs = np.zeros((len(rows), recipe.state.size)), np.zeros((len(rows), len(recipe.outputs)))
    return lambda: loop(recipe.state.copy(), *recipe.law, rows, states, outs)


PARTS = {
    "loops": lambda asked: loops(asked.parts),
    "mutants": lambda asked: _each(
        "self-test finds | without effect", lambda one: mutants(one, 100, asked.steps)
    ),
    "branches": lambda asked: _each("branches taken", branches),
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
