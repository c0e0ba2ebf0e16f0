"""The page of job files has every key that a reader asks for, with what it means."""

import importlib.util
import sys
import tomllib

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
