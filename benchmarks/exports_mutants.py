"""Mutants of exports: operators and numbers changed one by one, and whether the self-test finds them."""

import random
import re
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from exports_things import THINGS

import sdpgrind
from sdpgrind.codegen import Recipe
from sdpgrind.codegen._files.vectors import ROWS, Varied, rows_of

FLAGS = ("-std=c99", "-ffp-contract=off", "-w")
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
        _prepare(made.recipe, place, steps)
        missed = []
        for change, changed in _changed(text):
            if found["found"] + found["missed"] >= count:
                break
            told = _judged(place, changed)
            if told:
                found[told] += 1
            missed += [change] * (told == "missed")
        finds = f"{found['found']} of {found['found'] + found['missed']}"
        print(f"| {name} | {finds} | {found['no effect']} | {'; '.join(missed)} |", flush=True)


_SIDE_BY_SIDE = """\
#include "thing.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
void good_reset(thing_state *state);
int32_t good_step(thing_state *state, const thing_input *in, thing_output *out);
static int differ(const void *one, const void *other, size_t size)
{
    for (size_t k = 0; k < size; k += sizeof(double)) {
        double a, b;
        memcpy(&a, (const char *)one + k, sizeof a);
        memcpy(&b, (const char *)other + k, sizeof b);
        if (memcmp(&a, &b, sizeof a) != 0 && !(isnan(a) && isnan(b))) {
            return 1;
        }
    }
    return 0;
}
int main(int count, char **names)
{
    static thing_state one, other;
    double reset;
    thing_input in;
    FILE *rows = fopen(names[count - 1], "rb");
    good_reset(&one);
    thing_reset(&other);
    while (fread(&reset, sizeof reset, 1, rows) == 1 && fread(&in, sizeof in, 1, rows) == 1) {
        thing_output a, b;
        memset(&a, 0, sizeof a);
        memset(&b, 0, sizeof b);
        if (reset != 0.0) {
            good_reset(&one);
            thing_reset(&other);
        }
        if (good_step(&one, &in, &a) != thing_step(&other, &in, &b) || differ(&a, &b, sizeof a)
            || differ(&one, &other, sizeof one)) {
            return 1;
        }
    }
    return 0;
}
"""
"""Runs an export and a changed one on the same rows: 1 where anything differs after any step."""


def _prepare(recipe: Recipe, place: Path, steps: int) -> None:
    """Compile what stays the same, and write the rows of many steps: the self-test has others."""
    varied = Varied(recipe, *rows_of(recipe, np.random.default_rng(7), 4 * ROWS))
    with (place / "rows.bin").open("wb") as file:
        for _ in range(steps // 20_000 if recipe.program is None else 1):
            rows, resets = varied.take(20_000 if recipe.program is None else 2_000)
            file.write(np.column_stack([resets, rows]).tobytes())
    (place / "side.c").write_text(_SIDE_BY_SIDE)
    compiler = ["gcc", *FLAGS, "-O2", f"-I{place / 'thing'}", "-c"]
    renamed = ["-Dthing_step=good_step", "-Dthing_reset=good_reset"]
    for source, made, more in (
        ("thing/thing_selftest.c", "test.o", []), ("thing/thing.c", "good.o", renamed), ("side.c", "side.o", []),
        (_program(place), "solver.o", []),
    ):  # fmt: skip
        subprocess.run([*compiler, *more, place / source, "-o", place / made], check=True)


def _program(place: Path) -> Path:
    """Return the source of the quadratic program, or one of nothing."""
    found, empty = place / "thing/thing_program.c", place / "empty.c"
    empty.write_text("typedef int empty;\n")
    return found if found.exists() else empty


def _judged(place: Path, changed: str) -> str:
    """Return "found", "missed", "no effect"; "" where it does not compile."""
    (place / "changed.c").write_text(changed)
    compiler = ["gcc", *FLAGS, "-O1", f"-I{place / 'thing'}"]
    command = [*compiler, "-c", place / "changed.c", "-o", place / "changed.o"]
    if subprocess.run(command, capture_output=True).returncode:
        return ""
    if _fails(compiler, place, "test.o"):
        return "found"
    return "missed" if _fails(compiler, place, "side.o", "good.o") else "no effect"


def _fails(compiler: list[Any], place: Path, *objects: str) -> bool:
    """Whether a program with the changed source ends otherwise than by 0, or not at all."""
    parts = [place / one for one in ("changed.o", "solver.o", *objects)]
    subprocess.run([*compiler, *parts, "-lm", "-o", place / "program"], check=True)
    try:
        run = subprocess.run([place / "program", place / "rows.bin"], capture_output=True, timeout=60)
    except subprocess.TimeoutExpired:
        return True
    return run.returncode != 0


def _changed(text: str) -> Iterator[tuple[str, str]]:
    """Give what was changed, and the text with it."""
    blank = text
    for pattern in LEFT_OUT:
        blank = re.sub(pattern, lambda m: " " * len(m[0]), blank, flags=re.S | re.M)
    start = text.index("FP_CONTRACT")
    places = [m for m in re.finditer(f"{SIGN}|{NUMBER}", blank) if m.start() > start]
    rng = random.Random(1)
    rng.shuffle(places)
    for m in places:
        other, line = _other(m, rng), text[: m.start()].count("\n") + 1
        yield f"line {line}: {m[0]} to {other}", text[: m.start()] + other + text[m.end() :]


def _other(m: re.Match[str], rng: random.Random) -> str:
    if m[1]:
        return SWAP[m[1]]
    if re.fullmatch(r"\d+", m[2]):
        return str(max(0, int(m[2]) + rng.choice([-1, 1]))) if int(m[2]) else "1"
    number = float.fromhex(m[2]) if m[2].startswith("0x") else float(m[2])
    return repr(number * 1.01 if number else 0.5)
