"""Sphinx: ``python -m sphinx -W docs docs/_build``. Examples are executed and become pages with their
pictures.
"""

import os
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")

import sdpgrind

HERE = Path(__file__).parent

project = "sdpgrind"
author = "The sdpgrind developers"
version = release = sdpgrind.__version__
html_theme = "furo"
html_title = f"{project} {release}"
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
]

# -- reference: what a package exports, from its numpydoc docstrings
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # types stand in the docstrings, with units
autodoc_default_options = {"members": True, "exclude-members": "__weakref__"}
autosummary_generate = False
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

# -- examples: every script of the galleries is run, a failure fails the build
GALLERIES = [name for name in ("examples", "reproductions") if (HERE / name / "GALLERY_HEADER.rst").exists()]
sphinx_gallery_conf = {
    "examples_dirs": GALLERIES,
    "gallery_dirs": [f"gallery/{name}" for name in GALLERIES],
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"published\.py$",  # the table of all reproductions
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "remove_config_comments": True,
    "min_reported_time": 60,
    "show_memory": False,
    "show_signature": False,
    "plot_gallery": "True",
}
