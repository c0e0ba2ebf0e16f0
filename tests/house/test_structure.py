"""The house: which package may import which, what an import costs, what is exported, one version, nothing
forgotten.
"""

import ast
import re
import subprocess
import sys
import tomllib
from collections import Counter
from functools import cache

import pytest
from house_names import PACKAGES, ROOT, SOURCE, modules, package

AREAS = ("finishing", "locus", "plunge", "weldbead")
GROUND = ("sdpgrind", "sdpgrind.base")  # the package itself for its version only
ALLOWED = {
    "sdpgrind.base": GROUND,
    "sdpgrind.codegen": GROUND,
    "sdpgrind.sdp": (*GROUND, "sdpgrind.codegen"),
    "sdpgrind.identify": (*GROUND, "sdpgrind.codegen"),
    "sdpgrind.physics": GROUND,
    "sdpgrind.control": GROUND,
    **{
        f"sdpgrind.{area}": (
            *GROUND,
            *(f"sdpgrind.{name}" for name in ("codegen", "sdp", "identify", "physics", "control")),
        )
        for area in AREAS
    },
}


def imports(name):
    """Absolute names of the modules that a module imports, at its top or inside functions."""
    path = SOURCE.joinpath(*name.split("."))
    return facts(path / "__init__.py" if path.is_dir() else path.with_suffix(".py"))[0]


@cache
def facts(path):
    """Imports and classes of a file; its tree is not kept: the garbage collector would walk through all of them."""
    parsed = ast.parse(path.read_text())
    return imports_in(parsed), [node.name for node in parsed.body if isinstance(node, ast.ClassDef)]


def imports_of(text):
    return imports_in(ast.parse(text))


def statements(parsed):
    """All statements, those inside others too; expressions, most of a tree, hold none."""
    waiting = [parsed]
    while waiting:
        node = waiting.pop()
        yield node
        for inner in ("body", "handlers", "cases", "orelse", "finalbody"):
            waiting += getattr(node, inner, ())


def imports_in(parsed):
    found = set()
    for node in statements(parsed):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


@cache
def home(name):
    """The package of the arrows that a dotted name belongs to."""
    parts = name.split(".")
    if parts[0] != "sdpgrind":
        return parts[0]
    known = (SOURCE / "sdpgrind" / parts[1]).is_dir() if len(parts) > 1 else False
    return ".".join(parts[:2]) if known else "sdpgrind"


def forbidden(where, other):
    """Whether a package must not import another."""
    upwards = (where.startswith("sdpgrind") and other in ("hwsim", "centering")) or (where, other) == (
        "centering",
        "hwsim",
    )
    beside = (
        where in ALLOWED and other.startswith("sdpgrind") and other != where and other not in ALLOWED[where]
    )
    return upwards or beside


def test_arrows():
    wrong = {
        (name, other) for name in modules() for other in imports(name) if forbidden(home(name), home(other))
    }
    assert not wrong


@pytest.mark.parametrize(
    "where",
    [
        "{}", "def f():\n {}", "class A:\n async def f(self):\n  {}", "if a:\n b\nelse:\n {}",
        "try:\n a\nexcept B:\n {}", "try:\n a\nfinally:\n {}", "for a in b:\n {}", "while a:\n b\nelse:\n {}",
        "with a:\n {}", "match a:\n case 1:\n  {}",
    ],
)  # fmt: skip
def test_imports_are_found_wherever_they_stand(where):
    parsed = ast.parse(where.format("import hwsim"))
    assert imports_in(parsed) == {"hwsim"} and set(statements(parsed)) <= set(ast.walk(parsed))


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


THEMES = {
    "sdpgrind.codegen": ("_translate", "_names", "_program", "_recipe", "_tables", "_math", "_files", "_proof", "_fmi", "_exported", "_export"),
    "sdpgrind.sdp": ("_distributions", "_problem", "_transitions", "_solve", "_policy", "_plan"),
    "sdpgrind.weldbead": ("force", "sequence", "_identify", "_doubts", "passes", "_hierarchy", "_plant"),
    "sdpgrind.plunge": ("_model", "_control", "_plant", "_stages", "_plan", "_identify", "_doubts", "learning"),
    "sdpgrind.locus": (
        "_problem", "processes", "_identify", "_trace", "_path", "_curve", "_doubts", "gains", "_adaptation", "_robust", "_control",
        "_plant",
    ),
    "sdpgrind.finishing": (
        "study", "surface", "path", "arm", "timing", "torque", "roughness", "placement", "_program", "_problem", "_doubts", "_plant",
    ),
    "centering": (
        "_problem", "circle", "roundness", "monitoring", "setup", "push", "friction", "cycle", "_identify", "_doubts", "_plant",
    ),
    "hwsim": (
        "protocols", "devices", "_part", "faults", "io", "_log", "_processor", "_live", "_loop", "_replay", "_link", "plants", "_study", "_report",
        "command", "opcua", "cli",
        "__main__",
    ),
}  # fmt: skip
"""Themes of an area, from the ground up: imports run downward."""
# what an area shows to other packages, and what `warm` does: above all of its themes
TOP = ("kernels", "_first_use")


def area(name):
    """The area that a module belongs to: its private names are those of the whole area."""
    return next((known for known in THEMES if f"{name}.".startswith(f"{known}.")), home(name))


def theme(name):
    """Place of a module's theme in its area, from the ground up; -1 outside, and for the area itself."""
    rest = name.removeprefix(area(name)).split(".")
    names = (*THEMES.get(area(name), ()), *TOP)
    return names.index(rest[1]) if len(rest) > 1 and rest[1] in names else -1


def upward(name, imported):
    """What a module imports from a higher theme of its own area."""
    return {
        (name, other) for other in imported if area(other) == area(name) and theme(other) > theme(name) >= 0
    }


def test_imports_run_downward_between_themes():
    assert not {each for name in modules() for each in upward(name, imports(name))}


def test_upward_imports_are_found():
    assert upward(
        "centering.push._plan.push", {"centering.cycle._control.states", "centering.circle", "hwsim.cli"}
    ) == {("centering.push._plan.push", "centering.cycle._control.states")}
    assert upward("sdpgrind.plunge._model.model", {"sdpgrind.plunge.kernels"})


def test_every_theme_has_its_place():
    for where, themes in THEMES.items():
        folder = SOURCE.joinpath(*where.split("."))
        found = {path.name for path in folder.iterdir() if (path / "__init__.py").exists()}
        found |= {path.stem for path in folder.glob("*.py")} - {"__init__", *TOP}
        assert found == set(themes), where


def first_sentence(name):
    """First line of the docstring of a package or a module."""
    path = SOURCE.joinpath(*name.split("."))
    text = (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text()
    return ast.get_docstring(ast.parse(text)).splitlines()[0]


def is_room(name):
    """Whether a folder or a module has a line of its own: folders of an area, and what lies beside them."""
    folder = SOURCE.joinpath(*name.split("."), "__init__.py").exists()
    if name.startswith("sdpgrind.base"):
        return folder or name.count(".") == 2
    beside = name.rpartition(".")[0] in THEMES and not name.endswith(("__main__", *TOP))
    return theme(name) >= 0 and (folder or beside)


def test_every_room_stands_on_the_page():
    """With the sentence of its docstring."""
    page = (ROOT / "docs" / "rooms.rst").read_text()
    listed = re.findall(r"^``([\w.]+)``\n    (.+)$", page, re.M)
    rooms = {*filter(is_room, modules()), "sdpgrind.identify", "sdpgrind.physics", "sdpgrind.control"}
    told = {name: first_sentence(name) for name in rooms}
    assert dict(listed) == told and len(listed) == len(told)
    assert len(set(told.values())) == len(told) and all(len(text.split()) > 5 for text in told.values())


@cache
def _known():
    return frozenset(modules())


@cache
def neighbours(name):
    """Modules of ours that a module imports, at its top or inside functions."""
    known, found = _known(), set()
    for other in imports(name):
        while other and other not in known:
            other = other.rpartition(".")[0]
        found |= {other} - {"", name}
    return found


def circles(graph):
    """Modules that reach themselves."""
    found = set()
    for start in graph:
        seen, waiting = set(), list(graph[start])
        while waiting:
            name = waiting.pop()
            if name not in seen:
                seen.add(name)
                waiting += graph.get(name, ())
        found |= {start} & seen
    return found


def test_no_circle_of_modules():
    assert not circles({name: neighbours(name) for name in modules()})


def test_circles_are_found():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}) == {"b", "c"}


def underscores(name):
    return sum(part.startswith("_") and not part.startswith("__") for part in name.split("."))


def test_one_underscore_on_a_path():
    """At the first level that users may not name: public packages hold private modules, private ones plain
    names.
    """
    open_names = {
        *PACKAGES,
        *(f"{where}.kernels" for where in PACKAGES),
        "hwsim.cli",
        "hwsim.__main__",
        "hwsim.plants",
        "hwsim.io",
        "hwsim.command",
        "hwsim.command.base",
    }
    for name in modules():
        expected = 0 if name in open_names or name.startswith("sdpgrind.base") else 1
        assert underscores(name) == expected, name


def owner(name):
    """The area whose private name this is, or None."""
    return area(name) if underscores(name) else None


def trespasses(name, imported):
    """Private names of other areas among what a module imports."""
    ours = {other for other in imported if other.split(".")[0] in ("sdpgrind", "hwsim", "centering")}
    return {other for other in ours if owner(other) not in (None, area(name))}


def test_private_names_stay_at_home():
    assert not {(name, other) for name in modules() for other in trespasses(name, imports(name))}


def test_trespasses_are_found():
    found = imports_of(
        "from sdpgrind.control._law import Law\nfrom sdpgrind.weldbead.sequence import _burn\n"
        "import numpy._core\nimport hwsim.plants._x"
    )
    assert trespasses("sdpgrind.weldbead.force._drive", found) == {
        "sdpgrind.control._law.Law",
        "hwsim.plants._x",
    }
    assert trespasses("hwsim._loop.loop", found) == {
        "sdpgrind.control._law.Law",
        "sdpgrind.weldbead.sequence._burn",
    }
    assert trespasses("sdpgrind.control", found) == {"sdpgrind.weldbead.sequence._burn", "hwsim.plants._x"}
    assert trespasses("sdpgrind.controls", {"sdpgrind.control._law"}) == {"sdpgrind.control._law"}
    assert owner("sdpgrind.__version__") is None


HEAVY = (
    "numba", "xarray", "matplotlib", "scipy", "pandas", "distributed", "jinja2", "h5py", "nptdms", "asyncua", "cryptography",
)  # fmt: skip


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
    assert not _loaded("import hwsim; hwsim.Log") & set(HEAVY)


@pytest.mark.parametrize("name", PACKAGES)
def test_faces(name):
    """Every public name is there, and nothing else is shown."""
    face = package(name)
    assert dir(face) == sorted(set(face.__all__)) and len(face.__all__) == len(dir(face))
    for entry in face.__all__:
        assert getattr(face, entry) is not None
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = face.nothing


AT_MOST = {
    "sdpgrind.weldbead": 25,
    "sdpgrind.plunge": 25,
    "sdpgrind.locus": 26,
    "sdpgrind.finishing": 39,  # five for robots, three for programs, parts and scans, two for placements, one for sequences
    "centering": 35,
}


@pytest.mark.parametrize("name", PACKAGES)
def test_a_face_is_small(name):
    assert len(package(name).__all__) <= AT_MOST.get(name, 45)


def test_names_of_version_0_1_warn():
    import centering
    from sdpgrind import finishing

    with pytest.warns(
        DeprecationWarning, match=r"centering\.ring_friction is now centering\.push\.turning\.ring_friction"
    ) as told:
        assert centering.ring_friction is centering.push.turning.ring_friction
    assert told[0].filename == __file__
    with pytest.warns(
        DeprecationWarning, match=r"finishing\.sn_ratio is now sdpgrind\.finishing\.study\.sn_ratio"
    ) as told:
        from sdpgrind.finishing import sn_ratio
    assert sn_ratio is finishing.study.sn_ratio and told[0].filename == __file__


def test_every_public_package_is_here():
    public = {name for name in modules() if not any(part.startswith("_") for part in name.split("."))}
    hidden = ("hwsim.cli", "hwsim.plants", "hwsim.io", "hwsim.command", "hwsim.command.base")
    inner = {name for name in public if ".base" in name or name in hidden or name.endswith(".kernels")}
    assert public - inner <= set(PACKAGES) and set(PACKAGES) - public <= {"sdpgrind.units"}


def test_one_version():
    import sdpgrind

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    cited = re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.M)
    changed = re.search(r"^## \[(\d.*?)\]", (ROOT / "CHANGELOG.md").read_text(), re.M)
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
    skipped = {
        "__pycache__",
        "_build",
        "gallery",
        ".mypy_cache",
        ".ruff_cache",
        ".pytest_cache",
        ".hypothesis",
    }
    paths = [path for path in paths if path.suffix in endings and not skipped & set(path.parts)]
    return [
        *paths,
        *(
            path
            for path in ROOT.iterdir()
            if path.is_file() and path.suffix in endings and path.name[0] != "."
        ),
    ]


FORGOTTEN = re.compile(r"\b(?:TO" + r"DO|FIX" + r"ME|X" + r"XX)\b|\bNotImplemented" + r"Error\b")
ABSOLUTE = re.compile(r"""["'`\s(=](?:/(?:home|root|work|Users|opt)/|[A-Z]:\\\\)""")


def test_nothing_is_forgotten():
    texts = {str(path.relative_to(ROOT)): path.read_text() for path in tracked()}
    found = {
        name: each[0]
        for name, text in texts.items()
        if (each := FORGOTTEN.search(text) or ABSOLUTE.search(text))
    }
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
        assert all(
            f"\n{part}\n{'-' * len(part)}\n" in text for part in ("Context", "Decision", "Consequences")
        ), path.name


SHARED = {
    "FrictionEstimator": 2,  # public in weldbead and in centering
    "Job": 6,  # plug-ins of the command line
    "Law": 2,  # public in sdp and in control
    "LoopRecord": 2,  # public in weldbead.force and in locus
    "Point": 2,  # public in sdp and in locus
    "Problem": 2,  # public in sdp and in locus
    "Sampled": 2,  # public in sdp and in control
}
"""Class names that several namespaces had in public in 0.1, and plug-ins of one protocol."""


def test_one_class_a_name():
    found = {}
    for path in SOURCE.rglob("*.py"):
        for name in facts(path)[1]:
            found.setdefault(name, []).append(path)
    assert {name: len(paths) for name, paths in found.items() if len(paths) > 1} == SHARED


def test_one_test_file_a_name():
    """Pytest collects no two files of one name, and says so only where it collects both."""
    names = Counter(path.name for path in (ROOT / "tests").rglob("test_*.py"))
    assert [name for name, times in names.items() if times > 1] == []
