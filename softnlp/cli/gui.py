"""`softnlp gui`: the app in the browser."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from softnlp.cli.console import SOLVED
from softnlp.errors import InputError


def gui(scenario: Path | None = None, /, *, port: int | None = None, no_browser: bool = False) -> int:
    """Serve the app on 127.0.0.1 and open it in the browser; Ctrl-C ends it. Needs no internet.

    Parameters
    ----------
    scenario
        TOML file to start with.
    port
        Where to listen; by default the first free port from 8080.
    no_browser
        Print the address only.
    """
    missing = [name for name in ("nicegui", "plotly", "tomlkit") if find_spec(name) is None]
    if missing:
        raise InputError(f"the app needs {', '.join(missing)}: pip install 'softnlp[gui]'")
    from softnlp.plots.style import import_alone

    import_alone()
    from softnlp.app.server import serve

    serve(scenario, port, not no_browser)
    return SOLVED
