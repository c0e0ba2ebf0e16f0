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
ORIGIN = re.compile(r"source|derived|measured|chosen|\d{4}", re.IGNORECASE)
"""How a comment says where a number comes from; a year is that of a source."""
NUMBER = re.compile(r"^[\w([][\w, .[\]=*]*\)?[ ]*=[-+~([\s]*[\d.\\#]", re.MULTILINE)
"""How a line begins that gives a number, or several in brackets, to a name of a module."""
NO_REASON = re.compile(r"\bchosen[.;]?$", re.IGNORECASE)
"""End of a comment that says that a number was chosen and not why."""


PAGES = [
    *sorted(path for path in (ROOT / "docs").glob("*.rst") if path.name != "style.rst"),
    *sorted((ROOT / "docs/decisions").glob("*.rst")),
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
]
"""Pages of the documentation, but for the one that cites riddles; notes of decisions, README and changes."""


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
    if not RIDDLES.search(text):  # most files: nothing to take apart
        return []
    return [(line, found[0]) for line, said in told(text) if (found := RIDDLES.search(said))]


def without_origin(text):
    """Numbers at the top of a module whose comment does not say where they come from.

    Comments are above the number, on its line, or in a string below it.
    """
    if not NUMBER.search(text):  # many files: nothing to take apart
        return
    lines, body = text.splitlines(), ast.parse(text).body
    for node, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(node, ast.Assign) and _is_number(node.value):
            said = [
                *_above(lines, node.lineno),
                "".join(lines[node.lineno - 1 : node.end_lineno]).partition("#")[2],
            ]
            if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                said.append(str(after.value.value))
            if not ORIGIN.search(" ".join(said)) or any(NO_REASON.search(each.strip()) for each in said):
                yield node.lineno, ast.unparse(node)


def _above(lines, number):
    """The comment that ends in the line before line `number`, as one text."""
    begin = number - 1
    while begin and lines[begin - 1].startswith("#"):
        begin -= 1
    return [" ".join(line.strip("# ") for line in lines[begin : number - 1])]


def _is_number(value):
    if isinstance(value, ast.Tuple | ast.List):
        return bool(value.elts) and all(map(_is_number, value.elts))
    if isinstance(value, ast.BinOp):
        return _is_number(value.left) and _is_number(value.right)
    if isinstance(value, ast.UnaryOp):
        return _is_number(value.operand)
    return isinstance(value, ast.Constant) and isinstance(value.value, int | float)


def riddles_on_a_page(text):
    """Riddles of a page, with the number of their line; words in literals are names."""
    lines = re.sub(r"``[^`]*``", "", text).splitlines()
    return [(number, found[0]) for number, line in enumerate(lines, 1) if (found := RIDDLES.search(line))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_no_riddles_on_pages(page):
    assert not riddles_on_a_page(page.read_text())


def test_riddles_on_pages_are_found():
    assert riddles_on_a_page("It says\nby how much.") == [(2, "by how much")]
    assert not riddles_on_a_page("``gives way`` and giving")


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
    assert not list(without_origin("LAG = 0.2  # s; chosen: ours\n# measured: s\nLATE = 0.3\nNAME = 'x'\n"))
    assert list(without_origin("NEAR, FAR = 1, -2")) and list(without_origin("ENDS = [(0.1, 2), 3]  # mm"))
    assert list(without_origin("LAG = 0.2  # s; chosen"))
    assert list(without_origin("A = B = (\n    # s\n    -1,\n)")) and list(without_origin("A = \\\n    .5"))
    assert not list(without_origin("NEAR, FAR = range(2)\nLAG = 0.2\n'Time, s; derived: of the filter.'"))


def test_the_page_has_its_six_examples():
    page = (ROOT / "docs/style.rst").read_text()
    assert page.count("   * - ") == 7 and "   style\n" in (ROOT / "docs/index.rst").read_text()
    assert max(map(len, page.splitlines())) <= 110
