"""Sphinx: ``python -m sphinx -W docs docs/_build``. Examples are executed and become pages with their
pictures.
"""

import os
import sys
from logging import WARNING, getLogger
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")

from sphinx.util import logging

import sdpgrind

getLogger("sdpgrind").setLevel(WARNING)  # a package of an example shows all levels
HERE = Path(__file__).parent
sys.path.append(str(HERE))  # for the directives `entries` and `job-tables`, and `at_root`

project = "sdpgrind"
author = "The sdpgrind developers"
version = release = sdpgrind.__version__
html_theme = "furo"
html_title = f"{project} {release}"
html_use_index = False  # one page of 280 kB; the tables of the reference and the search find the same
html_domain_indices = False
exclude_patterns = ["_build", "**/GALLERY_HEADER.rst"]
nitpicky = False
default_role = "code"
suppress_warnings = ["ref.python"]  # a word such as "mean" in a table of results is no reference

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "entries",
    "job_tables",
]

# -- reference: what a package exports, from its numpydoc docstrings
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # types stand in the docstrings, with units
autodoc_default_options = {"members": True, "exclude-members": "__weakref__"}
autosummary_generate = False
toc_object_entries_show_parents = "hide"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

# -- examples: every script of the galleries is run, a failure fails the build
GALLERIES = ["commissioning", "examples", "reproductions"]
sphinx_gallery_conf = {
    "examples_dirs": GALLERIES,
    "gallery_dirs": [f"gallery/{name}" for name in GALLERIES],
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"published\.py$",  # the table of all reproductions
    "within_subsection_order": "FileNameSortKey",
    "reset_argv": "at_root.commissioning",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "remove_config_comments": True,
    "min_reported_time": 60,
    "show_memory": False,
    "write_computation_times": False,
    "show_signature": False,
    "plot_gallery": "True",
}

# -- size of pages
LARGEST = 200  # kB; chosen: a page of 900 kB takes seconds to be laid out


def _too_large(app, error):
    """Warn of pages over the largest size."""
    for page in sorted(Path(app.outdir).rglob("*.html")):
        size = page.stat().st_size / 1000
        if size > LARGEST:
            name = page.relative_to(app.outdir)
            logging.getLogger(__name__).warning("%s must be <= %d kB; got %d", name, LARGEST, size)


def setup(app):
    """Check the pages when they are written."""
    app.connect("build-finished", _too_large)
