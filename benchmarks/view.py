"""How long the browser takes from a new shape to its picture: in place, against making the robot again each time.

    python -m benchmarks.view [--chromium PATH]

Needs playwright and a Chromium. Both ways run in turn in one page without a graphics card, so the ratio is what counts;
the last line has the way from Python, over the socket, to the picture.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from softnlp.app.view.message import frame_message, robot_message
from view_browser import FLAGS, STAGE, drawn, served

FRAMES = 40
TIMED = """
async ([robot, frames, again]) => {
  const stage = %s;
  const box = document.querySelector(".softnlp-view");
  const taken = [];
  for (const frame of frames) {
    const start = performance.now();
    if (again) stage.setRobot(robot);
    stage.show(frame);
    while (box.dataset.frame !== String(frame.id)) await new Promise(requestAnimationFrame);
    stage.renderer.getContext().finish();
    taken.push(performance.now() - start);
  }
  return taken.sort((a, b) => a - b)[taken.length >> 1];
}
"""


def main() -> None:
    """Print the medians."""
    import view_page
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chromium", default=shutil.which("chromium"), help="the browser to start")
    asked = parser.parse_args()
    robot = robot_message(view_page.ARM)
    with served() as address, tempfile.TemporaryDirectory() as profile, sync_playwright() as playwright:
        browser = playwright.chromium.launch_persistent_context(
            profile, executable_path=asked.chromium, args=FLAGS, viewport={"width": 1000, "height": 800}
        )
        page = browser.new_page()
        page.goto(address)
        drawn(page, 1)
        medians = {}
        number = 1000
        for _ in range(2):  # the first round warms up
            for again in (False, True):
                frames = []
                for k in range(FRAMES):
                    number += 1
                    frames.append(frame_message(view_page.frame(0.9, k / FRAMES), number, 1.5))
                medians[again] = page.evaluate(TIMED % STAGE, [robot, frames, again])
        print(f"{'in place':<28}{medians[False]:8.1f} ms")
        print(f"{'made again':<28}{medians[True]:8.1f} ms   {medians[True] / medians[False]:.2f} times as long")
        page.goto(address)
        drawn(page, 1)
        page.click("#round")
        page.wait_for_function("document.querySelector('#said').innerText !== ''", timeout=60_000)
        print(f"{'from Python to the picture':<28}{float(page.inner_text('#said').split()[1]):8.1f} ms")
        browser.close()


if __name__ == "__main__":
    main()
