"""Links that leave docs/, which work where the repository is read, led to pages of the site.

A file becomes a page that shows it, a folder one that lists it, CHANGELOG and CONTRIBUTING pages of their own.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping
from pathlib import Path

from docs.tools.cache import ROOT

ROOT_PAGES = {"CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md", "README.md": "index.md"}
LANGUAGES = {".toml": "toml", ".py": "python", ".csv": "text", ".cff": "yaml", ".yml": "yaml", "": "text"}
_LINK = re.compile(r"(?P<head>\]\()(?P<target>[^)\s#]+)(?P<anchor>#[^)\s]*)?\)")

_NAMED = re.compile(r"\[[\w./-]+\.md\]\((?P<link>(?P<target>[^)\s#]+\.md)(?:#(?P<anchor>[^)\s]*))?)\)")


def _heading(uri: str, match: re.Match[str]) -> str:
    """Return the heading to which a link leads, for a link whose text is the name of a file."""
    page = ROOT / "docs" / posixpath.dirname(uri) / match["target"]
    if not page.is_file():
        return Path(match["target"]).stem
    headings = re.findall(r"^#+ (.+)$", page.read_text(), re.MULTILINE)
    wanted = [h for h in headings if re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") == match["anchor"]]
    return str((wanted or headings)[0])


def _target(uri: str, link: str) -> str | None:
    """Return the path in the repository to which a link of a page leads, where that is outside of docs/."""
    if re.match(r"[a-z]+:|/", link):
        return None
    path = posixpath.normpath(posixpath.join("docs", posixpath.dirname(uri), link))
    return None if path.startswith(("docs/", "..")) else path


def _page_of(path: str) -> str:
    """Return the page of the site that shows a path of the repository."""
    if path in ROOT_PAGES:
        return ROOT_PAGES[path]
    return f"source/{path}/index.md" if (ROOT / path).is_dir() else f"source/{path}.md"


def into_site(markdown: str, uri: str) -> str:
    """Return a page with links that leave docs/ led to pages of the site, and file names as link texts in words."""
    markdown = re.sub(r"(\]\((?:\.\./)*notebooks/\w+)\.ipynb\)", r"\1.md)", markdown)  # which are pages there
    markdown = _NAMED.sub(lambda match: f"[{_heading(uri, match)}]({match['link']})", markdown)

    def replace(match: re.Match[str]) -> str:
        path = _target(uri, match["target"])
        if path is None:
            return match[0]
        page = posixpath.relpath(_page_of(path), posixpath.dirname(uri) or ".")
        return f"{match['head']}{page}{match['anchor'] or ''})"

    return _LINK.sub(replace, markdown)


def root_pages() -> dict[str, str]:
    """Return the documents of the top folder as pages; their links lead from there."""

    def moved(match: re.Match[str]) -> str:
        target = match["target"]
        if re.match(r"[a-z]+:|/", target):
            return match[0]
        link = posixpath.relpath(target, "docs") if not target.startswith("docs/") else target.removeprefix("docs/")
        return f"{match['head']}{link}{match['anchor'] or ''})"

    names = ("CHANGELOG.md", "CONTRIBUTING.md")
    return {ROOT_PAGES[name]: _LINK.sub(moved, (ROOT / name).read_text()) for name in names}


def source_pages(texts: Mapping[str, str]) -> dict[str, str]:
    """Return a page for each file and folder of the repository that pages link to, and for the files of a folder.

    texts : the Markdown of every page by its place in the site.
    """
    wanted = {_target(uri, match["target"]) for uri, text in texts.items() for match in _LINK.finditer(text)}
    made: dict[str, str] = {}
    for path in sorted(filter(None, wanted)):
        if path not in ROOT_PAGES:
            _add(path, made)
    return made


def _add(path: str, made: dict[str, str]) -> None:
    place = ROOT / path
    if place.is_dir():
        inside = sorted(p for p in place.iterdir() if p.is_dir() or p.suffix in LANGUAGES)
        inside = [p for p in inside if p.name[0] not in "._"]
        rows = [f"- [{p.name}{'/' * p.is_dir()}]({p.name}{'/index' * p.is_dir()}.md)" for p in inside]
        made[_page_of(path)] = f"# {path}/\n\n" + "\n".join(rows) + "\n"
        for p in inside:
            _add(f"{path}/{p.name}", made)
    elif place.is_file():
        fence = f'````{LANGUAGES.get(place.suffix, "text")} title="{path}"'
        made[_page_of(path)] = f"# {place.name}\n\n{fence}\n{place.read_text().rstrip()}\n````\n"
