"""From each sample file to a plan: a page of the gallery, in at most twelve lines of code."""

import ast
import builtins
import tokenize
from collections.abc import Iterator
from io import StringIO

import pytest
from house_names import ROOT

FOLDER = "tests/data/samples/"
SAMPLES = sorted(
    path.name for path in (ROOT / FOLDER).iterdir() if path.name not in {"README.md", "truth.json"}
)
PAGES = sorted((ROOT / "docs/commissioning").glob("*.py"))
MOST = 12  # lines of code; source: the requirements


def statements(source: str) -> list[str]:
    """Statements of a page but its docstring, in their own words."""
    first, *rest = ast.parse(source).body
    assert isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return [ast.get_source_segment(source, each) or "" for each in rest]


def lines_of_code(statement: str) -> int:
    """Logical lines: a call over five lines is one, `try`, `except` and what they hold are four; `;` divides."""
    tokens = list(tokenize.generate_tokens(StringIO(statement).readline))
    return sum(token.type == tokenize.NEWLINE or token.string == ";" for token in tokens)


def samples_in(statement: str) -> list[str]:
    return [name for name in SAMPLES if FOLDER + name in statement]


def paths(source: str) -> Iterator[tuple[str, list[str]]]:
    """Each sample file of a page, and what is needed for it: what stands before all files, and its own part."""
    shared: list[str] = []
    own: dict[str, list[str]] = {}
    for statement in statements(source):
        for name in samples_in(statement):
            part = own.setdefault(name, [])
        (part if own else shared).append(statement)
    yield from ((name, shared + part) for name, part in own.items())


ALL = {name: path for page in PAGES for name, path in paths(page.read_text())}


def names_missing(path: list[str]) -> set[str]:
    """Names that are used, and bound nowhere on the path."""
    nodes = list(ast.walk(ast.parse("\n".join(path))))
    names = [node for node in nodes if isinstance(node, ast.Name)]
    bound = {node.id for node in names if isinstance(node.ctx, ast.Store)} | set(dir(builtins))
    bound |= {node.arg for node in nodes if isinstance(node, ast.arg)}
    bound |= {node.name or "" for node in nodes if isinstance(node, ast.ExceptHandler)}
    bound |= {node.asname or node.name for node in nodes if isinstance(node, ast.alias)}
    return {node.id for node in names if isinstance(node.ctx, ast.Load)} - bound


def test_each_sample_file_has_its_page():
    assert SAMPLES and set(ALL) == set(SAMPLES)


@pytest.mark.parametrize("name", sorted(ALL))
def test_a_plan_takes_few_lines(name):
    assert sum(map(lines_of_code, ALL[name])) <= MOST


@pytest.mark.parametrize("name", sorted(ALL))
def test_the_path_ends_in_a_plan_by_itself(name):
    path = ALL[name]
    called = [
        ast.unparse(node.func) for node in ast.walk(ast.parse("\n".join(path))) if isinstance(node, ast.Call)
    ]
    assert any(each.split(".")[-1] in {"plan", "plan_push"} for each in called)
    assert not names_missing(path)


def test_lines_are_counted_as_they_are_read():
    page = '"""Title"""\nimport a\n# text\nx = a.read(\n    "tests/data/samples/shaft.h5",\n)\ny = 1; z = x\n'
    page += "try:\n    a.plan(\n        w)\nexcept ValueError as error:\n    print(error)\n"
    assert [lines_of_code(each) for each in statements(page)] == [1, 1, 1, 1, 4]
    ((name, path),) = paths(page)
    assert name == "shaft.h5" and sum(map(lines_of_code, path)) == 8
    assert names_missing(path) == {"w"}
