"""Film `clearway view --example` as its two agents race to one target: `python race.py race.webp`.

It needs Chromium, as the viewer's test does. The start is chosen: from here `shortest` bumps once and takes 17 steps,
`collision-aware` 14. Which of them wins is typical, the bump is not. Counted in this viewer, by seeds from 0 on,
`shortest` first, steps and collisions as means:

    episodes                                  won by      fewer collisions    collisions      steps
    200 from this start to this target        16 :  91     9 : 24             0.140  0.085    16.6  15.3
    300 from drawn starts to this target      28 :  86     0 : 33             0.133  0.013    11.0  10.4
    100 from drawn starts to each of five     28 : 111     4 : 19             0.062  0.030     9.7   9.2

In the others they tie; in most, neither bumps.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from PIL import Image
from playwright.sync_api import FloatRect, ViewportSize, sync_playwright

EPISODE = "scene=bathroom&start=94&target=57&selection=sampled&seed=2"
VIEWPORT: ViewportSize = {"width": 1240, "height": 800}
CLIP: FloatRect = {"x": 0, "y": 0, "width": 1240, "height": 622}  # the map, the target, both agents
SHOWN_PX = 1000, 502
STEP_MS, END_MS = 400, 2400
QUALITY = 72


def frames(address: str) -> Iterator[Image.Image]:
    """The page before the first step and after each, until both agents have arrived."""
    with sync_playwright() as playwright:
        chromium = shutil.which("chromium") or playwright.chromium.executable_path
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport=VIEWPORT, reduced_motion="reduce")
        page.goto(f"{address}#{EPISODE}")
        page.locator(".walker").first.wait_for()
        page.wait_for_timeout(2000)  # pictures arrive
        while True:
            picture = Image.open(io.BytesIO(page.screenshot(clip=CLIP))).convert("RGB")
            yield picture.resize(SHOWN_PX, Image.Resampling.LANCZOS)
            if page.locator(".badge.good").count() == 2:
                return
            page.keyboard.press("n")
            page.wait_for_timeout(700)


def film(out: Path) -> None:
    """Serve the example, and write what the page shows."""
    command = [sys.executable, "-m", "clearway", "view", "--example"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as viewer:
        assert viewer.stdout is not None
        try:
            first, *others = frames(viewer.stdout.readline().strip())
        finally:
            viewer.terminate()
    duration = [STEP_MS] * len(others) + [END_MS]
    first.save(out, save_all=True, append_images=others, duration=duration, loop=0, quality=QUALITY, method=6)


if __name__ == "__main__":
    film(Path(sys.argv[1]))
