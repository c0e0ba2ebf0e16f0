"""A page from blocks: one HTML file that needs nothing else, or plain text."""

import os
import re
from collections.abc import Iterable, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from sdpgrind.base.extras import need
from sdpgrind.base.sheets import blocks as forms
from sdpgrind.base.sheets import seal
from sdpgrind.base.sheets.blocks import AmountTable, Block, Embedded, Heading, Listing, Picture, Sentences
from sdpgrind.base.sheets.svg import svg_of
from sdpgrind.base.text_table import aligned
from sdpgrind.base.whole_files import whole_file

# Controls but for tabulator and new line, halves of surrogate pairs, and what is no character at all
_NO_CHARACTERS = "".join(
    chr(plane + last) for plane in range(0, 0x110000, 0x10000) for last in (0xFFFE, 0xFFFF)
)
_FORBIDDEN = re.compile(rf"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef{_NO_CHARACTERS}]")


def report(title: str, blocks: Iterable[Block], path: str | os.PathLike[str] | None = None) -> str:
    """Write a page to `path`, complete or not at all, and return the path; None: return its text.

    Parameters
    ----------
    title : str
        Words above everything.
    blocks : iterable of Block
        Contents of the page, in order.
    path : path, optional
        HTML file in an existing folder.

    Raises
    ------
    ImportError
        With a path, without jinja2 (extra ``report``).
    """
    made = list(blocks)
    if path is None:
        return text(title, made)
    page = html(title, made)
    with whole_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8", newline="\n")
    return os.fspath(path)


def html(title: str, blocks: Sequence[Block]) -> str:
    """Return the HTML of a page. A picture that cannot be drawn is left out with its reason."""
    template = _template()
    drawn: list[tuple[Any, str]] = []  # block, SVG
    for block in blocks:
        if not isinstance(block, Embedded):
            drawn.append(_drawn(block, len(drawn)) if isinstance(block, Picture) else (block, ""))
    plain = _legible({"title": title, "blocks": [block.plain() for block, _ in drawn]})
    parts = {seal.PAGE: plain} | {b.name: _legible(b.value) for b in blocks if isinstance(b, Embedded)}
    texts = {name: seal.as_json(value) for name, value in parts.items()}
    digests = {
        "parts": {name: seal.part_digest(value, texts[name]) for name, value in parts.items()},
        "pictures": [{"caption": b.caption, "sha256": seal.sha256(svg)} for b, svg in drawn if svg],
        "seal": seal.UNSEALED,
    }
    shown = [forms.from_plain(each) for each in plain["blocks"]]
    page: str = template.render(
        title=plain["title"],
        blocks=list(zip(shown, [svg for _, svg in drawn], strict=True)),
        scales=forms.scales_of(shown),
        data=texts | {seal.DIGESTS: seal.as_json(_legible(digests))},
        seal=seal.UNSEALED,
    )
    return seal.sealed(page)


def _drawn(block: Picture, number: int) -> tuple[Picture, str]:
    """The picture with its SVG, or with the reason why there is none."""
    if block.draw is None:
        return block, ""
    try:
        return block, svg_of(block.draw, f"p{number}")
    except Exception as error:  # of any kind: the numbers must not be lost with a picture
        return Picture(block.caption, missing=" ".join(str(error).split()) or type(error).__name__), ""


@cache
def _template() -> Any:
    try:
        jinja = need("jinja2", "report")
    except ImportError as error:
        raise ImportError(
            "a page needs jinja2: pip install 'sdpgrind[report]'; the plan is still there, and report() "
            "without a path returns the text"
        ) from error
    environment = jinja.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    source = files("sdpgrind.base.sheets").joinpath("page.html").read_text(encoding="utf-8")
    return environment.from_string(source, {"kind": lambda block: type(block).__name__})


def _legible(value: Any) -> Any:
    """A plain value whose texts hold no character that HTML forbids."""
    if isinstance(value, dict):
        return {_legible(key): _legible(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_legible(each) for each in value]
    if isinstance(value, str):
        return _FORBIDDEN.sub("\ufffd", value)
    return value


def text(title: str, blocks: Sequence[Block]) -> str:
    """Return a page as text; of pictures the captions."""
    return f"{title}\n{'=' * len(title)}\n\n{body(blocks)}"


def body(blocks: Sequence[Block]) -> str:
    """Return blocks as text."""
    scales, parts = forms.scales_of(blocks), []
    for block in blocks:
        if isinstance(block, Heading):
            parts.append(f"{block.text}\n{'-' * len(block.text)}")
        elif isinstance(block, AmountTable):
            table = [block.head(scales), *block.rows(scales)]
            parts.append("\n".join([block.caption, *aligned(table, "<>")]))
        elif isinstance(block, Sentences):
            parts.append("\n".join(block.lines))
        elif isinstance(block, Listing):
            parts.append(block.text)
        elif isinstance(block, Picture):
            parts.append(f"[picture in the HTML page: {block.caption}]")
    return "\n\n".join(parts)
