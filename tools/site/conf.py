# SPDX-License-Identifier: BSD-3-Clause
"""Sphinx: the pages that stand beside the sources, as a site (tools/docs)."""

project = "Carom"
author = "The Carom developers"
extensions = ["myst_parser"]
myst_heading_anchors = 4
html_theme = "alabaster"
html_theme_options = {"description": "Event-driven molecular dynamics that keeps its energy", "page_width": "1100px"}
html_sidebars = {"**": ["about.html", "navigation.html", "searchbox.html"]}
suppress_warnings = ["myst.header"]
exclude_patterns = ["**/figures"]
