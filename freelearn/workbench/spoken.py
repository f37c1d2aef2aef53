"""Names that a screen reader says of what has none: parts of Bokeh's own widgets."""

from __future__ import annotations

import panel as pn
from bokeh.models import CustomJS

# What is drawn later has to be named too; looking through the page takes a millisecond.
_CODE = """
const named = {".noUi-handle": "kinematic state", ".bk-spin-btn-up": "more", ".bk-spin-btn-down": "less"};
function name(root) {
  for (const element of root.querySelectorAll("*")) {
    for (const [selector, label] of Object.entries(named))
      if (element.matches(selector) && !element.hasAttribute("aria-label")) element.setAttribute("aria-label", label);
    if (element.shadowRoot) name(element.shadowRoot);
  }
}
const main = document.body.querySelector("div");
if (main) main.setAttribute("role", "main");
setInterval(() => name(document.body), 1000);
name(document.body);
"""


def name_parts() -> None:
    """Has the page that is being made name its parts, in the browser."""
    if pn.state.curdoc is not None:
        pn.state.curdoc.js_on_event("document_ready", CustomJS(code=_CODE))
