"""Pages: valid HTML that needs nothing else, one unit a quantity, names from files escaped, changes found."""

import math
import re
import sys
import unicodedata

import html5lib
import pytest

from sdpgrind.base.sheets import seal
from sdpgrind.base.sheets.amounts import Amounts, Interval
from sdpgrind.base.sheets.blocks import (
    AmountTable,
    Blanks,
    Embedded,
    Heading,
    Picture,
    Sentences,
    from_plain,
    scales_of,
)
from sdpgrind.base.sheets.page import html, report

NASTY = "</script><!--<script>alert(1)</script>\x00\ufffe"
ADDRESS = re.compile(r"""\w+://[^"'\s<]+|(?:src|href|action)="(?!#|data:)|url\((?!#)|@import""")


def lines():
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2)
    left.plot([math.sin(0.01 * k) for k in range(5001)])
    left.set_title("a < b & $x^2$")
    right.bar([1, 2], [0.003, 1.0], hatch="//")
    return figure


def nothing():
    raise ValueError("no quantity has a reading")


def blocks():
    times = AmountTable(
        "Every part",
        [
            Amounts.of("part", range(3)),
            Amounts.of("time", [12.125, math.nan, 12.5], "s"),
            Amounts.of("roundness", [0.003, 0.0029, math.inf], "mm"),
            Amounts.of(NASTY, [NASTY, "", "lost"]),
        ],
    )
    rows = [
        Amounts.of("roundness", [0.003, 2, Interval(0.00295, 0.00002)], "mm"),
        Amounts.of("time", [12.5, 0, Interval(12.0, 0.0)], "s"),
    ]
    return [
        Sentences(["three parts", NASTY], strong=True),
        Heading(NASTY),
        AmountTable("Worst", rows, ("figure", "worst", "part", "mean")),
        Picture("left", lines),
        Picture("right", lines),
        Picture("none", nothing),
        times,
        Embedded("job", {"seed": 7, "toml": NASTY}),
        Blanks(["name", "date", "signature"]),
    ]


@pytest.fixture(scope="module")
def page():
    return html("Job " + NASTY, blocks())


def test_the_page_is_html_that_needs_nothing_else(page):
    html5lib.HTMLParser(strict=True).parse(page)
    assert {found.split("/")[2] for found in ADDRESS.findall(page)} == {"www.w3.org"}  # namespaces
    namespaces = re.findall(r'xmlns(?::\w+)?="[^"]*"', page)
    assert not ADDRESS.search(re.sub(r'xmlns(?::\w+)?="[^"]*"', "", page)) and namespaces
    assert "size: A4" in page and "break-inside: avoid" in page


def test_an_address_would_be_found():
    for text in ('<img src="https://x.org/a.png">', "url(fonts/a.woff)", '<a href="other.html">'):
        assert ADDRESS.search(text)


def test_no_name_stands_twice_and_every_reference_is_there(page):
    names = re.findall(r'\bid="([^"]+)"', page)
    assert len(names) == len(set(names)) > 20
    wanted = set(re.findall(r'(?:href="#|url\(#)([^")]+)', page))
    assert len(wanted) > 6 and wanted <= set(names)


def test_many_points_become_pixels(page):
    assert page.count("data:image/png;base64") == 2 and len(page) < 200_000


def test_names_from_files_are_data(page):
    assert page.count("<script") == 3 == page.count("</script>")  # page, job, digests; none of a name
    tree = html5lib.parse(page, namespaceHTMLElements=False)
    assert "<script>alert(1)</script>" in "".join(tree.find(".//h1").itertext())
    job = re.search(r'id="job">(.*?)</script>', page)[1]
    assert "<\\/script>\\u003c!--" in job and '"seed": 7' in job


def test_what_no_page_may_hold_is_replaced():
    """Controls, halves of surrogate pairs and what is no character; what lies beside them stays."""
    near = [*range(0x300), *range(0xD7F0, 0xE010), *range(0xFDC0, 0xFE00)]
    ends = [plane + last for plane in range(0, 0x110000, 0x10000) for last in (0xFFFD, 0xFFFE, 0xFFFF)]
    letters = [chr(code) for code in near + ends if chr(code) not in "&<>'\"\n\t"]
    wanted = [
        "\ufffd"
        if unicodedata.category(letter) in ("Cc", "Cs")
        or ord(letter) & 0xFFFE == 0xFFFE
        or 0xFDD0 <= ord(letter) <= 0xFDEF
        else letter
        for letter in letters
    ]
    page = html("letters", [Sentences([" ".join(letters), "tab\tline\nend"])])
    assert " ".join(wanted) in page and "tab\tline\nend" in page


def test_what_cannot_be_drawn_is_left_out_with_its_reason(page):
    assert "none: left out, no quantity has a reading" in page and page.count("<svg") == 2


def test_a_page_is_the_same_to_the_bit(page):
    assert html("Job " + NASTY, blocks()) == page and not seal.changes(page)
    assert not seal.changes(page.replace("\n", "\r\n"))


@pytest.mark.parametrize(
    ("written", "changed", "named"),
    [
        (
            "<td>12.12</td>",
            "<td>12.18</td>",
            r"row 1, time \[s\]: the page shows '12.18', its data say '12.12'",
        ),
        ('"seed": 7', '"seed": 8', "data 'job', seed: 8 is not"),
        ('"seed": 7', '"seed": 07', "data 'job': not as it was written, and no JSON any more"),
        ("12.125,", "02.125,", "data 'page': not as it was written, and no JSON any more"),
        ("12.125,", "12.1250001,", "data of table 'Every part', time, value 1: 12.1250001"),
        ("<td>2</td>", "<td>1</td>", "row 1, part: the page shows '1'"),
        ("<td>lost</td>", "<td>lost</td><td>0</td>", "the page shows '0'"),
        ("three parts", "four parts", "the page shows 'four parts'"),
        (">4000<", ">3000<", "picture 'left': not as it was written"),
        ("</footer>", "</footer><p>passed</p>", "the page shows 'passed'|texts, its data"),
        ("table.rows td", "table.rows  td", "the page is not as it was written"),
    ],
)
def test_a_change_is_found_and_named(page, written, changed, named):
    assert written in page
    found = seal.changes(page.replace(written, changed, 1))
    assert found and re.search(named, " ".join(found)), found


def test_a_changed_text_of_the_data_is_told_as_it_reads():
    page = html("Ring", [Heading("Limits"), Sentences(["RONt (LSC) 4.64 ± 0.09 µm: kept"])])
    data = page.index('id="page">')
    for written, told in [
        ("RONt", "data of a sentence below 'Limits': \"XONt (LSC) 4.64 ± 0.09 µm: kept\" is not what"),
        ("Limits", "data of a heading below 'Ring': \"Ximits\" is not what"),
        ("Ring", 'data of the title: "Xing" is not what'),
    ]:
        at = page.index(written, data)
        found = seal.changes(f"{page[:at]}X{page[at + 1 :]}")
        assert any(told in sentence for sentence in found), found
    found = seal.changes(page.replace("<title>Ring", "<title>Rind"))
    assert found == ["title of the window: the page has 'Rind', its data say 'Ring'"]


def test_every_digit_of_the_texts_counts(page):
    """Each digit that a reader sees, changed by one, one after another."""
    start, end = page.index("<h1>"), page.index("<footer>")
    visible = re.sub(
        r"<svg.*?</svg>|<[^>]*>", lambda found: "\0" * len(found[0]), page[start:end], flags=re.S
    )
    digits = [start + found.start() for found in re.finditer(r"\d", visible)]
    assert len(digits) > 30
    for k in digits:
        other = str((int(page[k]) + 1) % 10)
        assert seal.changes(page[:k] + other + page[k + 1 :])


def test_every_digit_of_the_data_counts(page):
    """Each digit changed to 0, which at the head of a number leaves no JSON."""
    start, end = page.index('id="page"'), page.index('id="digests"')
    digits = [start + found.start() for found in re.finditer(r"[1-9]", page[start:end])]
    assert len(digits) > 30
    for k in digits:
        assert seal.changes(page[:k] + "0" + page[k + 1 :])


def test_another_file_is_refused():
    with pytest.raises(ValueError, match="the page must be a report of this library"):
        seal.changes("<html><body>12.5</body></html>")


def test_one_unit_for_a_quantity():
    small = Amounts.of("roundness", [0.003, 0.002], "mm")
    for most, head, cell in ((0.0499, "roundness [µm]", "3.000"), (0.05, "roundness [mm]", "0.003000")):
        both = [AmountTable("a", [small]), AmountTable("b", [Amounts.of("roundness", [most], "mm")])]
        scales = scales_of(both)
        assert both[0].head(scales) == [head] and both[1].head(scales) == [head]
        assert both[0].rows(scales)[0][0] == cell


@pytest.mark.parametrize(
    ("value", "half", "shown"),
    [
        (12.1738, 0.0822, "12.174 ± 0.082"),
        (12.0, 0.0, "12 exact"),
        (12.0, math.nan, "12 (no interval)"),
        (0.003, 0.00002, "0.003000 ± 0.000020"),
        (math.nan, 0.1, "–"),
    ],
)
def test_intervals(value, half, shown):
    assert Interval(value, half).shown(1.0) == shown


def test_blocks_come_back():
    for block in (each for each in blocks() if not isinstance(each, Embedded)):
        assert list(from_plain(block.plain()).shown({})) == list(block.shown({}))


@pytest.mark.usefixtures("sketch")
def test_a_page_is_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "job.html"
    assert report("Job", blocks(), path) == str(path)
    first = path.read_bytes()
    with pytest.raises(FileNotFoundError, match="existing folder"):
        report("Job", blocks(), tmp_path / "none" / "job.html")
    monkeypatch.setattr(seal, "sealed", lambda page: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        report("Job", blocks(), path)
    assert path.read_bytes() == first and list(tmp_path.iterdir()) == [path]


def test_without_the_extra_one_sentence_says_so(tmp_path, monkeypatch):
    from sdpgrind.base.sheets import page as pages

    pages._template.cache_clear()
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(ImportError, match=r"pip install 'sdpgrind\[report\]'; the plan is still there"):
        report("Job", blocks(), tmp_path / "job.html")
    assert not list(tmp_path.iterdir()) and "12.1" in report("Job", blocks())


def test_without_matplotlib_the_numbers_stay(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    page = html("Job", blocks())
    assert "<svg" not in page and "pip install" in page and not seal.changes(page)


def test_an_interval_ends_where_the_quantity_does():
    assert Interval(1.4, 2.5, 0.0).shown(1.0) == "1.4 (0 to 3.9)"
    assert Interval(0.0014, 0.0025, 0.0).shown(1e3) == "1.4 (0 to 3.9)"
    assert Interval(1.4, 0.5, 0.0).shown(1.0) == "1.40 ± 0.50" == Interval(1.4, 0.5).shown(1.0)
    block = AmountTable("", [Amounts.of("overground", [Interval(1.4, 2.5, 0.0)], "s")])
    assert list(from_plain(block.plain()).shown({})) == list(block.shown({}))


def test_intervals_side_by_side_have_digits_of_one_size():
    beside = Amounts.of("penalty", [Interval(0.0543158, 0.0000056), Interval(0.075, 0.035)], "$")
    assert beside.cells((1.0, "$")) == ["0.05432 ± <0.00001", "0.075 ± 0.035"]
    sure = [
        Interval(12.0195, 1e-11),
        Interval(12.0638, 0.0, sure="in every part"),
        Interval(0.0443219, 1e-11),
    ]
    cells = Amounts.of("time", sure, "s").cells((1.0, "s"))
    assert cells == ["12.0195 ± <0.0001", "12.0638 in every part", "0.0443 ± <0.0001"]
    assert Amounts.from_plain(Amounts.of("time", sure, "s").plain()).values == tuple(sure)


def test_an_interval_below_the_last_digit_is_said_to_be_so():
    assert Interval(12.0195, 1e-11).shown(1.0) == "12.0195 ± <0.0001"
    assert Interval(1234567.0, 1e-3).shown(1.0) == "1234567 ± <1"


def test_sentences_and_pages_write_small_amounts_alike():
    from sdpgrind.base.doubts.words import amount, significant, to_spread

    assert amount(0.00301, "mm", 3) == "3.01 µm" and amount(-0.3, "mm") == "-0.30 mm"
    assert Amounts.of("depth", [0.00301], "mm").cells((1e3, "µm")) == ["3.01"]
    assert significant(0.0) == "0" and significant(1234.5) == "1234" and significant(2.5e7) == "2.5e+07"
    assert significant(-1e-5, 3) == "-1e-05" and to_spread(-1e-4, 0.02) == "0.000"


def test_beside_a_great_value_no_digits_are_shown_that_say_nothing():
    """25.605 - 25.5085 is known to a tenth of a millisecond; of a micrometre no picometre is."""
    beside = [Interval(25.508486, 0.0), Interval(25.605, 0.0, sure="in every part"), Interval(0.0965141, 0.0)]
    cells = Amounts.of("time", beside, "s").cells((1.0, "s"))
    assert cells == ["25.5085 exact", "25.605 in every part", "0.0965 exact"]
    depths = [25.85, 0.009896, 5.21e-5, 2.6e-5, -2.6e-5, 0.0]
    cells = Amounts.of("overground", depths, "mm").cells((1.0, "mm"))
    assert cells == ["25.85", "0.0099", "0.0001", "<0.0001", ">-0.0001", "0"]
    few = Amounts.of("exponent", [2.1e6, 0.85], "1").cells((1.0, "1"))
    assert few == ["2.1e+06", "0.85"]
