"""Files of an export: content, the same at every export, whole or not at all; what is no export."""

import hashlib
import json
import pathlib
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from functools import reduce
from importlib import import_module

import numpy as np
import pytest
from codegen_inside import EXPORTED, LibrarySteps

import sdpgrind
from sdpgrind import plunge
from sdpgrind.base import whole_files
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.codegen import Recipe, Signal

# Where the claim does not concern the long run of an export.
briefly = pytest.mark.usefixtures("few_blocks_here")
needs_gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed")


@compiled(error_model="numpy")
def smith_step(state, gain, reset_time, period, model, wanted, reading, out):
    """PI with a Smith predictor: the delayed model's error is added to the model's own."""
    delayed = state[1 + int(state[0])]
    error = wanted - (state[9] + reading - delayed)
    state[10] += period / reset_time * error
    out[0] = min(max(gain * (error + state[10]), -5.0), 5.0)
    state[1 + int(state[0])] = state[9]
    state[0] = (state[0] + 1.0) % 8.0
    state[9] += model * (out[0] - state[9])
    return 1 if abs(error) > 2.0 else 0


@compiled(error_model="numpy")
def cast_step(state, x, out):
    state[0] += 1.0
    out[0] = int(x)
    return 0


@compiled(error_model="numpy")
def refusing_step(state, x, out):
    """Counts before it refuses what is above 1."""
    state[0] += 1.0
    out[0] = state[0]
    return -1 if x > 1.0 else 0


def recipe(**more):
    return Recipe(
        "smith", smith_step, {"wanted": "mm", "reading": "mm"}, {"command": "mm/s"},
        law=(1.5, 0.3, 0.01, 0.125), state=np.zeros(11), period=0.01, status=("go on", "far off"),
        places={"model": 9, "integral": 10}, equations="Smith (1957)", **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return sdpgrind.export(recipe(), tmp_path_factory.mktemp("out") / "smith")


def test_the_files(made):
    names = {"smith.h", "smith.c", "smith_selftest.c", "vectors.bin", "manifest.json"}
    assert {path.name for path in made.path.iterdir()} == names
    told = json.loads((made.path / "manifest.json").read_text())
    for name in names - {"manifest.json"}:
        assert told["files"][name] == hashlib.sha256((made.path / name).read_bytes()).hexdigest()
    assert [one["name"] for one in told["inputs"]] == ["wanted", "reading"] and told["period"] == 0.01
    assert (
        made.promise
        == "same bits where the C library computes fmod as that of this computer; the self-test tells"
    )
    assert (
        told["functions"][0]["kernel"] == "smith_step"
        and told["functions"][0]["file"] == "test_export_files.py"
    )
    assert made.size == sum((made.path / f"smith{end}").stat().st_size for end in (".h", ".c"))


def test_the_header_has_units_and_places(made):
    text = (made.path / "smith.h").read_text()
    assert "double wanted; /* mm, -1e+09 to 1e+09 */" in text and "double command; /* mm/s */" in text
    assert "#define SMITH_PERIOD 0.01 /* s */" in text and "#define SMITH_AT_INTEGRAL 10" in text
    assert f'#define SMITH_FINGERPRINT "{recipe().fingerprint}"' in text and "1  far off" in text


def test_vectors_are_those_of_the_library(made):
    rows = np.fromfile(made.path / "vectors.bin", "<f8").reshape(-1, 4)
    assert np.isnan(rows[0]).all()
    state, out = np.zeros(11), np.zeros(1)
    for wanted, reading, command, status in rows[1:60]:
        assert smith_step(state, 1.5, 0.3, 0.01, 0.125, wanted, reading, out) == status and out[0] == command


def test_the_same_bytes_at_every_export(made, tmp_path):
    again = sdpgrind.export(recipe(), tmp_path / "smith")
    for path in made.path.iterdir():
        assert path.read_bytes() == (again.path / path.name).read_bytes()
    assert (
        sdpgrind.export(recipe(), tmp_path / "smith").manifest == made.manifest
    )  # without overwrite: the same


@briefly
def test_another_export_is_kept(tmp_path):
    first = sdpgrind.export(recipe(), tmp_path / "smith")
    other = Recipe("cast", cast_step, {"x": ""}, {"y": ""})
    before = (first.path / "manifest.json").read_bytes()
    with pytest.raises(FileExistsError, match="overwrite must be True where path holds another export"):
        sdpgrind.export(other, first.path)
    assert (first.path / "manifest.json").read_bytes() == before
    second = sdpgrind.export(other, first.path, overwrite=True)
    assert second.manifest["kind"] == "step" and len(list(tmp_path.iterdir())) == 1
    assert sorted(path.name for path in first.path.glob("*.c")) == ["smith.c", "smith_selftest.c"]


def test_foreign_folders_and_files_are_refused(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "mine.txt").write_text("kept")
    for name, text in (
        ("a", "must be the folder of an export, or be empty"),
        ("a/mine.txt", "must be a folder"),
    ):
        with pytest.raises(ValueError, match=text):
            sdpgrind.export(recipe(), tmp_path / name, name="x", overwrite=True)
    with pytest.raises(NotADirectoryError, match=r"must lie in a folder; .* lies in the file .*mine\.txt"):
        sdpgrind.export(recipe(), tmp_path / "a/mine.txt/x")


def test_what_is_exported_is_listed_once():
    """Each name is a class that says how, and stands on the page."""
    page = (pathlib.Path(__file__).parents[2] / "docs/exported_things.rst").read_text()
    for name in EXPORTED:
        area, *way = name.split(".")
        home = import_module(area if area == "centering" else f"sdpgrind.{area}")
        assert hasattr(reduce(getattr, way, home), "__export__"), name
        assert f"``{name}``" in page


@briefly
def test_the_folder_of_an_export_is_made(tmp_path):
    made = sdpgrind.export(recipe(), tmp_path / "out/first/x")
    assert sorted(one.name for one in (tmp_path / "out").iterdir()) == ["first"] and made.path.is_dir()


@briefly
@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("mine", ["main.c", "build/notes.txt"])
def test_a_users_files_beside_an_export_are_kept(tmp_path, mine, overwrite):
    made = sdpgrind.export(recipe(), tmp_path / "smith")
    (made.path / mine).parent.mkdir(exist_ok=True)
    (made.path / mine).write_text("kept")
    for one in (recipe(), Recipe("cast", cast_step, {"x": ""}, {"y": ""})):
        with pytest.raises(ValueError, match=f"also holds {mine.split('/')[0]}, not in its manifest.json"):
            sdpgrind.export(one, made.path, overwrite=overwrite)
    assert (made.path / mine).read_text() == "kept"


@pytest.mark.parametrize("text", ['{"name": "my web app"}', "[1]", "no JSON", '{"fingerprint": "1"}'])
def test_a_foreign_manifest_is_no_export(tmp_path, text):
    (tmp_path / "web" / "src").mkdir(parents=True)
    (tmp_path / "web" / "manifest.json").write_text(text)
    with pytest.raises(ValueError, match="must be the folder of an export, or be empty"):
        sdpgrind.export(recipe(), tmp_path / "web", overwrite=True)
    assert (tmp_path / "web" / "src").is_dir() and (tmp_path / "web" / "manifest.json").read_text() == text


@pytest.mark.parametrize("name", ["for", "int", "3d", "a-b", "log"])
def test_names_that_c_does_not_allow(tmp_path, name):
    with pytest.raises(
        ValueError, match=f"name must be an identifier of C and Python and no keyword; got '{name}'"
    ):
        sdpgrind.export(recipe(), tmp_path / "x", name=name)


@pytest.mark.parametrize(
    "name",
    ["math", "Math", "string", "stdint", "float_t", "DBL_MAX", "linux", "I", "errno", "template", "PRIu64"],
)
def test_names_that_headers_and_cpp_take(tmp_path, name):
    with pytest.raises(
        ValueError, match=f"no name that standard headers, compilers or C.. take; got '{name}'"
    ):
        sdpgrind.export(recipe(), tmp_path / "x", name=name)
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    "name", ["NAN", "INFINITY", "EOF", "unix", "new", "delete", "errno", "DBL_MAX", "ROWS"]
)
def test_names_of_inputs_and_outputs(name):
    for inputs, outputs in (({name: ""}, {"y": ""}), ({"x": ""}, {name: ""})):
        with pytest.raises(ValueError, match=f"inputs, outputs must be no name that .* take; got '{name}'"):
            Recipe("cast", cast_step, inputs, outputs)


def test_names_that_may_be(tmp_path):
    for name in ("string", "FEED", "PRICE", "SIGMA", "E1", "x" * 63):  # a header's is no file here
        assert name in Recipe("cast", cast_step, {name: ""}, {"y": ""}).inputs
    with pytest.raises(ValueError, match="name must be of at most 63 characters; got 64"):
        sdpgrind.export(recipe(), tmp_path / ("x" * 64))


def test_what_has_no_recipe(tmp_path):
    with pytest.raises(
        TypeError, match=r"thing must be one of weldbead.SequencePolicy, sdp.Policy, .* got dict"
    ):
        sdpgrind.export({}, tmp_path / "x")
    with pytest.raises(TypeError, match=r"got CycleProblem, whose plunge.CycleController\(problem\) is one$"):
        sdpgrind.export(plunge.preset("simulation"), tmp_path / "x")
    with pytest.raises(ValueError, match=r"target must be"):
        sdpgrind.export(recipe(), tmp_path / "x", target="st")


def test_a_refused_step_leaves_the_state_as_it_was():
    """As in C, which works on a copy."""
    steps = LibrarySteps(Recipe("refusing", refusing_step, {"x": ""}, {"y": ""}, state=np.zeros(1)))
    found = steps.take(np.array([[0.5], [2.0], [np.nan], [0.5]]), np.zeros(4, dtype=bool))
    assert found.codes.tolist() == [0, -1, -1, 0]
    assert found.states[:, 0].tolist() == [1.0, 1.0, 1.0, 2.0] and found.outputs[:, 0].tolist() == [
        1.0,
        0.0,
        0.0,
        2.0,
    ]
    again = steps.take(np.array([[2.0], [0.5]]), np.array([True, False]))
    assert (
        again.codes.tolist() == [-1, 0]
        and again.states[:, 0].tolist() == [0.0, 1.0]
        and steps.state[0] == 1.0
    )


def test_a_step_of_other_parameters_lists_them(tmp_path):
    told = r"step\(state, \*law, \*inputs, \*after, out\), of 4 parameters; got \['state', 'x', 'out'\]$"
    with pytest.raises(ValueError, match=told):
        sdpgrind.export(Recipe("cast", cast_step, {"x": "", "z": ""}, {"y": ""}), tmp_path / "cast")


@briefly
@needs_gcc
def test_a_check_tells_how_far_it_is(tmp_path):
    made, told = sdpgrind.export(recipe(), tmp_path / "smith"), []
    found = made.check(
        100, ["gcc"], levels=["-O0"], targets=[], progress=lambda share, text: told.append((share, text))
    )
    assert str(found) == "equal: 100 steps of gcc -O0"
    other = replace(found, status="differs", builds={"gcc -O0": 3}, missing=("clang",))
    assert str(other) == "differs: 100 steps of gcc -O0; 3 differ by gcc -O0; left out: clang"
    shares, texts = zip(*told, strict=True)
    assert list(shares) == sorted(shares) and told[0] == (0.0, "gcc -O0")
    texts = [one for one in texts if not one.startswith("compiling")]  # which ends it on a fresh machine
    assert texts[-1] == "100 steps of each build: gcc -O0 from step 0 on"


@briefly
@needs_gcc
@pytest.mark.parametrize(
    "line, other, told",
    [
        ("? 1 : 0;", "? 1 : 5;", "status 5, expected 0"),
        ("-5.0), 5.0)", "-5.0), 5.0) + 64.0", r"out\[0\] = 6\S+, expected -?\d\S+"),
        ("(out[0] - state[9])", "(out[0] - state[9]) + 64", r"state\[9\] = 6\S+, expected -?\d\S+"),
    ],
    ids=["status", "output", "state"],
)
def test_a_check_tells_what_differs_first(tmp_path, line, other, told):
    made = sdpgrind.export(recipe(), tmp_path / "smith")
    source = made.path / "smith.c"
    text = source.read_text()
    assert text.count(line) == 1
    source.write_text(text.replace(line, other))
    found = made.check(100, ["gcc"], levels=["-O0"], targets=[])
    assert re.fullmatch(rf"differs: .* differ by gcc -O0; first step \d+ by gcc -O0: {told}", str(found)), (
        found
    )


@briefly
def test_an_export_that_fails_leaves_the_old_one(tmp_path, monkeypatch):
    first = sdpgrind.export(recipe(), tmp_path / "smith")
    before = {path.name: path.read_bytes() for path in first.path.iterdir()}
    from sdpgrind.codegen._files import folder

    def full(path):
        raise OSError("no space left on device")

    monkeypatch.setattr(folder, "durable", full)
    with pytest.raises(OSError, match="no space"):
        sdpgrind.export(Recipe("cast", cast_step, {"x": ""}, {"y": ""}), first.path, overwrite=True)
    assert {path.name: path.read_bytes() for path in first.path.iterdir()} == before
    assert len(list(tmp_path.iterdir())) == 1


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@briefly
def test_a_key_pressed_between_the_renames_leaves_the_old_one(tmp_path, monkeypatch):
    first = sdpgrind.export(recipe(), tmp_path / "smith")
    before, rename, calls = contents(first.path), pathlib.Path.rename, []

    def pressed(self, target):
        calls.append(target)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return rename(self, target)

    monkeypatch.setattr(pathlib.Path, "rename", pressed)
    with pytest.raises(KeyboardInterrupt):
        sdpgrind.export(Recipe("cast", cast_step, {"x": ""}, {"y": ""}), first.path, overwrite=True)
    assert contents(first.path) == before and len(list(tmp_path.iterdir())) == 1


def dead_process():
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    return dead.pid


@briefly
def test_what_a_killed_process_left(tmp_path):
    first = sdpgrind.export(recipe(), tmp_path / "smith")
    before, owner = contents(first.path), f"{dead_process()}@{whole_files._computer()}"
    for name in (f".smith.{owner}.a1.part", f".smith.other.{owner}.a1.part"):
        (tmp_path / name).mkdir()
    first.path.rename(tmp_path / f".smith.{owner}.a1.old")
    with pytest.raises(FileExistsError, match="overwrite must be True"):  # it is there again
        sdpgrind.export(Recipe("cast", cast_step, {"x": ""}, {"y": ""}), first.path)
    assert contents(first.path) == before
    (tmp_path / f".smith.{owner}.a2.old").mkdir()
    sdpgrind.export(recipe(), first.path)
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"smith", f".smith.other.{owner}.a1.part"}  # which is not beside this export


@needs_gcc
def test_a_users_own_step(made):
    found = made.check(20_000, ["gcc"], levels=["-O2"], targets=())
    assert found.status == "equal" and found.differing == 0, found.first


@needs_gcc
def test_what_was_not_run_is_no_success(made):
    found = made.check(1000, ["no-such-compiler"], targets=())
    assert found.status == "not run" and found.missing == ("no-such-compiler",)
    with pytest.raises(RuntimeError, match="nothing was run: none of no-such-compiler was found"):
        _ = found.differing
    with pytest.raises(ValueError, match="compiler must be a C compiler on this computer"):
        made.controller("no-such-compiler")


@needs_gcc
def test_other_targets_without_a_compiler_that_is_there(made):
    found = made.check(100, ["no-such-compiler"])
    assert found.missing[:2] == ("no-such-compiler", "sanitizers: no compiler here")
    for target in ("aarch64", "armhf"):  # run, or what they lack is named
        assert found.builds.get(target) == 0 or any(
            one.startswith(f"{target}: its C library") or one.startswith(("qemu", target, "arm-linux"))
            for one in found.missing
        )
        assert not any("no compiler here to compare" in one for one in found.missing)


@pytest.mark.parametrize("what", ["compilers", "levels", "targets"])
def test_a_text_in_place_of_several(made, what):
    with pytest.raises(TypeError, match=rf"^{what} must be a sequence of texts, as \('.*',\); got 'gcc'$"):
        made.check(10, **{what: "gcc"})


@needs_gcc
def test_a_compiled_controller_says_what_it_is(made):
    told = "CompiledController('smith' by gcc: wanted, reading -> command)"
    assert repr(made.controller()) == told


STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-pedantic", "-Werror")


def built(folder, *flags, compiler="gcc"):
    """Program of the self-test in a folder."""
    sources = [str(path) for path in sorted(folder.glob("*.c"))]
    subprocess.run([compiler, *flags, *sources, "-lm", "-o", str(folder / "t")], check=True)
    return subprocess.run([str(folder / "t")], capture_output=True, text=True, check=False)


@needs_gcc
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_self_test(made, tmp_path, compiler):
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} is not installed")
    shutil.copytree(made.path, tmp_path / "x")
    done = built(tmp_path / "x", *STRICT, compiler=compiler)
    assert done.returncode == 0
    assert done.stdout == "smith: 0 of 548 vectors and 0 of 64 digests of 1000 steps differ\n"


@needs_gcc
@pytest.mark.parametrize(
    ("text", "wrong"), [("1.5", "1.6"), ("> 2.0", "> 2.1"), ("- delayed", "+ delayed"), ("-5.0", "-4.9")]
)
def test_the_self_test_finds_what_is_changed(made, tmp_path, text, wrong):
    shutil.copytree(made.path, tmp_path / "x")
    source = tmp_path / "x" / "smith.c"
    changed = source.read_text().replace(text, wrong)
    assert changed != source.read_text()
    source.write_text(changed)
    done = built(tmp_path / "x", "-std=c99", "-O1")
    assert done.returncode == 1 and re.search("[1-9][0-9]* of 64 digests", done.stdout)


@needs_gcc
def test_flush_to_zero_is_told(made, tmp_path):
    shutil.copytree(made.path, tmp_path / "x")
    sources = [str(path) for path in sorted((tmp_path / "x").glob("*.c"))]
    for source in sources:
        subprocess.run(["gcc", "-std=c99", "-O1", "-c", source, "-o", source[:-1] + "o"], check=True)
    objects = [source[:-1] + "o" for source in sources]
    subprocess.run(["gcc", "-ffast-math", *objects, "-lm", "-o", str(tmp_path / "t")], check=True)
    done = subprocess.run([str(tmp_path / "t")], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "small numbers are flushed to zero" in done.stdout


@needs_gcc
def test_fast_math_is_refused(made):
    done = subprocess.run(
        ["gcc", "-std=c99", "-ffast-math", "-c", str(made.path / "smith.c"), "-o", "/dev/null"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode and "compile without -ffast-math" in done.stderr


@needs_gcc
@pytest.mark.parametrize("source", ["smith.c", "smith_selftest.c"])
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_finite_math_is_refused(made, compiler, source):
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} is not installed")
    done = subprocess.run(
        [compiler, "-std=c99", "-O2", "-ffinite-math-only", "-c", str(made.path / source), "-o", "/dev/null"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode and "compile without -ffinite-math-only" in done.stderr


def test_vectors_hold_what_is_no_finite_number(made):
    rows = np.fromfile(made.path / "vectors.bin", "<f8").reshape(-1, 4)
    rows = rows[~np.isnan(rows).all(axis=1)]  # but those of a reset
    for one in (0, 1):
        for told in (np.isnan(rows[:, one]), np.isposinf(rows[:, one]), np.isneginf(rows[:, one])):
            assert told.any() and (rows[told, 3] == -1.0).all()


@needs_gcc
def test_a_number_that_is_no_index(tmp_path):
    made = sdpgrind.export(
        Recipe("cast", cast_step, {"x": Signal(low=-np.inf, high=np.inf, missing=True, spread=0.0)}, {"y": ""},
               vectors=lambda rng, n: [np.arange(9.0)[:, None]]),
        tmp_path / "cast",
    )  # fmt: skip
    library = made.controller()._library
    state, out = np.zeros(1), np.full(1, 7.0)
    for wrong in (np.nan, 1e300, -np.inf):
        assert library.step(state, np.array([wrong]), out) == -3 and state[0] == 0.0 and out[0] == 7.0
    assert library.step(state, np.array([-2.7]), out) == 0 and state[0] == 1.0 and out[0] == -2.0


@needs_gcc
def test_a_number_must_be_finite(made):
    library = made.controller()._library
    state, out = np.ones(11), np.full(1, 7.0)
    for wrong in (np.nan, np.inf):
        assert (
            library.step(state, np.array([0.0, wrong]), out) == -1 and (state == 1.0).all() and out[0] == 7.0
        )
    controller = made.controller()
    with pytest.raises(
        ValueError,
        match=r"within their range \(status -1\); got wanted=1 \(-1e\+09 to 1e\+09 mm\), reading=nan \(-1e",
    ):
        controller.step(wanted=1.0)


@needs_gcc
def test_the_object_has_no_data_of_its_own(made, tmp_path):
    target = str(tmp_path / "smith.o")
    subprocess.run(["gcc", "-std=c99", "-O2", "-c", str(made.path / "smith.c"), "-o", target], check=True)
    sizes = subprocess.run(["size", target], capture_output=True, text=True, check=True).stdout.split()
    assert sizes[7:9] == ["0", "0"]
    names = subprocess.run(["nm", "-u", target], capture_output=True, text=True, check=True).stdout.split()
    assert set(names[1::2]) <= {"fmod", "memcpy", "memset", "copysign", "fabs"}
