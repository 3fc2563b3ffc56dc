"""Takes docs/report.png, the report of models/slot in a browser: python docs/site/screenshot.py (selenium, Chromium)."""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

import vmachining as vm
from vmachining.report import write_report

DOCS = Path(__file__).parents[1]
WIDTH, HEIGHT = 1280, 1420
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


def main() -> None:
    options = Options()
    options.binary_location = shutil.which("chromium") or shutil.which("google-chrome") or ""
    for flag in (*FLAGS, "--hide-scrollbars"):
        options.add_argument(flag)
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "report.html"
        write_report(vm.run(vm.Job.load(DOCS.parent / "models" / "slot" / "job.toml")), page)
        browser = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
        browser.set_window_size(WIDTH, HEIGHT)
        browser.get(page.as_uri())
        while not browser.execute_script("return document.documentElement.dataset.ready"):
            time.sleep(0.1)
        time.sleep(1.0)  # the picture is drawn with the next frames
        browser.save_screenshot(str(DOCS / "report.png"))
        browser.quit()


if __name__ == "__main__":
    main()
