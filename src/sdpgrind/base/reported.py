"""Results with a page of their own: the verb ``report``."""

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, ClassVar

from sdpgrind.base.by_name import called

if TYPE_CHECKING:
    from sdpgrind.base.sheets.blocks import Block


class Reported:
    """Mixin of records with ``report``; `_figures` adds its own tables, `_title` replaces the kind.

    A method ``_headline`` replaces the status in the first line.
    """

    _title: ClassVar[str] = ""

    def report(self, path: str | os.PathLike[str] | None = None) -> str:
        """Write one HTML page that needs nothing else: status, figures, picture, problem, versions, digests.

        Each quantity has one unit, µm for lengths below 0.05 mm.

        Parameters
        ----------
        path : str or path, optional
            HTML file in an existing folder, written complete or not at all. None: only the text is returned.

        Returns
        -------
        str
            The path of the file, or the text of the page.

        Raises
        ------
        ImportError
            With a path, without the extra ``report`` (jinja2, matplotlib).
        """
        return str(called("sdpgrind.base.sheets.record_page:report", self, path))

    def _figures(self) -> "Iterable[Block]":
        """Blocks of the page with figures of this kind; a subclass overrides it."""
        return ()
