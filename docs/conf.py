"""How Sphinx makes the site of these pages: `make docs`."""

import re
import subprocess
import sys
from itertools import chain
from pathlib import Path

import nbformat
from docutils.nodes import Element, SkipNode
from latex2mathml.converter import convert
from myst_nb.core.read import read_myst_markdown_notebook
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

import brakecli
from brakecli.cli import app

HERE = Path(__file__).parent

project = "brakecli"
author = "the authors of brakecli"
release = brakecli.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_site", "generated", "*.template.md"]
source_suffix = {".md": "myst-nb"}
html_title = "brakecli"  # a longer one makes pages wider than a telephone
html_math_renderer = "mathml"
html_theme = "pydata_sphinx_theme"
html_theme_options = {"show_prev_next": False, "navbar_center": [], "secondary_sidebar_items": ["page-toc"]}
html_sidebars = {"**": ["pages.html"]}  # all pages; the theme's own shows what stands below a page: nothing
templates_path = ["_templates"]
html_context = {"default_mode": "auto"}
html_copy_source = False
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_merge_streams = True
autodoc_typehints = "description"


def write_commands(site: Sphinx) -> None:
    """Write the help of every command, as the program prints it."""
    parts = list[str]()
    terminal = {"COLUMNS": "80", "LANG": "C.UTF-8"}
    for name in ("", *chain(*app.GROUPS.values())):
        line = [sys.executable, "-m", "brakecli", *name.split(), "--help"]
        done = subprocess.run(line, capture_output=True, text=True, check=True, env=terminal)
        parts.append(f"## {name or 'brakecli'}\n\n```text\n{done.stdout.strip()}\n```\n")
    (HERE / "generated").mkdir(exist_ok=True)
    (HERE / "generated" / "commands.md").write_text("\n".join(parts))


def write_notebook(site: Sphinx) -> None:
    """Write the tutorial as a notebook for download; its case lies beside it, and other pages do not."""
    text = (HERE / "tutorial.md").read_text(encoding="utf-8").replace("../cases/", "")
    text = re.sub(r"(?:\[|\{download\}`)([^\]`]*?)(?:\]\([^)]*\)| <[^>]*>`)", r"\1", text)
    notebook = read_myst_markdown_notebook(text)
    for number, cell in enumerate(notebook.cells):
        cell["id"] = f"cell-{number}"  # otherwise it is random
    nbformat.validate(notebook)
    nbformat.write(notebook, HERE / "generated" / "tutorial.ipynb")


def write_math(page: HTML5Translator, node: Element) -> None:
    """Write a formula as MathML, which browsers show without a network."""
    alone = node.tagname == "math_block"
    found = convert(node.astext(), display="block" if alone else "inline")
    found = re.sub(r"<mi>([a-z]{2,})</mi>", r'<mo form="prefix" lspace=".17em" rspace=".17em">\1</mo>', found)
    page.body.append(f'<div style="overflow: auto; padding: 0.5rem 0">{found}</div>' if alone else found)
    raise SkipNode


def setup(site: Sphinx) -> None:
    """Have the generated pages written before any is read."""
    site.add_html_math_renderer("mathml", (write_math, None), (write_math, None))
    site.connect("builder-inited", write_commands)
    site.connect("builder-inited", write_notebook)
