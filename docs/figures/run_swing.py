"""Damping, lag and modulus from the trace of a tip after a step of pressure."""

from typing import Any

from docs.figures._shared import command

_done = command("softnlp identify scenarios/identify/swing.toml --out results/swing")


def text() -> str:
    """Return what the command prints."""
    return _done.block


def figure() -> Any:
    """Return what it draws, from the results."""
    from softnlp.figures.again import folder_figures

    return folder_figures(_done.folder / "results/swing")["figure"]()
