"""Elementary functions from a folder: what is reached, bits on every target, what is wrong with a folder."""

import hashlib
import json
import math
import os
import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from codegen_inside import CFile

import hwsim
import sdpgrind
from sdpgrind import finishing, plunge
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.codegen import Recipe, Signal

needs_gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed")
SMALL = Path(__file__).parent / "small_libm"
REACHED = {
    "LICENSE", "marks.h", "parts.h", "factorials.c", "quarter.c", "exp.c", "log.c", "pow.c", "sin.c", "cos.c",
}  # fmt: skip
STEPS = 2000
ABROAD = {
    "aarch64": ("aarch64-linux-gnu-gcc", "qemu-aarch64"),
    "armhf": ("arm-linux-gnueabihf-gcc", "qemu-arm"),
}


@compiled(error_model="numpy")
def wave_step(state, x, y, out):
    state[0] = 0.5 * state[0] + np.sin(x) * np.exp(-y * y)
    out[0] = state[0]
    out[1] = abs(x) ** y + np.log(1.0 + y * y) - np.cos(y)
    return 0


@compiled(error_model="numpy")
def raised_step(state, x, out):
    out[0] = abs(x) ** 0.3
    return 0


@compiled(error_model="numpy")
def wide_step(state, x, out):
    out[0] = np.cosh(x)
    return 0


def wave():
    inputs = {"x": Signal("rad", low=-30.0, high=30.0), "y": Signal(low=-9.0, high=9.0)}
    return Recipe("wave", wave_step, inputs, {"a": "", "b": ""})


def raised():
    return Recipe("raised", raised_step, {"x": Signal(low=0.0, high=9.0)}, {"y": ""})


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return sdpgrind.export(wave(), tmp_path_factory.mktemp("out") / "wave", math=SMALL)


# -- what is written ---------------------------------------------------------------------------------------


@needs_gcc
def test_what_is_reached_is_beside_the_export(made):
    told = made.manifest
    assert {one.name for one in (made.path / "math").iterdir()} == REACHED
    for name in REACHED - {"LICENSE", "parts.h", "marks.h"}:
        lines = (made.path / f"wave_math_{name}").read_text().splitlines()
        assert lines == ['#include "wave_math.h"', f'#include "math/{name}"']
        assert (made.path / "math" / name).read_bytes() == (SMALL / "src" / name).read_bytes()
    assert (made.path / "math" / "marks.h").read_bytes() == (SMALL / "generic" / "marks.h").read_bytes()
    assert told["math"] == "folder" and told["licences"] == ["math/LICENSE"]
    assert told["math_functions"] == {one: f"math/{one}.c" for one in ("exp", "log", "pow", "sin", "cos")}
    digest = hashlib.sha256((SMALL / "src" / "pow.c").read_bytes()).hexdigest()
    assert told["files"]["math/pow.c"] == digest
    promise = "same bits on every IEEE 754 target: exp, log, pow, sin and cos from the sources in math/"
    assert made.promise.startswith(promise) and made.promise in (made.path / "wave.h").read_text()


@needs_gcc
def test_names_are_those_of_the_export(made, tmp_path):
    """Nothing but what IEEE 754 defines is asked of the C library, and no name of its own is defined."""
    for source in sorted(made.path.glob("wave*.c")):
        if not source.name.endswith("selftest.c"):
            command = ["gcc", "-std=c99", "-O0", "-c", str(source), "-o", str(tmp_path / f"{source.stem}.o")]
            subprocess.run(command, check=True)
    objects = [str(one) for one in tmp_path.glob("*.o")]
    told = subprocess.run(["nm", "-P", *objects], capture_output=True, text=True, check=True).stdout
    names = [line.split()[:2] for line in told.splitlines() if not line.endswith(":")]
    defined = {name for name, kind in names if kind in "TRDB"}
    assert defined and all(name.startswith("wave_") for name in defined)
    assert not {kind for _, kind in names} & {"D", "B", "d", "b"}  # no data that can be written
    asked = {name for name, kind in names if kind == "U"} - defined
    assert asked <= {"floor", "fmod", "frexp", "ldexp", "memcpy", "memset", "_GLOBAL_OFFSET_TABLE_"}


@needs_gcc
def test_the_same_bytes_again_and_without_need_nothing(made, tmp_path):
    again = sdpgrind.export(wave(), made.path, math=os.fspath(SMALL))
    assert again.manifest == made.manifest
    torque = finishing.TorqueController(finishing.TorqueAxis(), normal_force=1.111, kind="pidff")
    for place, more in (("with", {"math": SMALL}), ("without", {})):
        sdpgrind.export(torque, tmp_path / place, name="torque", **more)
    for one in (tmp_path / "without").iterdir():
        assert one.read_bytes() == (tmp_path / "with" / one.name).read_bytes()
    assert not (tmp_path / "with" / "math").exists()


@needs_gcc
def test_another_export_takes_the_folder_whole(tmp_path):
    path = sdpgrind.export(raised(), tmp_path / "x", math=SMALL).path
    with pytest.raises(FileExistsError, match="overwrite must be True"):
        sdpgrind.export(raised(), path)
    (path / "math" / "mine.txt").write_text("kept")
    with pytest.raises(ValueError, match=r"also holds math/mine\.txt, not in its manifest"):
        sdpgrind.export(raised(), path, overwrite=True)
    (path / "math" / "mine.txt").unlink()
    assert sdpgrind.export(raised(), path, overwrite=True).manifest["math"] == "libm"
    assert not (path / "math").exists()


# -- bits --------------------------------------------------------------------------------------------------


def exp_of(x):
    """The folder's exp in Python: each operation is rounded once, as in C."""
    k = math.floor(x * float.fromhex("0x1.71547652b82fep+0") + 0.5)
    r = (x - k * float.fromhex("0x1.62e42fefa38p-1")) - k * float.fromhex("0x1.ef35793c7673p-45")
    found = 0.0
    for n in reversed(range(14)):
        found = found * r + 1.0 / math.factorial(n)
    return math.ldexp(found, k)


@needs_gcc
def test_the_functions_are_those_of_the_folder(tmp_path):
    c = sdpgrind.export(raised(), tmp_path / "x", math=SMALL).controller()
    found = [c.step(x=1.0)["y"], c.step(x=0.0)["y"]]
    assert found == [1.0, 0.0]
    others = 0
    for x in np.linspace(0.1, 8.9, 200).tolist():
        y = c.step(x=x)["y"]
        # their log is within 2 ulp of the library's: 0.3 log x changes by 1e-15, and exp with it
        assert abs(y - x**0.3) <= 4e-15 * y
        others += y != x**0.3
    assert others > 20


@needs_gcc
def test_bits_of_a_function_in_the_folder(made):
    c = made.controller()
    for y in np.linspace(-5.0, 5.0, 41).tolist():
        c.reset()
        wanted = math.sin(0.5) * exp_of(-y * y)
        assert abs(c.step(x=0.5, y=y)["a"] - wanted) <= 4 * np.spacing(wanted)  # their sine: within 2 ulp
    c.reset()
    assert made.manifest["from_library"]["status_differs"] == 0
    # sin within 1e-15 and exp within 1e-13 at the end of its range, of 1; twice, as the state halves
    assert 0.0 < made.manifest["from_library"]["largest"]["a"] <= 3e-13 * 30.0


@needs_gcc
def test_the_same_bits_on_other_targets(made):
    found = made.check(STEPS, ["gcc", "clang"], levels=("-O2",))
    assert found.status == "equal" and found.differing == 0, found.first
    assert found.reference == "gcc -O0" and "gcc -O2" in found.builds
    again = made.check(100, ["gcc"], levels=("-O0", "-O1"), targets=())
    assert set(again.builds) == {"gcc -O1"}  # not with itself
    for target, needed in ABROAD.items():
        if all(map(shutil.which, needed)):
            assert found.builds[target] == 0 and found.steps[target] == STEPS


@needs_gcc
def test_the_self_test_holds_the_bits_of_the_folder(made, tmp_path):
    shutil.copytree(made.path, tmp_path / "x")
    done = ran(tmp_path / "x")
    assert (
        done.returncode == 0
        and done.stdout == "wave: 0 of 548 vectors and 0 of 64 digests of 1000 steps differ\n"
    )
    shutil.copy(
        sdpgrind.export(wave(), tmp_path / "wave").path / "wave.c", tmp_path / "x"
    )  # with the C library's
    assert ran(tmp_path / "x").returncode == 1
    text = (made.path / "wave_selftest.c").read_text()
    assert "against this C where it was exported" in text and "wave.c wave_math_*.c wave_selftest.c" in text


def ran(folder, compiler="gcc", *command):
    sources = sorted(str(one) for one in folder.glob("*.c"))
    flags = ["-static"] if command else []
    flags += ["-std=c99", "-O2", "-ffp-contract=off"]
    subprocess.run([compiler, *flags, *sources, "-lm", "-o", str(folder / "t")], check=True)
    return subprocess.run([*command, str(folder / "t")], capture_output=True, text=True, check=False)


@needs_gcc
@pytest.mark.skipif(not all(map(shutil.which, ABROAD["aarch64"])), reason="no aarch64 here")
def test_fused_operations_that_a_source_asks_for_would_be_found(made, tmp_path):
    shutil.copytree(made.path, tmp_path / "x")
    compiler, emulator = ABROAD["aarch64"]
    assert ran(tmp_path / "x", compiler, emulator).returncode == 0
    header = tmp_path / "x" / "wave_math.h"
    header.write_text(header.read_text().replace("#undef __FP_FAST_FMA\n", ""))
    done = ran(tmp_path / "x", compiler, emulator)
    assert done.returncode == 1 and "64 of 64 digests" in done.stdout


@needs_gcc
def test_a_unit_carries_the_functions(tmp_path):
    unit = sdpgrind.export(raised(), tmp_path / "raised.fmu", "fmi2", math=SMALL)
    assert unit.check(STEPS, ["gcc"], levels=["-O2"], targets=()).differing == 0
    with zipfile.ZipFile(unit.path) as archive:
        names, told = set(archive.namelist()), archive.read("sources/buildDescription.xml").decode()
    assert {"sources/math/pow.c", "sources/raised_math_pow.c", "sources/raised_math.h"} <= names
    assert 'name="raised_math_pow.c"' in told and "math/pow.c" not in told
    assert unit.controller().step(x=1.0) == {"y": 1.0}


@needs_gcc
@pytest.mark.usefixtures("few_blocks_here")
def test_plunge_in_the_loop(tmp_path):
    """Commands differ in last digits, sizes by no more than these do.

    Functions of the folder are within 1e-13 of the library's; the loop does not amplify: 1e-9 is 1e4 times it.
    """
    problem = plunge.preset("simulation")
    controller = plunge.CycleController(problem, safety_margin=0.05)
    made = sdpgrind.export(controller, tmp_path / "cycle", math=SMALL)
    grinder = hwsim.PlungeGrinder(problem)
    log, wanted = (hwsim.run(grinder, one, parts=2, rng=0) for one in (made.controller(), controller))
    tier = wanted.tiers[0]
    assert not log[tier].identical(wanted[tier])
    for name in wanted.outcome.data_vars:
        np.testing.assert_allclose(log.outcome[name], wanted.outcome[name], rtol=1e-9, atol=1e-9)


MUSL = os.environ.get("SDPGRIND_LIBM", "")


@needs_gcc
@pytest.mark.slow
@pytest.mark.skipif(not MUSL, reason="SDPGRIND_LIBM names no folder with the sources of musl")
def test_the_sources_of_musl(tmp_path):
    controller = plunge.CycleController(plunge.preset("simulation"), safety_margin=0.05)
    for thing, name in ((controller, "cycle"), (wave(), "wave")):
        made = sdpgrind.export(thing, tmp_path / name, math=MUSL)
        found = made.check(STEPS, levels=("-O0", "-O2", "-O3 -march=native"))
        assert found.status == "equal" and found.differing == 0, found.first
        # glibc's functions and these are within 1 ulp of each other
        assert max(made.manifest["from_library"]["largest"].values()) < 0.5
    assert made.manifest["licences"] and "signgam.c" not in {
        one.name for one in (made.path / "math").iterdir()
    }


# -- what is wrong -----------------------------------------------------------------------------------------


def folder(tmp_path, **changes):
    """Copy of the small library with files changed, or left out where the text is None."""
    shutil.copytree(SMALL, tmp_path / "lib", dirs_exist_ok=True)
    for name, text in changes.items():
        file = tmp_path / "lib" / name
        file.unlink() if text is None else file.write_text(text)
    return tmp_path / "lib"


WRONG = {
    "no_function": (
        {"src/pow.c": None},
        r"defines pow, which this export calls; looked for pow\(...\) { in the \d+ .c files",
    ),
    "no_inner": ({"src/log.c": None}, r"defines log, which its src/pow\.c calls"),
    "only_declared": (
        {"src/pow.c": "double pow(double x, double y);"},
        "defines pow, which this export calls",
    ),
    "of_its_own": ({"src/pow.c": "static double pow(double x, double y) { return x; }"}, "defines pow"),
    "by_a_macro": (
        {"src/pow.c": "#define OF(name) double name(double x, double y)\nOF (pow)\n{ return x; }"},
        r"defines pow, .*; looked for pow\(...\) { in the \d+ .c files of '.*'; its name stands in src/pow.c without a"
        " body, as where a macro defines it: a folder with a C function of this name and its body would do",
    ),
    "assembly": (
        {"src/pow.c": None, "src/pow.s": "pow:"},
        "src/pow.s is assembly: a folder with",
    ),
    "no_licence": ({"LICENSE": None}, "the licence of its sources, in a file LICENSE, COPYING or COPYRIGHT"),
    "twice": (
        {"src/more.c": "double pow(double x, double y)\n{ return x; }"},
        r"pow is defined once; got it in src/more.c and src/pow.c: name a folder that holds one of them",
    ),
    "no_header": (
        {"include/parts.h": None},
        r"has parts.h, which its src/exp.c includes; looked for it beside",
    ),
    "two_headers": (
        {"src/../arm/parts.h": ""},
        "parts.h stands once; got it in arm/parts.h and include/parts.h",
    ),
}


@needs_gcc
@pytest.mark.parametrize("name", WRONG)
def test_a_folder_that_cannot_be_used(tmp_path, name):
    changes, told = WRONG[name]
    with pytest.raises(ValueError, match=f"^math must be a folder .*{told}"):
        sdpgrind.export(raised(), tmp_path / "x", math=folder(tmp_path, **changes))
    assert not (tmp_path / "x").exists()


@needs_gcc
def test_sources_that_a_compiler_refuses(tmp_path):
    text = "#include <math.h>\ndouble pow(double x, double y)\n{\n    return x +;\n}\n"
    with pytest.raises(
        RuntimeError, match=r"(?s)^math must be a folder .*gcc refused the export: .*math/pow\.c:4"
    ):
        sdpgrind.export(raised(), tmp_path / "x", math=folder(tmp_path, **{"src/pow.c": text}))
    assert not (tmp_path / "x").exists()


@needs_gcc
def test_a_function_that_is_declared_nowhere(tmp_path):
    """C would take its result for a whole number."""
    inner = {"src/inner.c": "double inner(double x)\n{\n    return x;\n}\n"}
    text = "#include <math.h>\ndouble pow(double x, double y)\n{\n    return inner(x) + y;\n}\n"
    with pytest.raises(RuntimeError, match="implicit declaration of function"):
        sdpgrind.export(raised(), tmp_path / "x", math=folder(tmp_path, **inner, **{"src/pow.c": text}))


@needs_gcc
def test_what_is_used_and_defined_nowhere(tmp_path):
    changes = {
        "src/pow.c": "extern double lost;\ndouble pow(double x, double y)\n{\n    return lost + x + y;\n}\n"
    }
    with pytest.raises(RuntimeError, match=r"lacks something that the export needs: .*lost"):
        sdpgrind.export(raised(), tmp_path / "x", math=folder(tmp_path, **changes))


POW = "#include <math.h>\n{before}\ndouble pow(double x, double y)\n{{\n    return {result} + y;\n}}\n"
CXX = "#ifdef __cplusplus\n{}\n#endif\n"
INLINE = "static inline double grown(double x)\n{\n    return expm1(x);\n}\n"
BRANCHES = """
static double of(double x)
{
#ifdef OTHER
    if (x > 1.0) {
#else
    if (x > 2.0) {
#endif
        x = expm1(x);
    }
    return x;
}
"""
HIDDEN = {
    "pointer": ("static double of(double (*f)(double), double x) { return f(x); }", "of(expm1, x)"),
    "parentheses": ("", "(expm1)(x)"),
    "joined": ("#define CALL(f, x) f##1(x)", "CALL(expm, x)"),
    "builtin": ("", "__builtin_expm1(x)"),
    "branches": ("static double of(double x);", "of(x)"),
    "inline": ('#include "grown.h"', "grown(x)"),
}


@needs_gcc
@pytest.mark.parametrize("name", HIDDEN)
def test_no_function_comes_from_the_c_library_unseen(tmp_path, name):
    """However it is called: the bits would be those of the target's library."""
    before, result = HIDDEN[name]
    header = CXX.format('extern "C" {') + INLINE + CXX.format("}")
    text = POW.format(before=before, result=result) + (BRANCHES if name == "branches" else "")
    changes = {"src/pow.c": text, "src/grown.h": header}
    with pytest.raises((RuntimeError, ValueError), match="expm1"):
        sdpgrind.export(raised(), tmp_path / "x", math=folder(tmp_path, **changes))


@needs_gcc
def test_a_function_that_is_handed_over_is_that_of_the_folder(tmp_path):
    changes = {"src/pow.c": POW.format(before=HIDDEN["pointer"][0], result="of(expm1, x)")}
    inner = {"src/expm1.c": "double expm1(double x)\n{\n    return 3.0 * x;\n}\n"}
    made = sdpgrind.export(raised(), tmp_path / "x", math=folder(tmp_path, **changes, **inner))
    assert made.controller().step(x=2.0)["y"] == 6.3


@needs_gcc
def test_names_of_what_a_header_defines_are_those_of_the_export(tmp_path):
    header = {
        "src/tripled.h": "double factor = 3.0;\ndouble tripled(double x)\n{\n    return factor * x;\n}\n"
    }
    source = {"src/pow.c": POW.format(before='#include "tripled.h"', result="tripled(x)")}
    made = sdpgrind.export(raised(), tmp_path / "x", math=folder(tmp_path, **header, **source))
    told = (made.path / "x_math.h").read_text()
    assert "#define tripled x_math_tripled\n" in told and "#define factor x_math_factor\n" in told


@needs_gcc
def test_nothing_is_written_outside_the_export(tmp_path):
    """A header that is found elsewhere includes one above: beside the export that is a file of the user's."""
    changes = {
        "src/pow.c": POW.format(before='#include "deep/inner.h"', result="x"),
        "a/b/c/deep/inner.h": '#include "../../../../top.h"\n',
        "top.h": "",
    }
    (tmp_path / "lib" / "a/b/c/deep").mkdir(parents=True)
    (tmp_path / "top.h").write_text("mine")
    with pytest.raises(
        ValueError, match=r"includes stay in it; \.\./\.\./\.\./\.\./top\.h of its a/b/c/deep/inner\.h"
    ):
        sdpgrind.export(raised(), tmp_path / "x", math=folder(tmp_path, **changes))
    assert (tmp_path / "top.h").read_text() == "mine"


@needs_gcc
def test_a_function_that_the_folder_has_not(tmp_path):
    wide = Recipe("wide", wide_step, {"x": Signal(low=-5.0, high=5.0)}, {"y": ""})
    with pytest.raises(ValueError, match="defines cosh, which this export calls"):
        sdpgrind.export(wide, tmp_path / "x", math=SMALL)


@pytest.mark.parametrize("which", ["none", "LICENSE"])
def test_no_folder(tmp_path, which):
    with pytest.raises(
        ValueError, match="math must be 'libm', or a folder with the C sources of a libm; got"
    ):
        sdpgrind.export(raised(), tmp_path / "x", math=SMALL / which)


def test_without_a_compiler(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(
        ValueError, match=r"math must be 'libm' where no C compiler is found: .* gcc, clang, cc"
    ):
        sdpgrind.export(raised(), tmp_path / "x", math=SMALL)
    assert not (tmp_path / "x").exists()


@needs_gcc
def test_a_check_without_a_compiler_is_not_run(made, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    found = made.check(100, ["gcc"], targets=())
    assert found.status == "not run" and found.missing == ("gcc",)


def test_the_command(tmp_path, capsys):
    from hwsim import cli

    table = tmp_path / "none.nc"
    assert cli.main(["export", str(table), str(tmp_path / "x"), "--math", str(tmp_path)]) == 2
    assert "none.nc" in capsys.readouterr().err


# -- C as text ---------------------------------------------------------------------------------------------

TEXT = rb"""
#include <math.h>
#include "a.h" /* #include "no.h" */
// #include "no2.h"
#define twice(x) \
    from_macro(x)
typedef struct { double x; } kind;
static double own(double x) { return inner(x) + "}{ hidden_call("[0]; }
extern const double foreign[3], *other;
extern double (declared)(double);
const double table[2] = {1.0, 2.0};
static const double own_table[] = {1.0};
__attribute__((noinline, section("x"))) double shown(double x)
{
    if (x > 0.0) { while (x) { x = shown(x) /* never_called( */; } }
    return sizeof(double) + call_1 (x);
}
struct pair { int a; } made = {1};
double _reserved(double);
"""


@pytest.mark.parametrize(
    "begin", ["#ifdef __cplusplus", "# if defined( __cplusplus )", "#if defined __cplusplus"]
)
def test_a_brace_for_another_language_hides_nothing(begin):
    both = f'{begin}\nextern "C" {{\n#endif\n', f"{begin}\n}}\n#endif // of it\n"
    told = CFile(f"{both[0]}double shown(double x) {{ return inner(x); }}\n{both[1]}".encode())
    assert told.defined == {"shown"} and told.called == {"inner"}


def test_what_a_source_says():
    told = CFile(TEXT)
    assert told.includes == ("a.h",) and told.macros == {"twice"}
    assert told.defined == {"table", "shown", "made"} and told.own == {"own", "own_table"}
    assert told.called == {"from_macro", "inner", "shown", "call_1"}
    assert "other" in told.foreign and "_reserved" in told.reserved and "declared" not in told.defined


def test_a_manifest_is_json(made):
    assert json.loads((made.path / "manifest.json").read_text()) == made.manifest
