"""How Sphinx builds the documents: ``make docs``."""

import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "docs" / "_extensions")]

project = "Linefix"
copyright = "the authors of Linefix"
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "endpoints", "options"]
html_theme = "furo"
html_title = "Linefix"
exclude_patterns = ["dev/experiments/*"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence"]
# Links to files of the repository are for those who read it there; a test of the project looks whether they exist.
suppress_warnings = ["myst.xref_missing", "misc.highlighting_failure"]
autosummary_generate = False  # numpydoc brings it
autodoc_member_order = "bysource"
autodoc_typehints = "none"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
numpydoc_xref_param_type = False
