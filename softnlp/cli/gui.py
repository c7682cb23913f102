"""`softnlp gui`: the app in the browser."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from softnlp.base.errors import InputError
from softnlp.cli.console import SOLVED


def gui(
    scenario: Path | None = None,
    /,
    *,
    port: int | None = None,
    host: str = "127.0.0.1",
    root_path: str = "",
    trusted_host: tuple[str, ...] = (),
    no_browser: bool = False,
) -> int:
    """Serve the app on 127.0.0.1 and open it in the browser; Ctrl-C ends it. Needs no internet.

    It answers under its own address only, and under localhost by any port, as an SSH tunnel has it; docs/app.md says
    how it runs behind Jupyter and other proxies.

    Parameters
    ----------
    scenario
        TOML file to start with.
    port
        Where to listen; by default the first free port from 8080.
    host
        Name or address to listen at; another than 127.0.0.1 opens the app to other machines, without a password.
    root_path
        Path under which a proxy shows the app, such as /softnlp.
    trusted_host
        HOST or HOST:PORT under which the app is opened besides its own address; may be repeated.
    no_browser
        Print the address only.
    """
    missing = [name for name in ("nicegui", "plotly", "tomlkit") if find_spec(name) is None]
    if missing:
        raise InputError(f"the app needs {', '.join(missing)}: pip install 'softnlp[gui]'")
    from softnlp.figures.style import import_alone

    import_alone()
    from softnlp.app.server import serve

    serve(scenario, port, not no_browser, host=host, root=root_path, trusted=trusted_host)
    return SOLVED
