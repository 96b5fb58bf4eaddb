"""Settings of the documentation site: `make site` builds it from these pages and the docstrings, without a network."""

from __future__ import annotations

import sys
from hashlib import sha256
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
SOURCE = ROOT / "src" / "stillhook"
sys.path[:0] = [str(DOCS / "site"), str(SOURCE.parent)]

from stillhook import __version__  # noqa: E402


def source_digest() -> str:
    """Digest of the package's files: a notebook is executed again when one of them changes."""
    files = sorted(path for ending in ("py", "toml", "csv") for path in SOURCE.rglob(f"*.{ending}"))
    return sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16]


project = "Stillhook"
author = "The Stillhook authors"
copyright = author  # noqa: A001
release = version = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "navigation",
    "equations",
    "surface",
]
exclude_patterns = ["site"]

myst_heading_anchors = 6
myst_fence_as_directive = ["math"]
myst_enable_extensions = []  # no dollar is an equation: NMEA sentences begin with one

nb_execution_mode = "cache"
nb_execution_cache_path = str(ROOT / "build" / "site" / f"notebooks-{source_digest()}")
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 900
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autosummary_generate = False
napoleon_use_rtype = False
napoleon_use_ivar = True

html_theme = "pydata_sphinx_theme"
html_title = "Stillhook"
html_favicon = "site/static/hook.svg"
html_logo = "site/static/hook.svg"
html_static_path = ["site/static"]
html_css_files = ["site.css"]
html_js_files = ["print.js"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_context = {"default_mode": "auto"}
html_theme_options = {
    "logo": {"text": "Stillhook"},
    "navbar_align": "left",
    "header_links_before_dropdown": 7,
    "show_toc_level": 2,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
