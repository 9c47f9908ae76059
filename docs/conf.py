"""The documentation as a site: `./dev exec python -m sphinx -W -b html docs build/docs`.

Nothing is fetched, neither when the site is built nor when it is read.
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS / "_ext"), str(DOCS.parent)]

project = "gameinfer_ros"
author = "gameinfer_ros maintainers"
copyright = author
_setup = ast.parse((DOCS.parent / "setup.py").read_text(encoding="utf-8"))
(release,) = (
    ast.literal_eval(node.value)
    for node in ast.walk(_setup)
    if isinstance(node, ast.keyword) and node.arg == "version"
)

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "gameinfer_docs.docstrings",
    "gameinfer_docs.figures",
    "gameinfer_docs.generated",
    "gameinfer_docs.mathml",
]
exclude_patterns = ["results", "_ext"]
suppress_warnings = ["config.cache"]

html_theme = "furo"
html_title = "gameinfer_ros"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False

myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
myst_links_external_new_tab = False

autodoc_member_order = "bysource"
autodoc_inherit_docstrings = False  # overridden members are documented in the base class
autodoc_typehints_format = "short"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
smartquotes = False  # two dashes are an option
default_role = "literal"  # docstrings put code into single backticks

nitpicky = True
# References to ourselves must lead somewhere; those to Python, NumPy, ROS and pydantic need not.
nitpick_ignore = [("py:class", "gameinfer_ros.solver.receding_horizon.Particles")]  # a TypeVar
nitpick_ignore_regex = [(r"py:.*", r"(?!gameinfer_ros\b|msg_adapters\b).*")]
