"""`softnlp new`: a scenario of a study with every key explained, which runs as it is."""

from __future__ import annotations

from pathlib import Path

from softnlp.base.errors import InputError
from softnlp.base.reading import choices, did_you_mean
from softnlp.cli.console import say
from softnlp.cli.example import shipped_folder
from softnlp.cli.study import require_file


def new(study: str, /, *, robot: str = "D25L60", out: Path | None = None, force: bool = False) -> None:
    """Write a scenario of a study: every key with its unit, default and meaning, the optional ones commented out.

    It runs as it is. Where the study needs data, a small file of measured ones is written beside it.

    Parameters
    ----------
    study
        forward, blocked-force, workspace, inverse, identify or design.
    robot
        A robot of the library, see `softnlp robots`.
    out
        The scenario; by default STUDY.toml.
    force
        Replace files that are there.
    """
    from softnlp.scenario.check import SCHEMAS
    from softnlp.scenario.template import MEASURED, template

    if study not in SCHEMAS:
        raise InputError(f"expected {choices(SCHEMAS)}, got {study!r}{did_you_mean(study, SCHEMAS)}", key="STUDY")
    target = out or Path(f"{study}.toml")
    require_file(target)
    data = target.with_name(f"{target.stem}_{MEASURED}")
    text = template(study, robot, data.name)
    contents = {target: text.encode()}
    if data.name in text:
        contents[data] = (shipped_folder() / "files" / MEASURED).read_bytes()
    write_new(contents, force)
    for path in contents:
        say(f"wrote {path}")
    say(f"softnlp {'sweep' if study == 'workspace' else 'run'} {target}")


def write_new(contents: dict[Path, bytes], force: bool) -> None:
    """Write files; refuses all of them where one is there already and `force` is not given."""
    from softnlp.base.files import write_whole

    for path in contents:
        require_file(path)
        if path.exists() and not force:
            raise InputError("there is such a file already; --force replaces it", source=str(path))
    for path, content in contents.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, content)
