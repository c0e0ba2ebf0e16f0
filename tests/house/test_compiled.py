"""Kernels are compiled again when, and only when, something that they depend on was edited; closed ones say
so.
"""

import json
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import types
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache

from sdpgrind.base.compiling import kernel_digest
from sdpgrind.base.compiling.compiled import ClosedKernel, Kernel, compiled, opened
from sdpgrind.base.compiling.kernel_library import LinkedLibrary

SOURCE = Path(kernel_digest.__file__).parents[3]
CALLER = '''
import toy_callee
from toy_callee import Pair, direct
from sdpgrind.base.compiling.compiled import compiled

@compiled
def _helped(x):
    return toy_callee.shifted(x) + direct(x)

@compiled(error_model="numpy")
def called(x, pair):
    """Add what the other module says."""
    return _helped(x) + pair.high

@compiled
def applied(function, x):
    return function(x)
'''
CALLEE = '''
from typing import NamedTuple
import numpy as np
from sdpgrind.base.compiling.compiled import compiled

SHIFT = 100.0
TABLE = np.array([1.0, 2.0])
class Pair(NamedTuple):
    low: float
    high: float

@compiled
def shifted(x):
    """Shift."""
    # as far as SHIFT says
    return x + SHIFT + TABLE[1]

def body(x):
    return 0.0 * x

direct = compiled(body)
'''
ALIKE = {
    "PYTHONDONTWRITEBYTECODE": "1",  # an edit within one second must not be missed by Python itself
    "PYTHONHASHSEED": "1",
}
RUN = """
import toy_caller
from toy_callee import Pair
print(toy_caller.called(1.0, Pair(low=0.0, high=1000.0)))
print(sum(toy_caller.called.stats.cache_hits.values()))
print(toy_caller.applied(toy_caller._helped, 1.0), sum(toy_caller.applied.stats.cache_hits.values()))
"""


def write(folder):
    (folder / "toy_caller.py").write_text(CALLER)
    (folder / "toy_callee.py").write_text(CALLEE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One for all tests: files of the cache are of a place."""
    return tmp_path_factory.mktemp("toys") / "toy"


@pytest.fixture
def toy(folder):
    """A package of two modules on disk, with a cache of its own: edit it, run it."""
    folder.mkdir()
    write(folder)
    yield folder
    shutil.rmtree(folder)


@pytest.fixture(scope="module")
def cache(folder, run):
    """What a first run leaves in the cache."""
    folder.mkdir()
    write(folder)
    assert run(folder) == ["1103.0", "0", "103.0", "0"]
    kept = shutil.move(folder / "cache", folder.with_name("kept"))
    shutil.rmtree(folder)
    return kept


@pytest.fixture
def toy_run(toy, cache):
    """The package after its first run."""
    shutil.copytree(cache, toy / "cache")
    return toy


SERVER = """
import json, os, sys, traceback
from numba import njit
from numba.core import config
import sdpgrind.base.compiling.compiled

njit(lambda x: x + 1.0)(1.0)
for line in sys.stdin:
    asked = json.loads(line)
    child = os.fork()
    if child == 0:
        for number, name in enumerate(("out", "err"), 1):
            os.dup2(os.open(asked[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
        os.environ.update(asked["known"])
        sys.path[:0] = asked["known"]["PYTHONPATH"].split(os.pathsep)
        config.reload_config()
        status = 0
        try:
            exec(compile(asked["text"], "<string>", "exec"), {"__name__": "__main__"})
        except BaseException:
            traceback.print_exc()
            status = 1
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    print(os.waitpid(child, 0)[1], flush=True)
"""
"""A process that has imported numba and no toy, and forks for each program: half a second less for each. Its
compiler is at work already, which loads the tables of numba's types: another half second less.
"""


@pytest.fixture(scope="module")
def server():
    """None where processes cannot fork."""
    if not hasattr(os, "fork"):
        yield None
        return
    known = os.environ | {"PYTHONPATH": str(SOURCE)} | ALIKE
    with subprocess.Popen(
        [sys.executable, "-c", SERVER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=known
    ) as process:
        yield process
        process.stdin.close()


@pytest.fixture(scope="module")
def run(server):
    """What a process that knows no toy prints, in words: `run(folder, text, **environment)`."""

    def forked(folder, text=RUN, **more):
        files = {name: folder / f"said.{name}" for name in ("out", "err")}
        asked = {"text": text, "known": environment(folder) | more} | {k: str(f) for k, f in files.items()}
        server.stdin.write(json.dumps(asked) + "\n")
        server.stdin.flush()
        status = int(server.stdout.readline())
        out, error = (file.read_text() for file in files.values())
        assert status == 0, error
        return words(out, error)

    return forked if server is not None else run_fresh


def run_fresh(folder, text=RUN, **more):
    """What a new interpreter prints, in words."""
    known = os.environ | environment(folder) | more
    done = subprocess.run(
        [sys.executable, "-c", text], capture_output=True, text=True, env=known, check=False
    )
    assert done.returncode == 0, done.stderr
    return words(done.stdout, done.stderr)


def environment(folder):
    return {
        "PYTHONPATH": f"{SOURCE}{os.pathsep}{folder}",
        "NUMBA_CACHE_DIR": str(folder / "cache"),
    } | ALIKE


def words(out, error):
    return [*out.split(), error] if error else out.split()


def edit(file, old, new):
    text = file.read_text()
    assert text.count(old) == 1
    file.write_text(text.replace(old, new))


def test_edits_of_a_callee_and_of_constants_are_seen_and_comments_are_not(toy_run, run):
    toy = toy_run
    assert run(toy) == ["1103.0", "1", "103.0", "1"]
    callee = toy / "toy_callee.py"
    for old, new in (
        ("# as far as SHIFT says", "# otherwise said\n    # in two lines"),
        ('"""Shift."""', '"""Shift by a constant."""'),
        ("import numpy as np\n", "import numpy as np\n\nUNUSED = 1.0\n\n"),
    ):
        edit(callee, old, new)
    edit(toy / "toy_caller.py", "import toy_callee\n", "# further down\n\nimport toy_callee\n")
    edit(toy / "toy_caller.py", "Add what the other module says.", "Add.")
    assert run(toy) == ["1103.0", "1", "103.0", "1"]
    for old, new, value in (
        ("x + SHIFT", "x + 1 + SHIFT", 104.0),
        ("SHIFT = 100.0", "SHIFT = 200.0", 204.0),
        ("[1.0, 2.0]", "[1.0, 4.0]", 206.0),
        ("0.0 * x", "5.0 * x", 211.0),
    ):
        edit(callee, old, new)
        assert run(toy) == [f"{1000 + value}", "0", f"{value}", "0"]


def test_fields_in_another_order_are_seen(toy_run, run):
    toy = toy_run
    edit(toy / "toy_callee.py", "    low: float\n    high: float\n", "    high: float\n    low: float\n")
    assert run(toy)[:2] == ["1103.0", "0"]


def test_options_of_a_callee_are_seen(toy_run, run):
    toy = toy_run
    edit(toy / "toy_caller.py", "@compiled\ndef _helped", "@compiled(fastmath=True)\ndef _helped")
    assert run(toy) == ["1103.0", "0", "103.0", "0"]


def test_data_that_were_not_written_are_not_believed(toy_run, run):
    """The index is written first: a process that ends there leaves data of an older source under the new
    promise.
    """
    toy = toy_run
    data = next((toy / "cache").rglob("toy_caller.called*.1.nbc"))
    old = data.read_bytes()
    edit(toy / "toy_callee.py", "SHIFT = 100.0", "SHIFT = 200.0")
    run(toy)
    data.write_bytes(old)
    assert run(toy)[:2] == ["1203.0", "0"]


@pytest.mark.parametrize("torn", [b"", b"not a pickle"])
def test_a_torn_file_is_compiled_again(toy_run, torn, run):
    files = list((toy_run / "cache").rglob("toy_caller.called*"))
    assert files
    for file in files:
        file.write_bytes(torn)
    assert run(toy_run)[:2] == ["1103.0", "0"]


def test_a_class_or_a_module_of_another_name_is_compiled_again(toy_run, run):
    """The index on disk names the classes of arguments as they were called."""
    toy = toy_run
    (toy / "toy_callee.py").write_text(CALLEE.replace("Pair", "Couple"))
    (toy / "toy_caller.py").write_text(CALLER.replace("Pair", "Couple"))
    assert run(toy, RUN.replace("Pair", "Couple"))[:2] == ["1103.0", "0"]
    (toy / "toy_callee.py").rename(toy / "toy_other.py")
    (toy / "toy_caller.py").write_text(CALLER.replace("Pair", "Couple").replace("toy_callee", "toy_other"))
    assert run(toy, RUN.replace("Pair", "Couple").replace("toy_callee", "toy_other"))[:2] == ["1103.0", "0"]


def test_where_nothing_can_be_written_one_line_says_so(toy, run):
    """Files in the place of the three folders: no right is enough to make one there."""
    for name in ("cache", "__pycache__", "home"):
        (toy / name).write_text("")
    text = f"import warnings; warnings.simplefilter('always'){RUN}"
    *values, told = run(toy, text, XDG_CACHE_HOME=str(toy / "home"))
    assert values == ["1103.0", "0", "103.0", "0"]
    assert told.count("UserWarning") == 1
    assert (
        "compiled kernels cannot be kept on disk (no folder can be written), so every process compiles"
        in told
    )


def test_what_was_typed_at_a_prompt_is_compiled_in_silence(toy, run):
    text = "from sdpgrind.base.compiling.compiled import compiled\n@compiled\ndef twice(x):\n    return 2.0 * x\nprint(twice(4.0))"
    assert run(toy, text) == ["8.0"]


def test_a_folder_that_is_lost_later(toy, run):
    text = f"""
import shutil, toy_caller
toy_caller.called._cache._files()
shutil.rmtree({str(toy / "cache")!r})
open({str(toy / "cache")!r}, "w").close(){RUN}"""
    *values, told = run(toy, text)
    assert values == ["1103.0", "0", "103.0", "0"]
    assert told.count("UserWarning") == 1


@compiled
def _closed(x):
    return 2.0 * x


@compiled(inline="always")
def _within(x):
    return x + 1.0


@compiled
def open_one(x):
    return _closed(_within(x))


def test_a_closed_kernel_is_called_from_kernels_only():
    assert open_one(3.0) == 8.0
    with pytest.raises(
        TypeError, match=r"_closed is a kernel that only kernels can call, as its name begins with '_'"
    ):
        _closed(3.0)
    assert opened(_closed)(3.0) == 6.0
    assert opened(_closed) is opened(_closed)
    assert opened(open_one) is open_one


def test_a_closed_kernel_that_was_compiled_is_still_closed():
    open_one(1.0)
    _closed.compile("float64(float64)")
    with pytest.raises(TypeError, match="call it from a kernel"):
        _closed(1.0)


def test_doors():
    kinds = {kernel: kernel.targetoptions for kernel in (open_one, _closed, opened(_closed))}
    assert all(options["no_cfunc_wrapper"] and options["nogil"] for options in kinds.values())
    assert [options["no_cpython_wrapper"] for options in kinds.values()] == [False, True, False]
    assert isinstance(_closed, ClosedKernel) and isinstance(open_one, Kernel)


def test_options_reach_the_code():
    @compiled(error_model="numpy")
    def ratio(a, b):
        return a / b

    @compiled
    def python_ratio(a, b):
        return a / b

    assert ratio(1.0, 0.0) == np.inf
    with pytest.raises(ZeroDivisionError):
        python_ratio(1.0, 0.0)


def test_a_kernel_is_pickled_by_its_place():
    for kernel in (open_one, _closed):
        assert pickle.loads(pickle.dumps(kernel)) is kernel


def test_a_kernel_within_a_function_is_pickled_by_its_code():
    def made(shift):
        @compiled
        def moved(x):
            return x + shift

        return moved

    again = pickle.loads(pickle.dumps(made(2.5)))
    assert isinstance(again, Kernel)
    assert again(1.0) == made(2.5)(1.0) == 3.5
    assert made(4.0)(1.0) == 5.0


def test_another_process_is_given_the_kernel_of_its_module(toy_run, run):
    text = """
import multiprocessing, toy_caller
from toy_callee import Pair
if __name__ == "__main__":
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        print(pool.apply(toy_caller.called, (1.0, Pair(0.0, 1000.0))))
"""
    assert run(toy_run, text) == ["1103.0"]


@compiled
def even(n):
    return True if n == 0 else odd(n - 1)


@compiled
def odd(n):
    return False if n == 0 else even(n - 1)


def test_circles_have_a_digest():
    assert kernel_digest.reached(even) == [even, odd]
    assert kernel_digest.digest(even) != kernel_digest.digest(odd)


def test_what_cannot_be_read_has_the_digest_of_its_file(toy, run):
    """An object of which nothing is known changes when its file does; never by its address."""
    strange = "class Strange:\n    pass\n\nstrange = Strange()\n"
    (toy / "toy_strange.py").write_text(strange)
    text = """
from toy_strange import strange
from sdpgrind.base.compiling import kernel_digest
def f(x):
    return strange
print(kernel_digest.digest(f))
"""
    first = run(toy, text)
    assert run_fresh(toy, text, PYTHONHASHSEED="7") == first
    (toy / "toy_strange.py").write_text(strange + "# edited\n")
    assert run(toy, text) != first


def test_a_global_that_is_not_there_yet_is_not_remembered_as_missing():
    known = {}
    exec("def f(x):\n    return x + LATER", known)
    before = kernel_digest.digest(known["f"])
    known["LATER"] = 1.0
    assert kernel_digest.digest(known["f"]) != before


def test_sets_have_one_digest_whatever_their_order(toy, run):
    text = """
from sdpgrind.base.compiling import kernel_digest
from sdpgrind.base.compiling.compiled import compiled
NAMES = frozenset(("a", "b", "c", "d", "e"))
@compiled(fastmath={"reassoc", "contract", "nsz"})
def f(x):
    return x in {"north", "south", "east", "west"} or x in NAMES
print(kernel_digest.digest(f))
"""
    assert run(toy, text) == run_fresh(toy, text, PYTHONHASHSEED="2")


def test_numba_still_has_what_the_cache_stands_on():
    """Private parts of numba: where this fails, numba was changed, and `kernel_cache` must be read again
    beside it.
    """
    probe = FunctionCache(even.py_func)
    assert {"_cache_path", "_cache_file", "_impl", "_enabled", "_py_func"} <= set(vars(probe))
    assert set(FunctionCache.__mro__[1].__dict__) >= {
        "_index_key",
        "_load_overload",
        "_save_overload",
        "load_overload",
    }
    assert set(vars(IndexDataCacheFile("folder", "name", "stamp"))) == {
        "_cache_path", "_index_name", "_index_path", "_data_name_pattern", "_source_stamp", "_version",
    }  # fmt: skip
    assert IndexDataCacheFile("folder", "name", "stamp")._source_stamp == "stamp"
    assert {"rebuild", "reduce", "check_cachable", "locator"} <= set(dir(probe._impl))
    public = {name for name in dir(NullCache) if not name.startswith("_")}
    assert public == {"cache_path", "load_overload", "save_overload", "enable", "disable", "flush"}
    assert isinstance(even._cache, type(odd._cache)) and type(even._cache).__name__ == "KernelCache"
    assert even._type.dispatcher is even


def test_a_closed_kernel_has_no_machine_code_of_its_own():
    """Its callers have it: what it raises comes through them."""

    @compiled
    def _rooted(x):
        if x < 0.0:
            raise ValueError("x must be >= 0")
        return np.sqrt(x)

    @compiled
    def summed(x):
        return _rooted(x) + _rooted(x + 5.0)

    _rooted._cache.flush()  # what an earlier run left on disk
    for kernel in (_rooted, compiled(_rooted.py_func)):  # compiled, and loaded from the disk
        kernel.compile((types.float64,))
        (made,) = kernel.overloads.values()
        assert isinstance(made.library, LinkedLibrary)
        assert not made.library.codegen._engine.is_symbol_defined(made.fndesc.llvm_func_name)
    assert sum(kernel.stats.cache_hits.values()) == 1
    assert summed(4.0) == 5.0
    with pytest.raises(ValueError, match="x must be >= 0"):
        summed(-1.0)
