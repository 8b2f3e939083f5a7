"""Sphinx's settings for the site that scripts/docs builds."""

import pathlib
import re

_root = pathlib.Path(__file__).resolve().parent.parent
project = "colmap-graphmatch"
author = "the authors of colmap-graphmatch"
release = re.search(r"project\(\w+ VERSION ([0-9.]+)", (_root / "CMakeLists.txt").read_text()).group(1)

extensions = ["myst_parser"]
# The anchors that GitHub makes of headings work here, too.
myst_heading_anchors = 4
# A fence with a language that Pygments does not know is a mistake, not a text.
highlight_language = "none"

html_theme = "furo"
html_title = f"colmap-graphmatch {release}"
html_copy_source = False
html_show_sourcelink = False
html_show_copyright = False
# Two columns of options and tables of measurements need the width.
html_static_path = ["_static"]
html_css_files = ["wide.css"]
