"""Every notebook runs from top to bottom, in an emptied kernel, without a screen; its kept outputs are of this version."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

HEAVY = 300_000
"""Bytes of a notebook with its pictures."""

NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))


LONG = ("which_engine", "paths_on_facets", "contact_and_forces", "a_log_beside_the_run", "volumes_and_feeds")
"""Notebooks that take more than eight seconds of processor: they run whole programs."""


EMPTIED = "import matplotlib.pyplot as plt\nplt.close('all')\n%matplotlib inline\n%reset -f"
"""What comes before a notebook: nothing of the one before is left, but the modules that it has loaded."""


@pytest.fixture(scope="module")
def kernel() -> Iterator[Any]:
    """One interpreter for all: most of what a notebook costs is the loading of modules."""
    from jupyter_client.manager import KernelManager

    root = Path(__file__).parents[2]
    manager = KernelManager(kernel_name="python3")
    path = os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH"))))
    manager.start_kernel(
        env=os.environ | {"MPLBACKEND": "module://matplotlib_inline.backend_inline", "PYTHONPATH": path},
        cwd=str(root / "notebooks"),
    )
    yield manager
    manager.shutdown_kernel(now=True)


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, id=p.stem, marks=[pytest.mark.long] if p.stem in LONG else []) for p in NOTEBOOKS],
)
@pytest.mark.slow  # 2 to 7 s each
def test_notebook_runs(path: Path, kernel: Any) -> None:
    notebook = nbformat.read(path, as_version=4)
    kept = [_shape(cell) for cell in notebook.cells]
    assert len(path.read_bytes()) < HEAVY and str(path.parents[1]) not in path.read_text()
    notebook.cells.insert(0, nbformat.v4.new_code_cell(EMPTIED))
    # what a cell prints comes in as many pieces as the machine is slow
    nbclient.NotebookClient(notebook, km=kernel, timeout=240, coalesce_streams=True).execute()
    del notebook.cells[0]
    images = [
        output
        for cell in notebook.cells
        if cell.cell_type == "code"
        for output in cell.outputs
        if "image/png" in output.get("data", {})
    ]
    assert images
    assert not [o for cell in notebook.cells for o in cell.get("outputs", ()) if o.get("name") == "stderr"]
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
