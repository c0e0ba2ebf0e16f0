"""What plans and records share: kinds, files and back, copies, one line; results do not import pictures."""

import ast
import copy
import importlib
import re
import tomllib

import pytest
import xarray as xr
from house_names import ROOT, SOURCE, modules

import sdpgrind
from sdpgrind.base import pictures, records
from sdpgrind.base.plans import Plan
from sdpgrind.base.records import Saved

ENTRIES = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]["sdpgrind.records"]
PLACES = {kind: place for kind, place in ENTRIES.items() if kind != "hwsim.journal"}
DRAWN = re.compile(r'drawn\("([\w.:]+)"')
FILES = {name: path for name in modules() if (path := SOURCE / f"{name.replace('.', '/')}.py").exists()}
NAMED = {name: DRAWN.findall(path.read_text()) for name, path in FILES.items()}


class Toy(Plan):
    kind = "toy.plan"

    def __init__(self, size):
        self.size = size

    @property
    def dataset(self):
        return xr.Dataset({"size": ((), self.size, {"units": "mm"})})

    @classmethod
    def restored(cls, dataset):
        return cls(float(dataset["size"]))

    def _told(self):
        return f"{self.size:g} mm"


def test_a_plan_is_saved_told_and_shared(tmp_path):
    toy = Toy(2.5)
    toy.save(tmp_path / "toy.nc")
    assert records.read(tmp_path / "toy.nc").attrs["kind"] == "toy.plan"
    assert repr(Toy.from_file(tmp_path / "toy.nc")) == repr(toy) == "Toy(2.5 mm)"
    assert copy.deepcopy(toy) is toy


def test_a_plan_without_a_way_back_is_none():
    with pytest.raises(TypeError, match="restored"):
        type("Half", (Toy,), {"restored": Plan.restored})(1.0)


def test_a_file_of_a_kind_that_is_gone_says_so(tmp_path):
    Toy(1.0).save(tmp_path / "toy.nc")
    with pytest.raises(ValueError, match=r"saved by this library; .*toy\.nc' holds toy\.plan"):
        sdpgrind.load(tmp_path / "toy.nc")


@pytest.mark.parametrize("kind", PLACES)
def test_the_class_of_a_kind_knows_it(kind):
    module, _, name = PLACES[kind].partition(":")
    cls = getattr(importlib.import_module(module), name)
    assert issubclass(cls, Saved) and cls._file_kind() == kind


PICTURE = re.compile(r"(?:^|_)(?:picture|plot)s?$")


def pictures_at_the_top(name):
    """Modules of pictures that a module imports when it is imported itself, or for type checkers."""
    text = FILES[name].read_text()
    if "picture" not in text and "plot" not in text:
        return set()
    tree = ast.parse(text)
    plain = [
        node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.col_offset in (0, 4)
    ]
    inside = {node for each in ast.walk(tree) if isinstance(each, ast.FunctionDef) for node in ast.walk(each)}
    named = {f"{node.module}.{alias.name}" for node in plain if node not in inside for alias in node.names}
    return {each for each in named if any(PICTURE.search(part) for part in each.split(".")[:-1])}


def test_only_pictures_import_pictures():
    """A result finds its picture by name when it is drawn; but for colours and the like in `base.pictures`."""
    results = [name for name in NAMED if not PICTURE.search(name.rpartition(".")[2])]
    found = {name: pictures_at_the_top(name) for name in results}
    assert len(results) > 300 and not {name: each for name, each in found.items() if each}


def test_an_import_of_a_picture_is_found():
    assert pictures_at_the_top("centering.push._plan.picture") == {
        f"centering.push._contact.trace_picture.{name}" for name in ("BLUE", "GREY", "RED")
    }


def test_labels_name_units_in_brackets():
    assert pictures.label("burn_depth", "mm") == "burn depth [mm]"
    assert pictures.label("friction_ratio") == "friction ratio"


@pytest.mark.parametrize("picture", sorted({each for found in NAMED.values() for each in found}))
def test_a_picture_that_is_named_is_there(picture):
    module, _, function = picture.partition(":")
    assert callable(getattr(importlib.import_module(module), function))
