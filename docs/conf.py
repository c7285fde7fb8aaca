"""How the documentation site is built: ``make docs``."""

from __future__ import annotations

import sys
from importlib.metadata import version as installed
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "rftfit"
author = "The rftfit developers"
release = version = installed("rftfit")
extensions = [
    "myst_parser",
    "offline_math",
    "generated",
    "notebook",
    "plain_sources",
    "offline_check",
]
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build", "_campaigns", "live"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
nitpicky = True
html_theme = "furo"
html_title = f"rftfit {release}"
html_math_renderer = "mathml"
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
# summaries are fetched, which a browser refuses for a page opened from disk
html_show_search_summary = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
