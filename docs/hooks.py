"""What MkDocs calls while it builds the site; the work is in docs/tools."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from docs.tools import figures, links, mathml, notebooks, paper, search, work  # noqa: E402

DOCS = ROOT / "docs"


def on_config(config: Any) -> Any:
    """Make what is computed."""
    work.do([*paper.jobs(), *notebooks.jobs(), *figures.jobs()])
    config.nav += paper.navigation()
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add generated pages and images, and a page for every file of the repository that a page links to."""
    made: dict[str, str | bytes] = {**figures.made(), **notebooks.made(), **paper.made(), **links.root_pages()}
    texts = {path.relative_to(DOCS).as_posix(): path.read_text() for path in DOCS.rglob("*.md")}
    texts |= {uri: _text(content) for uri, content in made.items() if uri.endswith(".md")}
    made |= links.source_pages(texts)
    from mkdocs.structure.files import File

    for uri, content in made.items():
        if (old := files.get_file_from_path(uri)) is not None:
            files.remove(old)
        files.append(File.generated(config, uri, content=content))
    return files


def _text(content: str | bytes) -> str:
    return content.decode() if isinstance(content, bytes) else content


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Show figures and tables in place of links to the scripts that make them; lead other links into the site."""
    uri = page.file.src_uri
    page.meta.setdefault("search", {"boost": search.boost(uri)})
    return links.into_site(figures.shown(markdown, uri), uri)


def on_page_content(html: str, page: Any, config: Any, files: Any) -> str:
    """Turn formulas into MathML, which browsers draw without a script."""
    return mathml.converted(html, page.file.src_uri)
