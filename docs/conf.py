"""Configuration of the documentation, built by ``sphinx-build -W docs site``."""

from __future__ import annotations

import logging
import shutil
import sys
from pathlib import Path

from bellcrank import __version__

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "extensions"), str(HERE.parent)]  # the latter for `reproduction`

from made_pictures import MadePictures  # noqa: E402

logging.getLogger("ezdxf").setLevel(logging.WARNING)  # tutorials show what they log

RUN = HERE / "run"
"""Folder in which the tutorials run and write their files."""

project = "bellcrank"
author = "The bellcrank authors"
project_copyright = "The bellcrank authors"
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "commands",
    "mathml",
    "raw_files",
    "checked_links",
]
exclude_patterns = ["run", "gallery/*.py", "gallery/*.ipynb", "gallery/*.zip"]

suppress_warnings = ["ref.python"]  # short names of types that two packages have

html_theme = "furo"
html_title = "bellcrank"
html_static_path = ["static"]
html_css_files = ["bellcrank.css"]
html_favicon = "../src/bellcrank/web/static/icon.svg"
html_logo = html_favicon
html_math_renderer = "mathml"
html_show_sphinx = False
smartquotes_action = "qe"  # options keep their two dashes

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False


shutil.rmtree(RUN, ignore_errors=True)
shutil.copytree(HERE.parent / "examples", RUN)

sphinx_gallery_conf = {
    "examples_dirs": str(RUN),
    "gallery_dirs": "gallery",
    "filename_pattern": r"/\d_",
    "ignore_pattern": r"/[^\d][^/]*\.py$",
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": (MadePictures(RUN),),
    "download_all_examples": False,
    "show_signature": False,
    "show_memory": False,
    "abort_on_example_error": True,
    "min_reported_time": 1_000_000,
}
