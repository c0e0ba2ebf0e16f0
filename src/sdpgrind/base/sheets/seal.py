"""Digests of a page's parts, and what was changed in a page since it was written.

Each JSON part of a page has a SHA-256 and short digests of its numbers and texts; each picture has a SHA-256;
the seal is that of the whole page with the seal's own digits set to 0. Line ends do not count.
"""

import hashlib
import json
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from typing import Any

from sdpgrind.base.sheets import blocks

PAGE, DIGESTS, UNSEALED = "page", "digests", "0" * 64
_SHORT = 6  # hexadecimal digits of a number's digest; chosen: 1 change in 16 million has no name
_MOST = 20_000  # numbers with digests of their own; chosen: these take a twelfth of a page of 1.5 MB
_SVG = re.compile(r"<svg\b.*?</svg>", re.DOTALL)
_NO_DATA = ("style", "title")  # elements whose text is neither shown in the page nor data
_WORDS = {
    "lines": "a sentence", "table": "the caption of a table", "heads": "the head of a table",
    "amounts": "a column of a table", "picture": "the caption of a picture", "missing": "a picture left out",
    "listing": "a listing", "heading": "a heading", "blanks": "a blank",
}  # fmt: skip
_UNSAFE = re.compile(r"<(?=!|script)", re.IGNORECASE)


def sha256(text: str) -> str:
    """Return the SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def as_json(value: Any) -> str:
    """Return JSON that cannot end the element of HTML that holds it."""
    text = json.dumps(value, ensure_ascii=False)
    return _UNSAFE.sub(r"\\u003c", text.replace("</", "<\\/"))


def part_digest(value: Any, text: str) -> dict[str, str]:
    """Return the digests of a JSON part: of its text, and of each number or text in it."""
    leaves = [leaf for _, leaf in _leaves(value)]
    named = "".join(map(_short, leaves)) if len(leaves) <= _MOST else ""
    return {"sha256": sha256(text), "leaves": named}


def sealed(page: str) -> str:
    """Return a page with its seal instead of zeros."""
    return page.replace(UNSEALED, sha256(page))


def changes(page: str) -> list[str]:
    """Return a sentence for each change of a page since it was written; ValueError: it is none of ours."""
    page = page.replace("\r\n", "\n")
    pictures, parser = _SVG.findall(page), _read(page)
    try:
        digests = json.loads(parser.scripts[DIGESTS])
        found = list(_changed_parts(parser.scripts, digests["parts"]))
        found += _changed_pictures(pictures, digests["pictures"])
        found += _changed_texts(parser.texts, parser.scripts)
        seal = str(digests["seal"])
    except (KeyError, TypeError, ValueError, StopIteration):
        raise ValueError(
            "the page must be a report of this library; its data or digests cannot be read"
        ) from None
    if not found and sha256(page.replace(seal, UNSEALED)) != seal:
        found = ["the page is not as it was written, though all its numbers, texts and pictures are"]
    return found


def data(page: str) -> dict[str, str]:
    """Return the JSON of each part of a page by its name."""
    scripts = _read(page).scripts
    return {name: text for name, text in scripts.items() if name not in _NO_DATA}


def _read(page: str) -> "_Reader":
    parser = _Reader()
    parser.feed(_SVG.sub("", page))
    parser.close()
    return parser


class _Reader(HTMLParser):
    """Texts that a reader sees, and JSON by the name of its element."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.texts: list[str] = []
        self.scripts: dict[str, str] = {}
        self._inside = ""  # name of the script, or of an element without visible text
        self._open = False  # whether the last text goes on

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._open = False
        if tag in ("script", *_NO_DATA):
            self._inside = str(dict(attrs).get("id") or tag)

    def handle_endtag(self, tag: str) -> None:
        self._open = False
        if tag in ("script", *_NO_DATA):
            self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside:
            self.scripts[self._inside] = self.scripts.get(self._inside, "") + data
        elif self._open:
            self.texts[-1] += data
        else:
            self.texts.append(data)
            self._open = True


def _changed_parts(scripts: dict[str, str], digests: dict[str, dict[str, str]]) -> Iterator[str]:
    for name, told in digests.items():
        if name not in scripts:
            yield f"data {name!r}: missing"
        elif sha256(scripts[name]) != told["sha256"]:
            try:
                value = json.loads(scripts[name])
            except ValueError:
                yield f"data {name!r}: not as it was written, and no JSON any more"
            else:
                yield _changed_part(name, value, told["leaves"])


def _changed_part(name: str, value: Any, leaves: str) -> str:
    found = list(_leaves(value))
    if leaves and len(leaves) != _SHORT * len(found):
        return f"data {name!r}: {len(found)} entries, {len(leaves) // _SHORT} were written"
    for k, (path, leaf) in enumerate(found if leaves else ()):
        if _short(leaf) != leaves[_SHORT * k : _SHORT * (k + 1)]:
            where = _place(value, path) if name == PAGE else f"data {name!r}, {'.'.join(map(str, path))}"
            told = json.dumps(json.loads(leaf), ensure_ascii=False)
            return f"{where}: {told} is not what was written"
    return f"data {name!r}: not as it was written"


def _place(page: Any, path: tuple[Any, ...]) -> str:
    """Words for the place of a number or a text in the data of the page."""
    if len(path) < 3:
        return f"data of the {path[0]}"
    if len(path) < 6 or path[2] != "amounts":
        headings = [block["heading"] for block in page["blocks"][: path[1]] if "heading" in block]
        return f"data of {_WORDS.get(path[2], path[2])} below {(headings or [page['title']])[-1]!r}"
    table = page["blocks"][path[1]]
    amounts = table["amounts"][path[3]]
    return f"data of table {table['table']!r}, {amounts['heading'] or amounts['name']}, value {path[5] + 1}"


def _changed_pictures(pictures: list[str], digests: list[dict[str, str]]) -> Iterator[str]:
    if len(pictures) != len(digests):
        yield f"pictures: {len(pictures)}, {len(digests)} were written"
        return
    for svg, told in zip(pictures, digests, strict=True):
        if sha256(svg) != told["sha256"]:
            yield f"picture {told['caption']!r}: not as it was written"


def _changed_texts(texts: list[str], scripts: dict[str, str]) -> Iterator[str]:
    """Compare what a reader sees with what the page's data say; nothing where these cannot be read."""
    try:
        plain = json.loads(scripts[PAGE])
    except ValueError:  # a part of the data, which has a digest
        return
    if (window := scripts.get("title", "").strip()) != plain["title"].strip():
        yield f"title of the window: the page has {window!r}, its data say {plain['title']!r}"
    seen = [text.strip() for text in texts if text.strip()]
    wanted = [(where, text.strip()) for where, text in page_texts(plain) if text.strip()]
    for (where, text), shown in zip(wanted, seen, strict=False):
        if text != shown and where != "seal":
            yield f"{where}: the page shows {shown!r}, its data say {text!r}"
            return
    if len(seen) != len(wanted):
        yield f"the page shows {len(seen)} texts, its data {len(wanted)}"


def page_texts(plain: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield all texts of a page from its data, with their places."""
    found = [blocks.from_plain(each) for each in plain["blocks"]]
    scales = blocks.scales_of(found)
    yield "title", plain["title"]
    for block in found:
        yield from block.shown(scales)
    yield "seal", "sha256"


def _leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], str]]:
    """Yield path and JSON of each number, text, truth value or null."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, each in items:
            yield from _leaves(each, (*path, key))
    else:
        yield path, json.dumps(value)


def _short(leaf: str) -> str:
    return sha256(leaf)[:_SHORT]
