"""The colours of chamber sets, the same in every figure, file and view."""

from __future__ import annotations

# Okabe and Ito's palette, which colour-blind readers tell apart, the darker ones first.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442")


def colour(index: int) -> str:
    """Return the colour of a chamber set (from 0) or of a silicone; they repeat after seven."""
    return COLOURS[index % len(COLOURS)]
