"""The reference holds every public name once; each page begins with its table; no page is far away."""

import importlib.util
import inspect
import re
from functools import cache

import pytest
from house_names import PACKAGES, ROOT, package

DOCS = ROOT / "docs"
PAGES = sorted(path for path in (DOCS / "api").glob("*.rst") if path.stem != "index")
LISTED = re.compile(r"^\.\. auto(\w+):: ((?:sdpgrind|centering|hwsim)[\w.]*)\.(\w+)$", re.MULTILINE)
VERBS = ("preset", "plan", "identify")
LINK = re.compile(r":doc:`(?:[^`<]*<)?/?([\w./]+)>?`")
ENTRY = re.compile(r"^   ([\w./*]+)$", re.MULTILINE)


@cache
def public():
    """Every public thing that is no package, by the packages that show it and its name."""
    return {
        (face, name): getattr(package(face), name)
        for face in PACKAGES
        for name in package(face).__all__
        if not inspect.ismodule(getattr(package(face), name))
    }


def listed():
    return [
        (page, kind, face, name)
        for page in PAGES
        for kind, face, name in LISTED.findall(page.read_text(encoding="utf-8"))
        if kind != "module"
    ]


def test_every_name_stands_exactly_once():
    things, found = public(), listed()
    assert {(face, name) for *_, face, name in found} <= things.keys()
    told = [id(things[face, name]) for *_, face, name in found]
    missing = sorted(where for where, thing in things.items() if id(thing) not in set(told))
    assert not missing and len(told) == len(set(told))


def test_every_entry_has_its_directive():
    for *_, kind, face, name in listed():
        thing = public()[face, name]
        kinds = (
            ("class", "exception") if inspect.isclass(thing) else ("function" if callable(thing) else "data",)
        )
        assert kind in kinds, name


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_begins_with_its_table(page):
    text = page.read_text(encoding="utf-8").splitlines()
    assert set(text[1]) == {"="} and text[3] == ".. entries::"


@pytest.mark.parametrize(
    "area", ["sdpgrind.weldbead", "sdpgrind.plunge", "sdpgrind.locus", "sdpgrind.finishing", "centering"]
)
def test_the_main_verbs_come_first(area):
    names = [name for page, _, _, name in listed() if page.stem == area]
    verbs = [verb for verb in VERBS if hasattr(package(area), verb)]
    assert names[: len(verbs)] == verbs
    problem, _, controller = names[len(verbs) : len(verbs) + 3]  # the plan is between them
    assert problem.endswith("Problem") and controller.endswith("Controller")


def page_sections():
    spec = importlib.util.spec_from_file_location("page_sections", DOCS / "page_sections.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_tables_are_read_from_the_page():
    text = "T\n=\n\n.. toctree::\n\n   hwsim.devices\n\nA\n---\n\n.. autofunction:: hwsim.run\n.. autoclass:: hwsim.Log\n"
    assert page_sections().sections(text) == {"A": ["hwsim.run", "hwsim.Log"], "Packages": ["hwsim.devices"]}


def linked(page):
    """Pages that a page links to, by name; a gallery leads to its scripts."""
    if page.startswith("gallery/"):
        folder = DOCS / page.split("/")[1]
        return (
            {f"gallery/{folder.name}/{path.stem}" for path in folder.glob("*.py")}
            if page.endswith("index")
            else set()
        )
    text = (DOCS / f"{page}.rst").read_text(encoding="utf-8")
    trees = "".join(part for part in re.split(r"^\.\. ", text, flags=re.M) if part.startswith("toctree::"))
    home, found = (DOCS / page).parent, set()
    for name in {*LINK.findall(text), *ENTRY.findall(trees)}:
        found |= {path.with_suffix("") for path in home.glob(f"{name}.rst")} if "*" in name else {home / name}
    return {path.relative_to(DOCS).as_posix() for path in found}


def clicks():
    """Least number of clicks from the landing page, by page."""
    found, frontier = {"index": 0}, {"index"}
    while frontier:
        count = found[min(frontier)] + 1
        frontier = {name for page in frontier for name in linked(page)} - found.keys()
        found |= dict.fromkeys(frontier, count)
    return found


def test_every_page_is_within_three_clicks():
    shared = {"published"}  # the table of all reproductions
    pages = {
        str(path.relative_to(DOCS).with_suffix(""))
        for path in DOCS.rglob("*.rst")
        if path.stem not in {"GALLERY_HEADER", *shared} and not {"_build", "gallery"} & set(path.parts)
    }
    for header in DOCS.glob("*/GALLERY_HEADER.rst"):
        pages |= {
            f"gallery/{header.parent.name}/{path.stem}"
            for path in header.parent.glob("*.py")
            if path.stem not in shared
        }
    found = clicks()
    assert pages <= found.keys(), f"no link leads to {sorted(pages - found.keys())}"
    assert max(found[page] for page in pages) <= 3


def test_a_file_is_read_within_one_click():
    assert {"data", "quickstart"} <= linked("index")
