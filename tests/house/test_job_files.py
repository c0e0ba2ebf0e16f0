"""The page of job files has every key that a reader asks for, with what it means."""

import copy
import importlib.util
import json
import math
import re
import sys
import tomllib
from contextlib import suppress
from importlib import import_module

import pytest
from house_names import ROOT

DOCS, EXAMPLES = ROOT / "docs", ROOT / "examples"


@pytest.fixture(scope="module")
def tables():
    spec = importlib.util.spec_from_file_location("job_keys", DOCS / "job_keys.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["job_keys"] = module  # its dataclasses look there
    spec.loader.exec_module(module)
    yield module
    del sys.modules["job_keys"]


def keys_of(entries, table=""):
    for key, value in entries.items():
        yield table, key
        if isinstance(value, dict):
            yield from keys_of(value, f"{table}.{key}".strip("."))


@pytest.mark.parametrize("command", ["weldbead", "plunge", "locus", "finishing", "centering"])
def test_every_key_stands_there_with_its_meaning(tables, command):
    found = tables.noted(command)
    given = tomllib.loads((EXAMPLES / f"{command}.toml").read_text(encoding="utf-8"))
    assert set(keys_of(given)) <= {(table, key) for table, keys in found.items() for key in keys}
    assert [f"{t}.{k}" for t, keys in found.items() for k, each in keys.items() if not each.meaning] == []
    page = (DOCS / "job_files" / f"{command}.rst").read_text(encoding="utf-8")
    assert page.endswith(f".. job-tables:: {command}\n") and "*Worst mistake*" in page


def test_a_row_tells_unit_default_and_range(tables):
    found = tables.noted("weldbead")
    radius, charge = found["process"]["disk_radius"], found[""]["pass_charge"]
    assert (radius.unit, radius.default, radius.must) == ("mm", "must be given", "> 0; in mm, some 90")
    assert (charge.unit, charge.default, charge.must) == ("$", "0", ">= 0")
    assert found[""]["process"].default == "must be given"
    assert found["stand"]["motor"].must == "one of process, air"
    assert (
        found["lateness_charge"]["linear"].unit == "$/s"
    )  # of a table that the example only has as a comment


def test_readers_are_as_before_once_the_page_is_made(tables):
    own = dict(vars(tables.Table))
    tables.noted("locus")
    assert dict(vars(tables.Table)) == own


def test_keys_that_only_a_file_of_its_own_needs(tables):
    """No example has a STEP file or a scan."""
    asked = tables.noted("finishing")["surface"]
    assert {"file", "unit", "face", "region"} <= set(asked)
    assert asked["face"].meaning == "Number of the face, from 0, where the file holds several."


OTHER_LAW = {
    "plunge": {"pressure", "curvature_pressure"},
    "locus": {"coefficient", "exponent"},
}  # not its own
COMMANDS = ["weldbead", "plunge", "locus", "finishing", "centering"]


def written(value):
    """A value of tomllib as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {written(each)}" for key, each in value.items()) + "}"
    return "inf" if value == math.inf else json.dumps(value, ensure_ascii=False)


def job_of(command, entries, tmp_path):
    path = tmp_path / "job.toml"
    path.write_text(
        "".join(f"{key} = {written(value)}\n" for key, value in entries.items()), encoding="utf-8"
    )
    return import_module(f"hwsim.command._{command}.toml").read(path)


def without(entries, table, key):
    """Entries without a key, and its table in them."""
    left = copy.deepcopy(entries)
    place = left
    for name in filter(None, table.split(".")):
        place = place[name]
    place.pop(key, None)
    return left, place


@pytest.mark.parametrize("command", COMMANDS)
def test_what_may_be_left_out_is_what_the_page_says(tables, command, tmp_path):
    found = tables.noted(command)
    given = tomllib.loads((EXAMPLES / f"{command}.toml").read_text(encoding="utf-8"))
    for table, key in keys_of(given):
        try:
            job_of(command, without(given, table, key)[0], tmp_path)
        except ValueError:
            optional = False
        else:
            optional = True
        assert optional == ("must be given" not in found[table][key].default), f"{table}.{key}"


def told(entry):
    """Default of a key as a value of TOML; None: it is in words, or has digits that the page does not show."""
    if entry.default in ("true", "false"):
        return entry.default == "true"
    if entry.default and entry.must.startswith("one of") and entry.default in entry.must:
        return entry.default
    if entry.default == "inf":
        return math.inf
    if re.fullmatch(r"-?[0-9.]+(e-?[0-9]+)?", entry.default) is None or len(entry.default) > 6:
        return None
    number = json.loads(entry.default)
    return f"{entry.default} {entry.unit}" if entry.unit not in ("", "1") else number


@pytest.mark.parametrize("command", COMMANDS)
def test_a_default_of_the_page_is_what_holds_where_the_key_is_left_out(tables, command, tmp_path):
    left_out = tomllib.loads((EXAMPLES / f"{command}.toml").read_text(encoding="utf-8"))
    as_told, count = left_out, 0
    for table, keys in tables.noted(command).items():
        for key, entry in keys.items():
            if key in OTHER_LAW.get(command, ()):
                continue
            with suppress(KeyError):  # no such table in the example
                if (value := told(entry)) is not None:
                    left_out, _ = without(left_out, table, key)
                    as_told, place = without(as_told, table, key)
                    place[key] = value
                    count += 1
    one, other = (job_of(command, each, tmp_path) for each in (left_out, as_told))
    assert one.stand == other.stand and count > 5
    if command == "finishing":
        assert as_told["controller"]["kind"] == "lqg"  # as a job without one is held


@pytest.mark.parametrize("command", COMMANDS)
def test_every_table_stands_there_with_its_keys(tables, command):
    found = tables.noted(command)
    parts = {
        f"{table}.{key}".strip(".")
        for table, keys in found.items()
        for key, each in keys.items()
        if each.must == tables.TABLE
    }
    assert parts <= set(found)
    folder = ROOT / "src" / "hwsim" / "command" / f"_{command}"
    asked = {
        name
        for module in folder.glob("*toml.py")
        for name in re.findall(r"\.(?:table|maybe)\(\s*\"(\w+)\"", module.read_text(encoding="utf-8"))
    }
    assert asked <= {table.rpartition(".")[2] for table in found}
