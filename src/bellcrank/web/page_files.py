"""Registry of the files that the page offers for a design.

The content is written by `bellcrank.export`, `bellcrank.plots.movies` and `bellcrank.workflows`
(see `bellcrank.web.slow_calls.design_file`).
"""

from __future__ import annotations

from dataclasses import dataclass

from bellcrank.registry import Registry


@dataclass(frozen=True, slots=True)
class PageFile:
    """A file format.

    Parameters
    ----------
    title, purpose
        Display name, and its use in a few words.
    media_type
        Media type of the content.
    quick
        Whether it is written quickly and need not wait behind movies and finite elements.
    in_space
        Whether it is offered for parts in space.
    """

    title: str
    purpose: str
    media_type: str
    quick: bool = False
    in_space: bool = True


page_files: Registry[PageFile] = Registry("file format")
"""Formats by suffix, without the dot, in the order of display."""

for _suffix, _file in {
    "stl": PageFile("STL", "3D printing", "model/stl", quick=True),
    "3mf": PageFile("3MF", "3D printing, with units", "model/3mf", quick=True),
    "step": PageFile("STEP", "CAD", "model/step"),
    "svg": PageFile("SVG", "drawing, laser cutting", "image/svg+xml", quick=True, in_space=False),
    "dxf": PageFile("DXF", "cutting", "image/vnd.dxf", quick=True, in_space=False),
    "mp4": PageFile("MP4", "movie", "video/mp4"),
    "gif": PageFile("GIF", "movie", "image/gif"),
    "pdf": PageFile("PDF", "summary on one page", "application/pdf"),
    "json": PageFile("JSON", "design for bellcrank", "application/json", quick=True),
    "zip": PageFile("All", "all files in one archive", "application/zip"),
}.items():
    page_files.register(_suffix)(_file)
