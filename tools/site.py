"""Pages that the site makes of other files: the report, the paper's figures, and one of each entry of the API.

A line `::: NAME` of a page becomes an entry with its first sentence, and a page `api/NAME.md` of its own.
"""

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import griffe
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.plugins import event_priority
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "results"
_ENTRY = re.compile(r"^::: ((\w+)\.([\w.]+))$", re.MULTILINE)
_package = cache(griffe.load)


def _entry(match: re.Match[str]) -> str:
    """An entry of a list, with the first sentence of the docstring."""
    docstring = _package(match[2])[match[3]].docstring
    if docstring is None:
        raise ValueError(f"{match[1]} must have a docstring to stand in the documentation")
    return f"- [`{match[1]}`](api/{match[1]}.md): {docstring.value.splitlines()[0]}"


def _api_pages(index: File) -> Iterator[tuple[str, str]]:
    """Address and text of the pages of the entries of a list."""
    for match in _ENTRY.finditer(index.content_string):
        title = match[1].rpartition(".")[2]
        yield f"api/{match[1]}.md", f"# {title}\n\n[All names](../{index.src_uri})\n\n::: {match[1]}\n"


def _figures() -> tuple[str, list[Path]]:
    """The page of the paper's figures and tables as they are in `results`, and its pictures."""
    captions = tomllib.loads((ROOT / "paper_figures/captions.toml").read_text(encoding="utf-8"))
    parts, pictures = ["# The paper's figures and tables, as drawn here"], []
    for name, entry in captions.items():
        heading = f"## {entry['title']}"
        if name.startswith("table-"):
            table = RESULTS / "tables" / f"{name.removeprefix('table-')}.md"
            parts += [heading, table.read_text(encoding="utf-8"), f"`make {name}`"] if table.is_file() else []
        elif (picture := RESULTS / "figures" / f"{name}.png").is_file():
            pictures.append(picture)
            parts += [heading, f"![{entry['title']}](figures/{picture.name})", entry["shown"].strip()]
            parts += [f"**What differs from the paper**: {entry.get('differs', 'it has no such figure.').strip()}"]
            parts += [f"`make {name}`"]
    if not pictures:
        parts.append("None is drawn yet: `make docs` draws them first.")
    return "\n\n".join(parts), pictures


@event_priority(50)  # before the plugin that checks links lists the pages
def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages; the report goes as far as its map of the paper."""
    figures, pictures = _figures()
    report, _, _ = (ROOT / "REPRODUCTION.md").read_text(encoding="utf-8").partition("## What the paper leaves open")
    pages = {"report.md": report.replace("](docs/", "]("), "figures.md": figures}
    for index in files.documentation_pages():
        pages |= dict(_api_pages(index))
    for address, text in pages.items():
        files.append(File.generated(config, address, content=text))
    for picture in pictures:
        files.append(File.generated(config, f"figures/{picture.name}", abs_src_path=str(picture)))
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Turn entries into links."""
    return markdown if page.file.src_uri.startswith("api/") else _ENTRY.sub(_entry, markdown)
