"""The site that tools/docs makes of the project's pages, with Sphinx. The pages stay as GitHub shows them."""

import os
import re

project = html_title = "tensorray"
extensions = ["myst_parser"]
root_doc = "README"
include_patterns = ["*.md", "docs/**.md", "tools/**/README.md"]
exclude_patterns = ["build", "**/node_modules"]
myst_enable_extensions = ["html_image"]
myst_heading_anchors = 4
highlight_language = "none"

html_theme = "furo"
html_copy_source = html_show_copyright = html_show_sphinx = False


def pages_in(text, folder):
    """The pages that a README links to: that of the project below "More"."""
    links = re.findall(r"\]\(([^)#:]+)\.md[)#]", text.split("\n## More\n")[-1])
    return [os.path.normpath(os.path.join(folder, link)) for link in links]


def add_navigation(app, name, source):
    """Below a README stand the pages that it links to, in this order, and the others of its folder. A page that the
    project's README lists is not listed again."""
    folder, file = os.path.split(name)
    if file != "README":
        return
    with open(os.path.join(app.srcdir, "README.md")) as readme:
        listed = {root_doc, name, *(pages_in(readme.read(), "") if folder else [])}
    siblings = sorted(page for page in app.env.found_docs if os.path.dirname(page) == folder)
    pages = [page for page in dict.fromkeys(pages_in(source[0], folder) + siblings) if page not in listed]
    if pages:
        source[0] += "\n\n```{toctree}\n:hidden:\n\n" + "".join(f"/{page}\n" for page in pages) + "```\n"


def keep_folders_as_text(app, env, node, content):
    """Links to folders, which a site does not show."""
    if os.path.isdir(os.path.join(app.srcdir, os.path.dirname(node["refdoc"]), node["reftarget"])):
        return content


def setup(app):
    app.connect("source-read", add_navigation)
    app.connect("missing-reference", keep_folders_as_text)
