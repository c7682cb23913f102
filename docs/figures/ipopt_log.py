"""IPOPT's log of the problem of docs/nlp.md, as it is printed."""

from __future__ import annotations

import re
import subprocess
import sys

from docs.tools.cache import ROOT
from docs.tools.pages import blocks


def text() -> str:
    """Return what the first two blocks of code of the page print; the log goes to standard error."""
    code = "\n".join(code for _, language, code in blocks("nlp")[:2] if language == "python")
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    log = re.sub(r"(Total seconds in IPOPT\s+= ).*\n", "", done.stderr)  # another one each time
    return f"```text\n{log.strip()}\n```"


if __name__ == "__main__":
    print(text())
