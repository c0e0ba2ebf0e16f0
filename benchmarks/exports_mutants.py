"""Mutants of exports: operators and numbers changed one by one, and whether the self-test finds them.

Each sign and number of the functions, and each number of the tables, is as likely as any other: an operator
becomes its opposite, a whole number one more or less, others 1.01 of themselves (0: 0.5). Those count that change
state, outputs or status of any of many steps; the digest of the tables would find the others, too.

Numbers of tables, and those of a quadratic program, are changed in memory as a program starts, since such files
take long to compile. Programs that were solved before are not solved again, but where the program itself is changed.
"""

import os
import random
import re
import resource
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
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
LEFT_OUT = (
    r"/\*.*?\*/", r"^#.*?$", r"^(?:static|extern) [^;{]*;$", r"\b[a-z0-9_]+ \*?\w+\[\d+\](?= = |;)"
)  # fmt: skip
TABLE = re.compile(r"^static const (\w+) (\w+)\[(\d+)\] = \{\n.*?\n\};$", re.S | re.M)
PROGRAM = re.compile(
    r"^OSQPFloat (\w+_(?:P_csc_x|A_csc_x|L_x|Dinv|rho_inv_vec|rho_vec_val|rho_inv_vec_val|[DE]_val|[DE]inv_val))"
    r"\[(\d+)\] = \{", re.M
)  # fmt: skip
"""Constants among what OSQP generates; other arrays are written by each step."""
LONGEST = 300  # s of a processor; what takes longer does not end
FEWER = 10  # one of so many steps where a step solves a program, in a millisecond
FEWER_SOLVED = 50  # where that program is changed: none is solved already


def mutants(name: str, count: int, steps: int) -> None:
    """Change operators and numbers one by one; of those that change any of many steps, count the found."""
    with tempfile.TemporaryDirectory() as kept:
        place = Path(kept)
        made = sdpgrind.export(THINGS[name](), place / "thing")
        sources = Sources.of(place / "thing")
        most = steps if made.recipe.program is None else steps // FEWER
        _prepare(made.recipe, sources, place, most)
        _counted(f"{name}, code and tables", sources.changes(), place, count, most)
        _counted(f"{name}, program", sources.changes_of_program(), place, count, steps // FEWER_SOLVED)


def _counted(name: str, changes: Iterator["Mutant"], place: Path, count: int, steps: int) -> None:
    found, missed = {"found": 0, "missed": 0, "no effect": 0}, []
    for one in changes:
        if found["found"] + found["missed"] >= count:
            break
        told = _judged(place, one, steps)
        if told:
            found[told] += 1
        missed += [one.told] * (told == "missed")
    if any(found.values()):
        finds = f"{found['found']} of {found['found'] + found['missed']}"
        print(f"| {name} | {finds} | {found['no effect']} | {'; '.join(missed)} |", flush=True)


@dataclass(frozen=True)
class Mutant:
    """What was changed, and the functions with it; or the place of a number that is changed in memory."""

    told: str
    code: str = ""
    table: str = ""
    place: int = 0


@dataclass(frozen=True)
class Sources:
    """C of an export, apart: functions; tables that can be written to; sizes of tables and of the program."""

    code: str
    tables: str
    sizes: Mapping[str, int]
    program: Mapping[str, int]

    @classmethod
    def of(cls, folder: Path) -> "Sources":
        """Read an export."""
        text, solver = (folder / "thing.c").read_text(), folder / "thing_program.c"
        found = {m[2]: m for m in TABLE.finditer(text)}
        sizes = {name: int(m[3]) for name, m in found.items()}
        outer = {m[1]: int(m[2]) for m in PROGRAM.finditer(solver.read_text())} if solver.exists() else {}
        code = TABLE.sub(lambda m: f"extern const {m[1]} {m[2]}[{m[3]}];", text)
        kept = [m[0].removeprefix("static const ") for m in found.values()]
        kept += [f"extern double {name}[{size}];" for name, size in outer.items()]
        kinds = {name: m[1] for name, m in found.items()} | dict.fromkeys(outer, "double")
        cases = [(_NUMBER if kind == "double" else _WHOLE).format(name=name) for name, kind in kinds.items()]
        return cls(code, _TABLES.format(tables="\n".join(kept), cases="".join(cases)), sizes, outer)

    def changes(self) -> Iterator[Mutant]:
        """Give mutants of functions and tables, each place as likely as any other."""
        places, rng = self._places(), random.Random(1)
        ends = np.cumsum([len(places), *self.sizes.values()])
        for k in rng.sample(range(int(ends[-1])), int(ends[-1])):
            if k < len(places):
                m, other = places[k], _other(places[k], rng)
                told = f"line {self.code[: m.start()].count(chr(10)) + 1}: {m[0]} to {other}"
                yield Mutant(told, self.code[: m.start()] + other + self.code[m.end() :])
            else:
                part = int(np.searchsorted(ends, k, side="right"))
                yield _of_table(list(self.sizes)[part - 1], k - int(ends[part - 1]))

    def changes_of_program(self) -> Iterator[Mutant]:
        """Give mutants of the constants of the program."""
        every = [(name, k) for name, size in self.program.items() for k in range(size)]
        random.Random(1).shuffle(every)
        for name, k in every:
            yield _of_table(name, k)

    def _places(self) -> list[re.Match[str]]:
        blank = self.code
        for pattern in LEFT_OUT:
            blank = re.sub(pattern, lambda m: " " * len(m[0]), blank, flags=re.S | re.M)
        start = self.code.index("FP_CONTRACT")
        return [m for m in re.finditer(f"{SIGN}|{NUMBER}", blank) if m.start() > start]


def _of_table(name: str, k: int) -> Mutant:
    return Mutant(f"{name}[{k}]", table=name, place=k)


_TABLES = """\
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
{tables}
__attribute__((constructor)) static void changed(void)
{{
    const char *name = getenv("MUTANT_TABLE");
    long k = (name == NULL) ? 0 : atol(getenv("MUTANT_PLACE"));
    if (name == NULL) {{
        return;
    }}
{cases}
}}
"""
_NUMBER = """\
    if (strcmp(name, "{name}") == 0) {{
        {name}[k] = ({name}[k] == 0.0) ? 0.5 : ({name}[k] * 1.01);
    }}
"""
_WHOLE = """\
    if (strcmp(name, "{name}") == 0) {{
        {name}[k] += ({name}[k] > 0) ? -1 : 1;
    }}
"""


_SIDE_BY_SIDE = """\
#include "thing.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
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
    long left = atol(names[count - 1]);
    FILE *rows = fopen(names[count - 2], "rb");
    good_reset(&one);
    thing_reset(&other);
    while (left-- > 0 && fread(&reset, sizeof reset, 1, rows) == 1 && fread(&in, sizeof in, 1, rows) == 1) {
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

_SOLVED = """\
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>
#define PLACES 524288u
typedef struct {{
    uint64_t digest;
    double x[{unknowns}];
}} solution;
static solution *known;
void real_solve(double *room);
void thing_solve(double *room);
__attribute__((constructor)) static void opened(void)
{{
    const char *changed = getenv("MUTANT_TABLE");
    int file = open("{file}", O_RDWR | O_CREAT, 0600);
    if (file >= 0 && (changed == NULL || strncmp(changed, "thing_qp_", 9) != 0)
        && ftruncate(file, PLACES * sizeof(solution)) == 0) {{
        known = mmap(NULL, PLACES * sizeof(solution), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    }}
}}
void thing_solve(double *room)
{{
    uint64_t digest = 14695981039346656037u, word;
    solution *place = NULL;
    for (int k = 0; k < {given}; k++) {{
        memcpy(&word, &room[k], sizeof word);
        digest = (digest ^ word) * 1099511628211u;
        digest ^= digest >> 29;
    }}
    for (unsigned k = 0; k < 64u && known != NULL; k++) {{
        place = &known[(digest + k) % PLACES];
        if (place->digest == digest) {{
            memcpy(&room[{given} - {unknowns}], place->x, sizeof place->x);
            return;
        }}
        if (place->digest == 0) {{
            break;
        }}
    }}
    real_solve(room);
    if (place != NULL && place->digest == 0) {{
        memcpy(place->x, &room[{given} - {unknowns}], sizeof place->x);
        place->digest = digest;
    }}
}}
"""
"""Solves a program, or takes the solution of the same from a file, but where the program is changed in memory."""


def _prepare(recipe: Recipe, sources: Sources, place: Path, steps: int) -> None:
    """Compile what stays the same, and write the rows of many steps: the self-test has others."""
    varied = Varied(recipe, *rows_of(recipe, np.random.default_rng(7), 4 * ROWS))
    with (place / "rows.bin").open("wb") as file:
        for begin in range(0, steps, 20_000):
            rows, resets = varied.take(min(20_000, steps - begin))
            file.write(np.column_stack([resets, rows]).tobytes())
    for name, text in (
        ("side.c", _SIDE_BY_SIDE), ("tables.c", sources.tables), ("same.c", sources.code),
        ("solved.c", _solved(recipe, place)),
    ):  # fmt: skip
        (place / name).write_text(text)
    for source, made, more in (
        ("thing/thing_selftest.c", "test.o", []), ("side.c", "side.o", []), ("tables.c", "tables.o", []),
        ("same.c", "same.o", []), (_program(place), "osqp.o", ["-Dthing_solve=real_solve"]),
        ("solved.c", "solved.o", ["-std=gnu99"]),
        ("thing/thing.c", "one.o", ["-Dthing_step=good_step", "-Dthing_reset=good_reset"]),
    ):  # fmt: skip
        subprocess.run([*_compiler(place), *more, "-c", place / source, "-o", place / made], check=True)
    subprocess.run(["ld", "-r", "osqp.o", "solved.o", "-o", "solver.o"], cwd=place, check=True)
    # with a solver of its own, that no mutant changes
    subprocess.run(["ld", "-r", "one.o", "solver.o", "-o", "good.o"], cwd=place, check=True)
    only = [f"--keep-global-symbol=good_{one}" for one in ("step", "reset")]
    subprocess.run(["objcopy", *only, "good.o"], cwd=place, check=True)
    for program, *objects in (("same_test", "test.o"), ("same_side", "side.o", "good.o")):
        _linked(place, program, "same.o", *objects)
        if _fails(place, program, {}, steps):
            raise RuntimeError(f"{program} differs without a change")


def _compiler(place: Path, level: str = "-O2") -> list[Any]:
    return ["gcc", *FLAGS, level, f"-I{place / 'thing'}"]


def _solved(recipe: Recipe, place: Path) -> str:
    """Return what stands between the kernels and the program, or nothing."""
    if recipe.program is None:
        return "typedef int empty;\n"
    unknowns, bounds = recipe.program.sizes
    return _SOLVED.format(unknowns=unknowns, given=2 * (unknowns + bounds), file=place / "solved.bin")


def _program(place: Path) -> Path:
    """Return the source of the quadratic program, or one of nothing."""
    found, empty = place / "thing/thing_program.c", place / "empty.c"
    empty.write_text("typedef int empty;\n")
    return found if found.exists() else empty


def _linked(place: Path, program: str, *objects: str) -> None:
    parts = [*objects, "solver.o", "tables.o"]
    subprocess.run(["gcc", *parts, "-lm", "-o", program], cwd=place, check=True)


def _judged(place: Path, mutant: Mutant, steps: int) -> str:
    """Return "found", "missed", "no effect" on any of the many steps; "" where it does not compile."""
    env, test, side = {}, "same_test", "same_side"
    if mutant.table:
        env = {"MUTANT_TABLE": mutant.table, "MUTANT_PLACE": str(mutant.place)}
    else:
        (place / "changed.c").write_text(mutant.code)
        command = [*_compiler(place, "-O1"), "-c", place / "changed.c", "-o", place / "changed.o"]
        if subprocess.run(command, capture_output=True).returncode:
            return ""
        test, side = "test", "side"
        _linked(place, test, "changed.o", "test.o")
        _linked(place, side, "changed.o", "side.o", "good.o")
    if not _fails(place, side, env, steps):
        return "no effect"
    return "found" if _fails(place, test, env) else "missed"


def _fails(place: Path, program: str, env: Mapping[str, str], steps: int = 0) -> bool:
    """Whether a program, for rows of so many steps, ends otherwise than by 0, or not at all."""
    command = [place / program, place / "rows.bin", str(steps)]

    def bounded() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))

    run = subprocess.run(command, capture_output=True, env={**os.environ, **env}, preexec_fn=bounded)
    return run.returncode != 0


def _other(m: re.Match[str], rng: random.Random) -> str:
    if m[1]:
        return SWAP[m[1]]
    if re.fullmatch(r"\d+", m[2]):
        return str(max(0, int(m[2]) + rng.choice([-1, 1]))) if int(m[2]) else "1"
    number = float.fromhex(m[2]) if m[2].startswith("0x") else float(m[2])
    return repr(number * 1.01 if number else 0.5)
