"""Links within the built site, whoever wrote them: files and anchors must be there.

Sphinx checks what it resolves itself; this looks at the pages as they are, with raw HTML and what
was copied. A link that leads nowhere is a warning, which CI takes for an error. Links to elsewhere
are left to ``sphinx-build -b linkcheck``.
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
    """What a page refers to, and the anchors it has."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.anchors = {""}
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, _tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note a link or an anchor."""
        told = {name: value for name, value in attrs if value}
        self.links |= {told[name] for name in ("href", "src") if name in told}
        self.anchors |= {told[name] for name in ("id", "name") if name in told}


def broken(site: Path) -> Iterator[tuple[str, str]]:
    """Yield page and link of what leads nowhere."""
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
    """Warn of what leads nowhere."""
    if failed or app.builder.format != "html":
        return
    for page, link in broken(Path(app.outdir)):
        logging.getLogger(__name__).warning("%s: %r leads nowhere", page, link, type="links")


def setup(app: Sphinx) -> dict[str, bool]:
    """Look when all is written."""
    app.connect("build-finished", check, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
