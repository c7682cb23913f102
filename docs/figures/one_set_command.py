"""The tutorial's first run: as it is printed and drawn."""

from docs.figures._shared import command

DONE = command("softnlp run scenarios/D25L60_one_set.toml")


def text() -> str:
    """Return what the command prints, under the name of the tutorial's file."""
    return DONE.block.replace("scenarios/D25L60_one_set.toml", "my_robot.toml").replace("D25L60_one_set", "my_robot")


def figure():
    """Return what it draws."""
    return DONE.folder / "results" / "D25L60_one_set" / "figure.png"
