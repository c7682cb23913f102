"""What moves the tip of a loaded robot."""

from docs.figures._shared import command

DONE = command("softnlp sensitivity scenarios/D25L60_loaded_tip.toml --step 3 --tolerance length_mm=0.2 C01_MPa=3%")


def text() -> str:
    """Return what the command prints."""
    return DONE.block


def figure():
    """Return what it draws."""
    return DONE.folder / "results/D25L60_loaded_tip/sensitivity.png"
