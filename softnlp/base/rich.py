"""How an object shows itself in a notebook: the writer stands above all that it draws on, and is found when asked."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def rich_html(shown: Any) -> str:
    """Return the HTML of a robot, a material or a run, for `_repr_html_` of its class."""
    return str(import_module("softnlp.app.rich_html").html_of(shown))
