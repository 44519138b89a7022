"""Film the viewer as two agents race to one target: `python race.py demo race.webp`.

Its first argument is what `scripts/demo` wrote, with both runs. It needs Chromium, as the viewer's test does.
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

EPISODE = "scene=bathroom&start=7&target=57&selection=sampled&seed=0"
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
            if page.get_by_text("reached", exact=True).count() == 2:
                return
            page.keyboard.press("n")
            page.wait_for_timeout(700)


def film(demo: Path, out: Path) -> None:
    """Serve the demo's runs, and write what the page shows."""
    runs = [demo / "runs" / name for name in ("shortest", "collision-aware")]
    command = [sys.executable, "-m", "clearway", "view", *map(str, runs), "--scenes", str(demo / "bathroom.h5")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as viewer:
        assert viewer.stdout is not None
        try:
            first, *others = frames(viewer.stdout.readline().strip())
        finally:
            viewer.terminate()
    duration = [STEP_MS] * len(others) + [END_MS]
    first.save(out, save_all=True, append_images=others, duration=duration, loop=0, quality=QUALITY, method=6)


if __name__ == "__main__":
    film(Path(sys.argv[1]), Path(sys.argv[2]))
