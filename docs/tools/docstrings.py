"""Docstrings as the site shows them: each name on a line of its own, with the type that the code gives it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from griffe import DocstringSectionKind, Extension, Object, Parser

FOLDER = Path(__file__).parents[1] / "api"
_KINDS = (DocstringSectionKind.parameters, DocstringSectionKind.attributes)


class OwnLines(Extension):
    """Splits entries of several names, `a, b : text`, and takes types from the signature or the class.

    What stands behind a colon in a docstring here is a description; a type there would only repeat the signature.
    """

    def on_package(self, *, pkg: Any, **kwargs: Any) -> None:
        """Go through what the pages of the interface show."""
        text = "\n".join(page.read_text() for page in sorted(FOLDER.glob("*.md")))
        for path in re.findall(r"^::: softnlp\.([\w.]+)$", text, re.MULTILINE):
            self._walk(pkg[path])

    def _walk(self, found: Object) -> None:
        if found.docstring is not None and (found.is_function or found.is_class):
            found.docstring.parser = Parser.numpy
            for section in found.docstring.parsed:
                if section.kind in _KINDS:
                    section.value = [line for item in section.value for line in _lines(item, found)]
        for member in found.members.values():
            if not member.is_alias:
                self._walk(member)


def _lines(item: Any, owner: Object) -> list[Any]:
    """Return the entries of one item, one for each name."""
    text = "" if item.annotation is None else str(item.annotation).strip()
    made = []
    for name in item.name.split(", "):
        typed = _declared(owner, name.lstrip("*"))
        written = type(item)(name=name, annotation=typed, description=item.description or text)
        if hasattr(item, "value"):
            written.value = getattr(item, "value", None)
        made.append(written)
    return made


def _declared(owner: Object, name: str) -> Any:
    """Return the annotation of a parameter or a field, None where the code has none."""
    if owner.is_function and name in owner.parameters:
        return owner.parameters[name].annotation
    member = owner.members.get(name)
    if member is None or member.is_alias:
        return None
    return getattr(member, "annotation", None) or getattr(member, "returns", None)
