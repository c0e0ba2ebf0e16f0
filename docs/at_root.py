"""Where sphinx-gallery runs a page: sample files are named as seen from the root of the repository."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SAMPLES = "tests/data/"


def commissioning(gallery_conf, script_vars):
    """Give a page that reads samples the root as its folder, where its reader runs it, and no arguments.

    Asked by sphinx-gallery for the arguments of a page; it runs the page in the folder of ``src_file``.
    """
    page = Path(script_vars["src_file"])
    if page.parent.name == "commissioning" or SAMPLES in page.read_text(encoding="utf-8"):
        script_vars["src_file"] = str(ROOT / page.name)
    return []
