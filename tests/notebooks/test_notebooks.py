"""Every notebook runs from top to bottom, in a fresh kernel, without a screen; its kept outputs are of this version."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

HEAVY = 300_000
"""Bytes of a notebook with its pictures."""

NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))


LONG = ("which_engine",)
"""Notebooks that take a minute: every engine cuts every kind of block."""


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, id=p.stem, marks=[pytest.mark.long] if p.stem in LONG else []) for p in NOTEBOOKS],
)
@pytest.mark.slow  # 14 s
def test_notebook_runs(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    root = path.parents[1]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH")))))
    notebook = nbformat.read(path, as_version=4)
    kept = [_shape(cell) for cell in notebook.cells]
    assert len(path.read_bytes()) < HEAVY and str(root) not in path.read_text()
    client = nbclient.NotebookClient(
        notebook, timeout=240, kernel_name="python3", resources={"metadata": {"path": str(path.parent)}},
        coalesce_streams=True,  # what a cell prints comes in as many pieces as the machine is slow
    )  # fmt: skip
    client.execute()
    images = [
        output
        for cell in notebook.cells
        if cell.cell_type == "code"
        for output in cell.outputs
        if "image/png" in output.get("data", {})
    ]
    assert images
    assert [_shape(cell) for cell in notebook.cells] == kept, "python notebooks/refresh.py"


def _shape(cell: object) -> list[tuple[str, list[str], str]]:
    """Kinds of the outputs of a cell, and the words of what it prints; numbers may differ in their last digits."""
    return [
        (
            output.output_type,
            sorted(output.get("data", ())),
            re.sub(r"[-+\d.e%]+", "#", str(output.get("text", ""))),
        )
        for output in cell.get("outputs", ())  # type: ignore[attr-defined]
    ]
