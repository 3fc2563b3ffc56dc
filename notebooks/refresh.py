"""Run every notebook and keep its outputs: `python notebooks/refresh.py [NAME...]`, after a change that they show.

What changes from run to run is left out: execution times, and paths of this machine would be refused.
"""

from __future__ import annotations

import os
import sys
from base64 import b64decode, b64encode
from io import BytesIO
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from PIL import Image  # comes with matplotlib

HERE = Path(__file__).resolve().parent
COLORS = 128


def executed(path: Path) -> nbformat.NotebookNode:
    """The notebook with its outputs, made in a fresh kernel."""
    os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(
        notebook, timeout=240, kernel_name="python3", resources={"metadata": {"path": str(path.parent)}},
        record_timing=False, coalesce_streams=True,
    )  # fmt: skip
    client.execute()
    for cell in notebook.cells:
        for output in cell.get("outputs", ()):
            if picture := output.get("data", {}).get("image/png"):
                output["data"]["image/png"] = _light(picture)
    return notebook


def _light(picture: str) -> str:
    """A picture of lines and few colours, in a third of its bytes."""
    image = Image.open(BytesIO(b64decode(picture))).convert("RGB")
    buffer = BytesIO()
    image.quantize(COLORS).save(buffer, format="PNG", optimize=True)
    return b64encode(buffer.getvalue()).decode()


def main(names: list[str]) -> None:
    """Refresh all, or those named."""
    for path in sorted(HERE.glob("*.ipynb")):
        if names and path.stem not in names:
            continue
        notebook = executed(path)
        text = nbformat.writes(notebook)
        if str(HERE.parent) in text:
            raise SystemExit(f"{path.name}: an output names a folder of this machine")
        path.write_text(text + "\n", encoding="utf-8")
        print(f"{path.name}: {len(text) // 1000} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
