"""Sphinx: ``sphinx-build -W -b html docs docs/_build``."""

import importlib.metadata
from pathlib import Path

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
exclude_patterns = ["_build"]
templates_path = ["_templates"]
suppress_warnings = ["ref.footnote"]  # sources named at the end of a docstring, not in its text

autosummary_generate = True
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
