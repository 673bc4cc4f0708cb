"""Sphinx: ``sphinx-build -W -b html docs docs/_build``."""

import importlib.metadata
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import reference_names

project = "roughvisc"
author = "The roughvisc developers"
version = release = importlib.metadata.version("roughvisc")

extensions = [
    "myst_nb",  # pages in Markdown, and a notebook
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",  # formulas without a network
]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3
nb_execution_mode = "off"  # docs/make_gallery.py runs the notebook
#: Autosummary writes the pages of the names that it finds in files.
NAMES = "generated/names.rst"
(Path(__file__).parent / NAMES).parent.mkdir(exist_ok=True)
(Path(__file__).parent / NAMES).write_text(reference_names.page_of_names())
exclude_patterns = ["_build", NAMES]
templates_path = ["_templates"]
suppress_warnings = ["ref.footnote"]  # sources named at the end of a docstring, not in its text

autosummary_generate = [NAMES, "reference.md"]
autodoc_typehints = "none"  # the docstrings say it, with units
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

html_theme = "pydata_sphinx_theme"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_title = f"roughvisc {version}"
html_theme_options = {
    "show_prev_next": True,
    "header_links_before_dropdown": 6,
    "navbar_align": "left",
    "secondary_sidebar_items": ["page-toc"],
    "logo": {"text": "roughvisc"},
    "footer_start": ["copyright"],
    "footer_end": ["sphinx-version"],
}
#: Only sections with pages below them have something to list in a sidebar.
html_sidebars = {
    "**": ["sidebar-nav-bs"],
    **{
        page.stem: []
        for page in Path(__file__).parent.glob("*.[mi][dp]*")
        if page.stem != "reference"
    },
}
copyright = author


def setup(app):
    """Fill the reference with the public names when it is read."""

    def fill(_, name, content):
        if name == "reference":
            content[0] = reference_names.filled(content[0])

    app.connect("source-read", fill)
