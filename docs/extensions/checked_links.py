"""A check that the targets of all links within the built site exist.

Sphinx checks the links that it resolves. This extension checks the written pages, including raw
HTML and copied files. A link without a target is a warning, which CI treats as an error. External
links are checked by ``sphinx-build -b linkcheck``.
"""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

from sphinx.util import logging

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sphinx.application import Sphinx


class Page(HTMLParser):
    """The links and the anchors of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.anchors = {""}
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, _tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Record a link or an anchor."""
        values = {name: value for name, value in attrs if value}
        self.links |= {values[name] for name in ("href", "src") if name in values}
        self.anchors |= {values[name] for name in ("id", "name") if name in values}


def broken(site: Path) -> Iterator[tuple[str, str]]:
    """Yield page and link for each link without a target."""
    pages = {path.resolve(): Page(path) for path in sorted(site.rglob("*.html"))}
    for path, page in pages.items():
        for link in sorted(page.links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            there = pages.get(target)
            if not target.exists() or (there and unquote(parts.fragment) not in there.anchors):
                yield path.relative_to(site.resolve()).as_posix(), link


def check(app: Sphinx, failed: Exception | None) -> None:
    """Warn about links without a target."""
    if failed or app.builder.format != "html":
        return
    for page, link in broken(Path(app.outdir)):
        logging.getLogger(__name__).warning(
            "%s: the target of %r does not exist", page, link, type="links"
        )


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect the check to the end of the build."""
    app.connect("build-finished", check, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
