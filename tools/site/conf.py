# SPDX-License-Identifier: BSD-3-Clause
"""Sphinx: the pages that stand beside the sources, as a site (tools/docs), with a reference of the Python package."""

import pathlib
import pkgutil
import re

import carom

project = "Carom"
author = copyright = "The Carom authors"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
html_theme = "furo"
html_title = "Carom"
html_static_path, html_css_files = ["site.css"], ["site.css"]
html_copy_source = False
smartquotes = False
html_show_sphinx = False
suppress_warnings = ["myst.header"]
exclude_patterns = ["**/figures", ".github/PULL_REQUEST_TEMPLATE.md"]
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": True}


def public_modules():
    """The modules of the package whose classes and functions `carom` does not export under its own name."""
    exported = {getattr(carom, name) for name in carom.__all__}
    for module in pkgutil.iter_modules(carom.__path__, "carom."):
        name = module.name.rpartition(".")[2]
        if not name.startswith("_"):
            namespace = vars(__import__(module.name, fromlist=[name]))
            own = [each for each, value in namespace.items() if not each.startswith("_") and callable(value)
                   and getattr(value, "__module__", None) == module.name and value not in exported and value.__doc__]
            if own:
                yield module.name, own


def python_reference():
    """The page of all classes and functions, written from the package itself."""
    page = ["# Python", "", "Everything in the package `carom`, generated from its docstrings. The parameters of forces and integrators are",
            "the [keys of a deck](deck.md); [Carom from Python](io/python/README.md) introduces the package by examples.", "",
            "## `import carom`", "", "```{eval-rst}", ".. automodule:: carom", "```", ""]
    for module, names in public_modules():
        page += [f"## `{module}`", "", "```{eval-rst}", f".. automodule:: {module}", f"   :members: {', '.join(names)}", "```", ""]
    pathlib.Path(__file__).with_name("python.md").write_text("\n".join(page))


def as_restructured_text(app, what, name, thing, options, lines):
    """Docstrings are plain text: indented lines are code, words between backticks too, and no other sign has a meaning."""
    text, code = [], False
    for line in lines:
        indented = line.startswith("    ") if line.strip() else code
        if indented and not code:
            text += ["", "::", ""]
        elif code and not indented:
            text.append("")
        code = indented
        text.append(line if code else re.sub(r"`([^`]+)`|([\\*|_])", lambda m: f"``{m[1]}``" if m[1] else "\\" + m[2], line))
    lines[:] = text


def setup(app):
    python_reference()
    app.connect("autodoc-process-docstring", as_restructured_text)
