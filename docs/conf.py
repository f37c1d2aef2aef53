"""The documentation as a site: `make docs` builds it into outputs/site."""

project = "freelearn"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
html_theme = "furo"
html_title = "freelearn"
# The notebooks are run by `make notebooks` and by the tests; the site shows what they showed.
nb_execution_mode = "off"
myst_enable_extensions = ["colon_fence"]
# A heading's place in its page is what a link to it says.
myst_heading_anchors = 3
autodoc_typehints = "description"
autodoc_member_order = "bysource"
# Links from the pages into the code are for those who read the pages in the repository.
suppress_warnings = ["myst.xref_missing"]
html_static_path = ["static"]
html_css_files = ["site.css"]
# In the reference what a user types, not the rooms that it lives in.
add_module_names = False
python_use_unqualified_type_names = True
autodoc_typehints_format = "short"
