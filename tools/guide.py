"""Hooks of MkDocs for the guide: correct addresses of the gallery, keep words whole, refuse links to nothing."""

import re
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from mkdocs.exceptions import PluginError

TAG = re.compile(r"<(?:a|img|link|script|source)\b[^>]*>")
ADDRESS = re.compile(r'\b(href|src|srcset)="([^"]*)"')
# The gallery writes this address for pages that are folders; ours are files, so that the guide opens without a server.
GALLERY_SOURCES = re.compile(r'\s+srcset="\.\./images/[^"]*"')
# So are its links to tutorials.
GALLERY_LINKS = re.compile(r'(<a\b[^>]*\bhref="\d_\w+)(?=["#])')
# What the gallery leaves beside its pages: records of its runs, and pictures and a badge that no page shows.
LEFTOVERS = ("*.pickle", "*.md5", "broken_*", "no_image.png", "binder_badge_logo.svg")
# Code within a line; blocks of code, which scroll, are matched first.
CODE = re.compile(r"<pre\b.*?</pre>|<code>([^<]+)</code>", re.DOTALL)
# A short word that a browser would break, such as `--loading-rate` or `.[train]`.
BREAKABLE = re.compile(r"(?<!\S)(?=\S*[-\[/])\S{2,32}(?!\S)")
# A formula within a line, and what belongs to it.
FORMULA = re.compile(r'<math\b(?![^>]*display="block")(?:(?!</math>).)*</math>[.,;:)]+', re.DOTALL)


def on_page_content(html: str, **_: Any) -> str:
    """HTML of a page with words of code and formulas kept whole, and addresses of tutorials that name files.

    The second address of a picture, which browsers prefer, is wrong and removed.
    """
    html = FORMULA.sub(r'<span class="whole">\g<0></span>', html)
    return CODE.sub(_whole_words, GALLERY_LINKS.sub(r"\1.html", GALLERY_SOURCES.sub("", html)))


def _whole_words(code: re.Match[str]) -> str:
    if code[1] is None:
        return code[0]
    words = BREAKABLE.sub(r'<span class="whole">\g<0></span>', code[1])
    return f"<code>{words}</code>"


def on_post_build(config: dict[str, Any], **_: Any) -> None:
    """Remove what the gallery leaves, and refuse pages with an address that a plain server does not find.

    MkDocs checks links in Markdown, but no addresses in HTML.

    Raises:
        PluginError: A file is missing; the message names page and address.
    """
    site = Path(config["site_dir"])
    for leftover in [path for pattern in LEFTOVERS for path in site.rglob(pattern)]:
        leftover.unlink()
    for page in sorted(site.rglob("*.html")):
        for missing in missing_addresses(page, site):
            raise PluginError(f"{page}: {missing} is missing")


def missing_addresses(page: Path, site: Path) -> list[str]:
    """Addresses of a page that name no file of the site; those of other sites and data are not checked."""
    found = [
        unescape(entry.split()[0])
        for tag in TAG.findall(page.read_text("utf-8"))
        for kind, address in ADDRESS.findall(tag)
        for entry in (address.split(",") if kind == "srcset" and not address.startswith("data:") else [address])
        if entry.strip()
    ]
    local = [one for one in found if not urlsplit(one).scheme and not one.startswith("//") and urlsplit(one).path]
    return [address for address in local if not _served(unquote(urlsplit(address).path), page.parent, site)]


def _served(path: str, folder: Path, site: Path) -> bool:
    file = site / path.lstrip("/") if path.startswith("/") else folder / path
    return file.is_file() or (file / "index.html").is_file()
