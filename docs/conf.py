"""Sphinx: `make docs`."""

import importlib.metadata

project = "PBPP Rover"
author = "the PBPP Rover maintainers"
project_copyright = f"2026, {author}. Apache-2.0"
release = importlib.metadata.version("pbpp-rover")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "PBPP Rover"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {"top_of_page_buttons": []}
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3
autodoc_typehints = "none"
# Links into the repository: a test checks every relative link.
# Errors of the same name in two packages are told apart by their module.
suppress_warnings = ["myst.xref_missing", "ref.python"]
