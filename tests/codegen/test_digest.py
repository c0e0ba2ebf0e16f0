"""Digest of the constant tables: against a computation of the test's own, and every number that is changed."""

import re
import shutil
import struct
import subprocess
from typing import NamedTuple

import numpy as np
import pytest
from codegen_inside import compilers

import sdpgrind
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.codegen import Recipe, Signal

pytestmark = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed")
KINDS = ["float64", "float32", "int64", "int32", "int16", "int8", "bool"]
SIZE = 100  # beyond the tables whose numbers are written where they are read


class Law(NamedTuple):
    """Tables of which `step` reads all but two."""

    numbers: np.ndarray
    idle: np.ndarray


@compiled(error_model="numpy")
def chosen(numbers, idle, place):
    return numbers[place]


@compiled(error_model="numpy")
def mixed_step(state, law, idle, small, wide, narrow, short, tiny, flags, place, out):
    """Steps of the self-test read the first two numbers of each table alone."""
    k = int(place)
    state[0] = wide[k] + narrow[k] + short[k] + tiny[k]
    out[0] = chosen(law.numbers, idle, k) + small[k] + (1.0 if flags[k] else 0.0)
    return 0


@compiled(error_model="numpy")
def step(state, x, out):
    out[0] = digest(x) + exp(x)
    return 0


@compiled(error_model="numpy")
def digest(x):
    return 2.0 * x


@compiled(error_model="numpy")
def exp(x):
    return np.exp(x) if x < 0.0 else 1.0


def tables():
    rng = np.random.default_rng(3)
    numbers = {kind: (100.0 * rng.standard_normal(SIZE)).astype(kind) for kind in KINDS}
    numbers["bool"] = rng.random(SIZE) < 0.5
    for kind in ("float64", "float32"):
        numbers[kind][90:96] = np.nan, -np.nan, np.inf, -np.inf, 0.0, -0.0
    numbers["float64"][96:98] = 5e-324, 1e16
    numbers["int64"][90:92] = -(2**63) + 1, 2**63 - 1
    return numbers


def recipe():
    made, idle = tables(), np.arange(100.0)
    law = Law(made["float64"], idle + 1.0), idle, *(made[kind] for kind in KINDS[1:])
    places = [np.arange(64.0)[:, None] % 2.0]
    return Recipe(
        "mixed", mixed_step, {"place": Signal(low=0.0, high=99.0, spread=0.0)}, {"found": Signal()}, law=law,
        vectors=lambda rng, n: places,
    )  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return sdpgrind.export(recipe(), tmp_path_factory.mktemp("out") / "mixed")


def total_of(words):
    """The digest, in whole numbers of Python."""
    total = 14695981039346656037
    for word in words:
        total = (total ^ word) * 1099511628211 % 2**64
        total ^= total >> 32
    return total


def read_back(text):
    """Words of 64 bits of all numbers that the digest reads, from the text of the C."""
    words = []
    for name, count in re.findall(r"_hashed_\w+\(total, (\w+), (\d+)\);", text):
        kind, cells = re.search(rf"static const (\w+) {name}\[\d+\] = \{{(.*?)\}};", text, re.S).groups()
        numbers = [one.strip() for one in cells.split(",")]
        assert len(numbers) == int(count)
        if kind in ("double", "float"):
            words += [word_of(one) for one in numbers]
        else:
            named = {"true": 1, "false": 0}
            whole = [re.sub(r"INT64_C\((.*)\)", r"\1", one) for one in numbers]
            words += [(named[one] if one in named else int(one)) % 2**64 for one in whole]
    return words


def word_of(text):
    named = {"NAN": np.nan, "INFINITY": np.inf, "-INFINITY": -np.inf}
    text = text.replace("(double)", "")
    number = named[text] if text in named else float.fromhex(text) if "0x" in text else float(text)
    return 0x7FF8000000000000 if number != number else struct.unpack("<Q", struct.pack("<d", number))[0]


def run_of(folder, text, tmp_path):
    """The self-test of an export, `text` in place of its source."""
    (tmp_path / "mixed.c").write_text(text)
    sources = [tmp_path / "mixed.c", folder / "mixed_selftest.c"]
    compilers.compiled("gcc", sources, tmp_path / "t", "-O0", f"-I{folder}")
    return subprocess.run([tmp_path / "t"], capture_output=True, text=True, check=False)


def changed(text, name, place, by):
    """The source with a number of a table changed."""
    begin = text.index("{", text.index(f" {name}["))
    head, body, tail = text[:begin], text[begin : text.index("};", begin)], text[text.index("};", begin) :]
    cells = body[1:].split(",")
    cells[place] = by(cells[place])
    return head + "{" + ",".join(cells) + tail


def test_the_digest_is_that_of_all_numbers_that_are_read(made):
    """Of each type, in the order of the C; what is handed on and left alone is not among them."""
    text = (made.path / "mixed.c").read_text()
    words = read_back(text)
    assert len(words) == len(KINDS) * SIZE + 1  # and the state after a reset
    digest = total_of(words)
    assert made.manifest["digest"] == f"{digest:016x}"
    assert f"#define MIXED_DIGEST UINT64_C(0x{digest:016x})" in (made.path / "mixed.h").read_text()
    assert {word_of(repr(float(one))) for one in tables()["float64"]} <= set(words)


@pytest.mark.parametrize("kind", KINDS)
def test_a_changed_number_is_found_that_no_step_reads(made, kind, tmp_path):
    text = (made.path / "mixed.c").read_text()
    c = {"float64": "double", "float32": "float", "bool": "bool"}.get(kind, f"{kind}_t")
    name = re.search(rf"_hashed_{c}\(total, (\w+), 100\)", text)[1]
    by = {"bool": lambda one: " false" if "true" in one else " true"}.get(kind, lambda one: f"{one} + 1")
    done = run_of(made.path, changed(text, name, 57, by), tmp_path)
    told = "mixed: a number of a constant table is not the one that was exported\n"
    assert done.returncode == 1 and done.stdout.startswith(told)
    assert "0 of" in done.stdout.splitlines()[1] and "and 0 of" in done.stdout.splitlines()[1]


def test_two_changed_signs_are_found(made, tmp_path):
    """Alone, products by an odd number keep the upper bit in its place: two of them would cancel."""
    text = (made.path / "mixed.c").read_text()
    for place in (41, 57):
        text = changed(text, "mixed_law_numbers", place, lambda one: f" -({one})")
    assert run_of(made.path, text, tmp_path).returncode == 1


def test_tables_that_are_not_read_decide_nothing(made, tmp_path):
    text = (made.path / "mixed.c").read_text()
    same = run_of(made.path, text, tmp_path)
    assert same.returncode == 0
    for name in ("mixed_idle", "mixed_law_idle"):
        text = changed(text, name, 0, lambda one: f"{one} + 1")
    assert run_of(made.path, text, tmp_path).stdout == same.stdout


def test_three_functions_and_nothing_else_are_seen(made, tmp_path):
    target = tmp_path / "mixed.o"
    for compiler in compilers.found(("gcc", "clang"))[0]:
        flags = ["-std=c99", "-O2", "-ffp-contract=off", *compilers.STRICT, "-c"]
        subprocess.run([compiler, *flags, made.path / "mixed.c", "-o", target], check=True)
        told = subprocess.run(
            ["nm", "-g", "--defined-only", target], capture_output=True, text=True, check=True
        )
        assert [line.split()[1:] for line in told.stdout.splitlines()] == [
            ["T", f"mixed_{one}"] for one in ("digest", "reset", "step")
        ]


@pytest.mark.parametrize("emulator", ["qemu-aarch64", "qemu-arm"])
def test_other_processors_have_the_digest(made, emulator, tmp_path):
    compiler = {"qemu-arm": "arm-linux-gnueabihf-gcc", "qemu-aarch64": "aarch64-linux-gnu-gcc"}[emulator]
    if missing := compilers.found((compiler, emulator))[1]:
        pytest.skip(f"{', '.join(missing)} not found")
    sources = [made.path / "mixed.c", made.path / "mixed_selftest.c"]
    compilers.compiled(compiler, sources, tmp_path / "t", "-static", f"-I{made.path}")
    done = subprocess.run([emulator, tmp_path / "t"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_kernels_may_have_the_names_of_public_functions(tmp_path):
    made = sdpgrind.export(Recipe("names", step, {"x": Signal()}, {"y": Signal()}), tmp_path / "names")
    assert made.check(1000, ["gcc"], levels=["-O0"], targets=()).differing == 0
    names = {one["name"] for one in made.manifest["functions"]}
    assert names == {"names_step_2", "names_digest_2", "names_exp_2"}
