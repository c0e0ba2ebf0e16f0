"""The house: which package may import which, what an import costs, what is exported, one version, nothing forgotten."""

import ast
import importlib
import re
import subprocess
import sys
import tomllib
from functools import cache

import pytest
from house_names import PACKAGES, ROOT, SOURCE, modules, package

AREAS = ("finishing", "locus", "plunge", "weldbead")
GROUND = ("sdpgrind", "sdpgrind.base")  # the package itself for its version only
ALLOWED = {
    "sdpgrind.base": GROUND,
    "sdpgrind.sdp": GROUND,
    "sdpgrind.identify": GROUND,
    "sdpgrind.physics": GROUND,
    "sdpgrind.control": GROUND,
    **{
        f"sdpgrind.{area}": (*GROUND, *(f"sdpgrind.{name}" for name in ("sdp", "identify", "physics", "control")))
        for area in AREAS
    },
}


@cache
def imports(name):
    """Absolute names of the modules that a module imports, at its top or inside functions."""
    path = SOURCE.joinpath(*name.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return imports_of(path.read_text())


def imports_of(text):
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def home(name):
    """The package of the arrows that a dotted name belongs to."""
    parts = name.split(".")
    if parts[0] != "sdpgrind":
        return parts[0]
    known = (SOURCE / "sdpgrind" / parts[1]).is_dir() if len(parts) > 1 else False
    return ".".join(parts[:2]) if known else "sdpgrind"


def forbidden(where, other):
    """Whether a package must not import another."""
    upwards = (where.startswith("sdpgrind") and other in ("hwsim", "centering")) or (where, other) == ("centering", "hwsim")
    beside = where in ALLOWED and other.startswith("sdpgrind") and other != where and other not in ALLOWED[where]
    return upwards or beside


def test_arrows():
    wrong = {(name, other) for name in modules() for other in imports(name) if forbidden(home(name), home(other))}
    assert not wrong


def test_arrows_can_be_broken():
    assert imports_of("def f():\n    from sdpgrind import weldbead") == {"sdpgrind.weldbead"}
    assert home("sdpgrind.weldbead.sequence._policy") == "sdpgrind.weldbead"
    assert home("sdpgrind.__version__") == "sdpgrind"
    for where, other in (
        ("sdpgrind.sdp", "sdpgrind.weldbead"),
        ("sdpgrind", "hwsim"),
        ("sdpgrind.sdp", "centering"),
        ("centering", "hwsim"),
    ):
        assert forbidden(where, other)
    for where, other in (
        ("sdpgrind.weldbead", "sdpgrind.sdp"),
        ("hwsim", "centering"),
        ("centering", "sdpgrind.sdp"),
        ("sdpgrind.sdp", "numpy"),
    ):
        assert not forbidden(where, other)


def test_every_package_has_its_arrows():
    for folder in (SOURCE / "sdpgrind").iterdir():
        if (folder / "__init__.py").exists():
            assert f"sdpgrind.{folder.name}" in ALLOWED


FLOORS = ("_geometry", "_roundness", "_handover", "_push", "_friction", "_cycle")
"""Folders of `centering`, from the ground up."""


def floor(name):
    parts = name.split(".")
    return FLOORS.index(parts[1]) if parts[0] == "centering" and len(parts) > 1 and parts[1] in FLOORS else -1


def test_floors_of_centering():
    own = [name for name in modules() if floor(name) >= 0]
    above = {(name, other) for name in own for other in imports(name) if floor(other) > floor(name)}
    assert own and not above


def test_every_folder_of_centering_has_its_floor():
    assert {path.name for path in (SOURCE / "centering").iterdir() if (path / "__init__.py").exists()} == set(FLOORS)
    assert (
        floor("centering.setup._changeover_plan")
        > floor("centering.roundness._profile.Profile")
        > floor("centering.circle._fit.fit")
        >= 0
    )


# What stands below a name that begins with _ belongs to the package around it; `hwsim.plants` is a folder of `hwsim`.
FOLDERS = {"hwsim.plants": "hwsim"}
STILL_PRIVATE = {("sdpgrind.weldbead.sequence._problem", "sdpgrind.sdp._problem.charges.check_function")}
"""Known faults. Do not add any: give the name a public home, as `sdpgrind.control.kernels` is one."""


def owner(name):
    """The package whose private name this is, or None."""
    parts = name.split(".")
    private = [k for k, part in enumerate(parts) if part.startswith("_") and not part.startswith("__")]
    package = ".".join(parts[: private[0]]) if private else None
    return FOLDERS.get(package, package)


def trespasses(name, imported):
    """Private names of other packages among what a module imports."""
    return {other for other in imported if other.split(".")[0] in ("sdpgrind", "hwsim", "centering")} - {
        other for other in imported if owner(other) is None or f"{name}.".startswith(f"{owner(other)}.")
    }


def test_private_names_stay_at_home():
    """But for the known faults, which are still there."""
    assert {(name, other) for name in modules() for other in trespasses(name, imports(name))} == STILL_PRIVATE


def test_trespasses_are_found():
    found = imports_of(
        "from sdpgrind.control._law import Law\nfrom sdpgrind.weldbead.sequence import _burn\nimport numpy._core\nimport hwsim.plants._x"
    )
    assert trespasses("sdpgrind.weldbead.force._drive", found) == {"sdpgrind.control._law.Law", "hwsim.plants._x"}
    assert trespasses("hwsim._loop.loop", found) == {"sdpgrind.control._law.Law", "sdpgrind.weldbead.sequence._burn"}
    assert trespasses("sdpgrind.control", found) == {"sdpgrind.weldbead.sequence._burn", "hwsim.plants._x"}
    assert trespasses("sdpgrind.controls", {"sdpgrind.control._law"}) == {"sdpgrind.control._law"}
    assert owner("sdpgrind.__version__") is None


HEAVY = ("numba", "xarray", "matplotlib", "scipy.stats", "pandas", "distributed")


def _loaded(statement):
    """What a fresh interpreter has loaded after a statement."""
    done = subprocess.run(
        [sys.executable, "-c", f"{statement}\nimport sys\nprint(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    return set(done.stdout.split())


def test_importing_the_package_is_light():
    loaded = _loaded("import sdpgrind")
    assert not loaded & set(HEAVY)
    assert len(loaded) < 400  # numpy alone brings some 150


def test_importing_the_machines_is_light():
    assert not _loaded("import hwsim") & set(HEAVY)


def test_lazy_names_are_there():
    for where in ("sdpgrind", "hwsim"):
        home = importlib.import_module(where)
        assert dir(home) == home.__all__
        for name in home.__all__:
            assert getattr(home, name) is not None
        with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
            _ = home.nothing


@pytest.mark.parametrize("name", PACKAGES)
def test_exports(name):
    names = package(name).__all__
    constants = [entry for entry in names if entry.isupper()]  # ruff puts these first
    classes = [entry for entry in names if entry[0].isupper() and not entry.isupper()]
    rest = [entry for entry in names if entry[0].islower()]
    assert names == [*sorted(constants), *sorted(classes), *sorted(rest)]
    assert len(set(names)) == len(names)
    for entry in names:
        assert hasattr(package(name), entry)


def test_every_public_package_is_here():
    public = {name for name in modules() if not any(part.startswith("_") for part in name.split("."))}
    inner = {name for name in public if ".base" in name or name in ("hwsim.cli", "hwsim.plants") or name.endswith(".kernels")}
    assert public - inner <= set(PACKAGES) and set(PACKAGES) - public <= {"sdpgrind.units"}


@pytest.mark.parametrize("name", PACKAGES)
def test_what_a_package_imports_it_exports(name):
    """Public names that an ``__init__`` imports from its own private modules stand in its ``__all__``."""
    path = SOURCE.joinpath(*name.split(".")) / "__init__.py"
    if not path.exists():
        return
    own = [each for each in imports_of(path.read_text()) if each.startswith(f"{name}._")]
    assert {each.rpartition(".")[2] for each in own if not each.rpartition(".")[2].startswith("_")} <= set(package(name).__all__)


def test_one_version():
    import sdpgrind

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    cited = re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.M)
    changed = re.search(r"^## \[(.*?)\]", (ROOT / "CHANGELOG.md").read_text(), re.M)
    assert project["version"] == sdpgrind.__version__ == cited[1] == changed[1]


def test_the_sources_are_cited():
    cited = (ROOT / "CITATION.cff").read_text()
    for author in ("Brown", "Dong", "Koren", "Wang", "Mears"):
        assert f"family-names: {author}" in cited
        assert author in (ROOT / "docs/sources.rst").read_text()


def tracked():
    """Text files of the project."""
    folders = ("src", "tests", "docs", "benchmarks", "examples", ".ci")
    endings = {".py", ".md", ".rst", ".toml", ".cff", ""}
    paths = [path for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file()]
    skipped = {"__pycache__", "_build", "gallery", ".mypy_cache", ".ruff_cache", ".pytest_cache", ".hypothesis"}
    paths = [path for path in paths if path.suffix in endings and not skipped & set(path.parts)]
    return [
        *paths,
        *(path for path in ROOT.iterdir() if path.is_file() and path.suffix in endings and path.name[0] != "."),
    ]


FORGOTTEN = re.compile(r"\b(?:TO" + r"DO|FIX" + r"ME|X" + r"XX)\b|\bNotImplemented" + r"Error\b")
ABSOLUTE = re.compile(r"""["'`\s(=](?:/(?:home|root|work|Users|opt)/|[A-Z]:\\\\)""")


def test_nothing_is_forgotten():
    texts = {str(path.relative_to(ROOT)): path.read_text() for path in tracked()}
    found = {name: each[0] for name, text in texts.items() if (each := FORGOTTEN.search(text) or ABSOLUTE.search(text))}
    assert "tests/house/test_structure.py" in texts and not found


def test_what_is_forgotten_would_be_found():
    for text in ("# TO" + "DO: later", "raise NotImplemented" + "Error", "FIX" + "ME"):
        assert FORGOTTEN.search(text)
    for text in ('path = "/ho' + 'me/me/x"', "see /wo" + "rk/main", '"C' + ':\\\\data"'):
        assert ABSOLUTE.search(text)
    assert not FORGOTTEN.search("to do") and not ABSOLUTE.search("docs/work/x")


def test_decisions_are_numbered_and_complete():
    notes = sorted((ROOT / "docs/decisions").glob("0*.rst"))
    assert [path.name[:4] for path in notes] == [f"{k + 1:04d}" for k in range(len(notes))]
    for path in notes:
        text = path.read_text()
        assert all(f"\n{part}\n{'-' * len(part)}\n" in text for part in ("Context", "Decision", "Consequences")), path.name
