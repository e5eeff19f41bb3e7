"""Hooks of MkDocs for the guide: correct addresses of pictures, keep words whole, refuse missing pictures."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from mkdocs.exceptions import PluginError

IMAGE = re.compile(r"<img\b[^>]*>")
ADDRESS = re.compile(r'\b(?:src|srcset)="([^"]*)"')
# The gallery writes this address for pages that are folders; ours are files, so that the guide opens without a server.
GALLERY_SOURCES = re.compile(r'\s+srcset="\.\./images/[^"]*"')
# Code within a line; blocks of code, which scroll, are matched first.
CODE = re.compile(r"<pre\b.*?</pre>|<code>([^<]+)</code>", re.DOTALL)
# A short word that a browser would break, such as `--loading-rate` or `.[train]`.
BREAKABLE = re.compile(r"(?<!\S)(?=\S*[-\[/])\S{2,32}(?!\S)")
# A formula within a line, and what belongs to it.
FORMULA = re.compile(r'<math\b(?![^>]*display="block")(?:(?!</math>).)*</math>[.,;:)]+', re.DOTALL)


def on_page_content(html: str, **_: Any) -> str:
    """HTML of a page with words of code and formulas kept whole, and pictures of tutorials without their wrong address.

    It is their second address, which browsers prefer.
    """
    html = FORMULA.sub(r'<span class="whole">\g<0></span>', html)
    return CODE.sub(_whole_words, GALLERY_SOURCES.sub("", html))


def _whole_words(code: re.Match[str]) -> str:
    if code[1] is None:
        return code[0]
    words = BREAKABLE.sub(r'<span class="whole">\g<0></span>', code[1])
    return f"<code>{words}</code>"


def on_post_build(config: dict[str, Any], **_: Any) -> None:
    """Refuse pages that show a picture which is not in the site; MkDocs checks links, but no addresses in HTML.

    Raises:
        PluginError: A picture is missing; the message names page and picture.
    """
    for page in sorted(Path(config["site_dir"]).rglob("*.html")):
        for missing in missing_pictures(page):
            raise PluginError(f"{page}: the picture {missing} is missing")


def missing_pictures(page: Path) -> list[str]:
    """Addresses of pictures of a page that name no file; addresses of other sites and data are not checked."""
    found = [
        unescape(entry.split()[0])
        for image in IMAGE.findall(page.read_text("utf-8"))
        for address in ADDRESS.findall(image)
        for entry in ([address] if address.startswith("data:") else address.split(","))
        if entry.strip()
    ]
    local = [address for address in found if not urlsplit(address).scheme and not address.startswith(("//", "/"))]
    return [address for address in local if not (page.parent / unquote(urlsplit(address).path)).is_file()]
