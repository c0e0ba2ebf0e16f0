"""Figures of matplotlib as SVG for a page that holds several: no address, no name twice, few points."""

import io
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from sdpgrind.base import pictures
from sdpgrind.base.extras import need

MOST_POINTS = 5000  # of an artist; more are drawn as pixels; source: the page's bound of 1.5 MB
_MARK = 10  # points of a line that take as much as a mark or a piece; measured: 180 to 600 bytes, 35 each
_DPI, _WIDTH = 150, 7.2  # of pixels as printed, and inches between the margins; source: as MOST_POINTS
_FAMILY = "'DejaVu Sans', Verdana, sans-serif"  # Verdana has the widths of the font of the layout
_FONTS = re.compile(r"'DejaVu Sans'[^;\"]*")
_HEAD = re.compile(r"^.*?(?=<svg\b)|<metadata>.*?</metadata>\s*|<!--.*?-->\s*", re.DOTALL)
_STYLE = re.compile(r"<defs>\s*<style[^>]*>[^<]*</style>\s*</defs>\s*")
_SIZE = re.compile(r'(<svg\b[^>]*?) width="[^"]*pt" height="[^"]*pt"')
_UNTURNED = re.compile(r' transform="rotate\(-?0 [^)]*\)"')
_NAMES = re.compile(r'(\bid="|href="#|url\(#)(?=[^")]+["\)])')
_INHERITED = ' stroke-linejoin="round" stroke-linecap="butt" role="img"'  # of matplotlib's style for `*`


def svg_of(draw: Callable[[], Any], prefix: str) -> str:
    """Draw a figure, close it and return its SVG; `prefix` begins all names in it.

    The figure is drawn in matplotlib's own style, whatever the user's is.
    """
    plt: Any = need("matplotlib.pyplot", "report")
    with _style(plt, prefix), plt.ioff():
        figure = draw()
        try:
            _rasterise(figure)
            need("matplotlib.backends.backend_svg", "report").FigureCanvasSVG(figure)
            pictures.lay_out(figure)
            written = io.StringIO()
            figure.savefig(written, format="svg", dpi=_DPI * min(1.0, _WIDTH / figure.get_figwidth()))
        finally:
            plt.close(figure)
    return tidied(written.getvalue(), prefix)


@contextmanager
def _style(plt: Any, prefix: str) -> Iterator[None]:
    own = {"svg.fonttype": "none", "svg.hashsalt": prefix, "savefig.bbox": None}
    with plt.style.context(own, after_reset=True):
        yield


def tidied(svg: str, prefix: str) -> str:
    """Return an SVG of matplotlib for use inside a page."""
    svg = _STYLE.sub("", _HEAD.sub("", svg))
    svg = _SIZE.sub(rf"\1{_INHERITED}", svg, count=1)
    svg = _UNTURNED.sub("", _FONTS.sub(_FAMILY, svg))
    return _NAMES.sub(rf"\g<1>{prefix}-", svg).strip()


def _rasterise(figure: Any) -> None:
    """Draw artists of many points as pixels, and all those of axes that hold many together."""
    for axis in figure.axes:
        artists = [*axis.lines, *axis.collections]
        counts = [_points(artist) for artist in artists]
        crowded = sum(counts) > 4 * MOST_POINTS  # chosen: four panels of such axes keep the bound
        for artist, count in zip(artists, counts, strict=True):
            if count > MOST_POINTS or (crowded and count):
                flat = getattr(artist.draw, "_supports_rasterization", False)  # not those of three dimensions
                (artist if flat else axis).set_rasterized(True)


def _points(artist: Any) -> int:
    """Number of points of a line; marks and pieces of a collection count by what they take."""
    if hasattr(artist, "get_xdata"):
        marked = artist.get_marker() not in ("", "None", " ", None)
        return int(np.size(artist.get_xdata())) * (_MARK if marked else 1)
    coloured = artist.get_array()
    pieces = max(len(artist.get_offsets()), 0 if coloured is None else int(np.size(coloured)))
    if _MARK * pieces > MOST_POINTS:  # a mesh would make all its paths to be counted
        return _MARK * pieces
    paths = artist.get_paths()
    return sum(len(path.vertices) for path in paths) + _MARK * max(len(paths), pieces)
