"""English of docs/style.rst, as far as a machine can tell: phrases that go, lines, constants that say their
source.
"""

import ast
import io
import re
import tokenize

import pytest
from house_names import ROOT, SOURCE

RIDDLES = re.compile(r"\breckon\w*|\bgiv(?:es?|en|ing) way\b|\b[Bb]y how much\b")
ORIGIN = re.compile(r"source|derived|measured|chosen|\d{4}")
"""How a comment says where a number comes from; a year is that of a source."""


def files():
    return sorted(SOURCE.rglob("*.py"))


def told(text):
    """Docstrings and comments, with the number of their line."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and (
            said := ast.get_docstring(node)
        ):
            yield getattr(node, "lineno", 1), said
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def riddles(text):
    return [(line, found[0]) for line, said in told(text) if (found := RIDDLES.search(said))]


def without_origin(text):
    """Numbers at the top of a module whose comment, on their line or above, does not say where they come
    from.
    """
    lines = text.splitlines()
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign) and _is_number(node.value):
            above = (
                lines[node.lineno - 2] if node.lineno > 1 and lines[node.lineno - 2].startswith("#") else ""
            )
            if not ORIGIN.search(above + "".join(lines[node.lineno - 1 : node.end_lineno]).partition("#")[2]):
                yield node.lineno, ast.unparse(node)


def _is_number(value):
    if isinstance(value, ast.BinOp):
        return _is_number(value.left) and _is_number(value.right)
    return isinstance(value, ast.Constant) and isinstance(value.value, int | float)


def test_no_riddles():
    assert files()
    assert not {
        str(path.relative_to(SOURCE)): found for path in files() if (found := riddles(path.read_text()))
    }


def test_constants_say_where_they_come_from():
    found = {str(path.relative_to(SOURCE)): list(without_origin(path.read_text())) for path in files()}
    assert not {name: each for name, each in found.items() if each}


@pytest.mark.parametrize(
    "text", ['"""By how much it moves."""', "x = 1  # it gives way", 'def f():\n    """Reckoned."""']
)
def test_riddles_are_found(text):
    assert riddles(text.replace("Reckoned", "It is reckoned")) and not riddles('word = "it gives way"')


def test_constants_without_origin_are_found():
    assert list(without_origin("LAG = 0.2  # s")) == [(1, "LAG = 0.2")]
    assert list(without_origin("MOST = 2**16"))
    assert not list(without_origin("LAG = 0.2  # s; chosen\n# measured: s\nLATE = 0.3\nNAME = 'x'\n"))


def test_the_page_has_its_six_examples():
    page = (ROOT / "docs/style.rst").read_text()
    assert page.count("   * - ") == 7 and "   style\n" in (ROOT / "docs/index.rst").read_text()
    assert max(map(len, page.splitlines())) <= 110
