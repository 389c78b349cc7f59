"""The site that `make docs` makes: its links lead somewhere, and a browser shows its pages without a network."""

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from tests.campaign import campaign
from tests.commands import ROOT
from tests.views.reports.browser import browser

PAGES = sorted((ROOT / "docs" / "_site" / "html").glob("*.html"))
CUT = """[...document.querySelectorAll("table, pre, math, img")].filter(each => {
    if (each.getBoundingClientRect().right <= innerWidth + 1) return false;
    for (let box = each; box !== document.body; box = box.parentElement)
        if (["auto", "scroll"].includes(getComputedStyle(box).overflowX)) return false;
    return true;
}).map(each => each.outerHTML.slice(0, 100))"""


class Links(HTMLParser):
    """Where the links of a page lead to, and its anchors."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [value for name, value in attrs if name in ("href", "src") and value]
        self.anchors |= {value for name, value in attrs if name == "id" and value}


def found() -> list[Path]:
    assert PAGES, "make docs makes the site that this test looks at"
    return PAGES


@campaign
def test_every_link_within_the_site_leads_to_a_page_and_to_a_place_on_it() -> None:
    pages = {page: Links(page) for page in found()}
    for page, each in pages.items():
        for link in map(urlsplit, each.links):
            if not link.scheme:
                target = (page.parent / unquote(link.path)).resolve() if link.path else page
                assert target.exists(), (page.name, link)
                assert not link.fragment or target not in pages or unquote(link.fragment) in pages[target].anchors


@campaign
def test_a_browser_shows_the_site_on_a_telephone_without_a_network() -> None:
    with browser() as window:
        for page in found():
            window.open(page, 400)
            assert window.complaints() == [], page.name
            assert window.run("document.documentElement.scrollWidth") <= 400, page.name
            assert window.run(CUT) == [], page.name
            assert window.run("[...document.images].every(each => each.complete && each.naturalWidth > 0)")
