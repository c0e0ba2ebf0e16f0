"""Modules of `hwsim` import each other in one direction only, imports for the type checker included."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import hwsim

HOME = Path(hwsim.__file__).parent


def named(node):
    """Names that a statement may import, the most precise first."""
    if isinstance(node, ast.Import):
        return [[alias.name] for alias in node.names]
    return [[f"{node.module}.{alias.name}", node.module] for alias in node.names]


def imports(text, known):
    """Modules among `known` that a text imports, wherever in it."""
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom)]
    found = [next((name for name in names if name in known), None) for node in nodes for names in named(node)]
    return {name for name in found if name is not None}


def graph(texts):
    return {name: imports(text, texts) for name, text in texts.items()}


def modules():
    files = {file: file.relative_to(HOME.parent).with_suffix("").parts for file in HOME.rglob("*.py")}
    return {".".join(parts).removesuffix(".__init__"): file.read_text() for file, parts in files.items()}


def test_no_circles():
    edges = graph(modules())
    assert "hwsim.protocols" in edges["hwsim._part.part"] and len(edges) > 20
    assert list(TopologicalSorter(edges).static_order())


def test_circles_are_found():
    texts = {
        "a.b": "from a import c",
        "a.c": "def f():\n    if TYPE_CHECKING:\n        from a.b import x",
        "a": "import a.b",
    }
    assert graph(texts) == {"a.b": {"a.c"}, "a.c": {"a.b"}, "a": {"a.b"}}
    with pytest.raises(CycleError):
        list(TopologicalSorter(graph(texts)).static_order())
