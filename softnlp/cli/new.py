"""`softnlp new`: a scenario of a study with every key explained, which runs as it is."""

from __future__ import annotations

from pathlib import Path

from softnlp.base.errors import InputError
from softnlp.base.reading import choices, did_you_mean
from softnlp.cli.console import say
from softnlp.cli.study import require_file
from softnlp.scenario.examples import shipped_folder


def new(study: str, /, *, robot: str = "D25L60", out: Path | None = None, force: bool = False) -> None:
    """Write a scenario of a study: every key with its unit, default and meaning, the optional ones commented out.

    It runs as it is. Where the study needs data, a small file of measured ones is written beside it.

    Parameters
    ----------
    study
        forward, blocked-force, workspace, inverse, identify, design or dynamic.
    robot
        A robot of the library, see `softnlp robots`.
    out
        The scenario; by default STUDY.toml.
    force
        Replace files that are there.
    """
    from softnlp.scenario.template import MEASURED, template

    require_study(study, "STUDY")
    target = out or Path(f"{study}.toml")
    require_file(target)
    data = f"{target.stem}_{MEASURED}"
    write_begun(target, template(study, robot, data), data, study, force)


def require_study(study: str, key: str) -> None:
    """Refuse a word that is no study."""
    from softnlp.scenario.check import SCHEMAS

    if study not in SCHEMAS:
        raise InputError(f"expected {choices(SCHEMAS)}, got {study!r}{did_you_mean(study, SCHEMAS)}", key=key)


def write_begun(target: Path, text: str, data: str, study: str, force: bool) -> None:
    """Write a scenario, with the shipped measurements beside it where it names them as `data`, and say so.

    Nothing is written where one of the files is there already and `force` is not given.
    """
    from softnlp.base.files import make_folder, write_whole
    from softnlp.scenario.template import MEASURED

    contents = {target: text.encode()}
    if f'"{data}"' in text:
        contents[target.with_name(data)] = (shipped_folder() / "files" / MEASURED).read_bytes()
    for path in contents:
        require_file(path)
        if path.exists() and not force:
            raise InputError("there is such a file already; --force replaces it", source=str(path))
    make_folder(target.parent)
    for path, content in contents.items():
        say(f"wrote {write_whole(path, content)}")
    say(f"softnlp {'sweep' if study == 'workspace' else 'run'} {target}")
