"""What Sphinx is told, for the help that the product carries; `build.py` lays the pages out before.

Nothing is fetched from elsewhere, while building or while reading.
"""

from typing import Any

project = "TeMoto Action Assistant"
language = "en"
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
root_doc = "index"
templates_path = ["_templates"]
exclude_patterns = ["_*"]

# Headings get the anchors that other viewers of these documents give them.
myst_heading_anchors = 6
myst_links_external_new_tab = True
#: Lexers colour what is not quite JSON or a shell's words as well as they can.
suppress_warnings = ["misc.highlighting_failure"]
highlight_language = "none"

html_theme = "furo"
html_title = "Action Assistant: Help"
html_logo = "_static/mark.svg"
html_favicon = "_static/mark.svg"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = [("site.js", {"loading_method": "none", "priority": 100})]
html_copy_source = False
html_show_copyright = False
html_use_index = False
html_domain_indices = False
html_permalinks_icon = "#"
pygments_style = "a11y-light"
pygments_dark_style = "a11y-dark"
html_sidebars = {
    "**": [
        "sidebar/brand.html",
        "sidebar/search.html",
        "sidebar/scroll-start.html",
        "sidebar/navigation.html",
        "sidebar/way-back.html",
        "sidebar/scroll-end.html",
    ]
}
#: The page's own colours, of frontend/src/ui/tokens.css; a test compares them.
LIGHT = {
    "brand-primary": "#3b5bdb",
    "brand-content": "#3b5bdb",
    "background-primary": "#ffffff",
    "background-secondary": "#f6f7f9",
    "background-hover": "#f1f3f6",
    "background-border": "#e3e6eb",
    "foreground-primary": "#1b2130",
    "foreground-secondary": "#566073",
    "foreground-muted": "#5c6577",
    "foreground-border": "#cfd4dc",
}
DARK = {
    "brand-primary": "#8ba0ff",
    "brand-content": "#8ba0ff",
    "background-primary": "#191d25",
    "background-secondary": "#12151b",
    "background-hover": "#222834",
    "background-border": "#272d38",
    "foreground-primary": "#e8ebf1",
    "foreground-secondary": "#a4adbd",
    "foreground-muted": "#8b95a7",
    "foreground-border": "#38404e",
}
_FONTS = {
    "font-stack": '"Inter Variable", Inter, system-ui, sans-serif',
    "font-stack--monospace": '"JetBrains Mono Variable", "JetBrains Mono", ui-monospace, monospace',
    "admonition-font-size": "1rem",
}
html_theme_options: dict[str, Any] = {
    "light_css_variables": {
        **{f"color-{name}": value for name, value in LIGHT.items()},
        **_FONTS,
    },
    "dark_css_variables": {f"color-{name}": value for name, value in DARK.items()},
}
