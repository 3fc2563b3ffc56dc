"""Picture of the cells of two blocks as the columns engine divided them: `python docs/site/columns_picture.py`.

Writes docs/figures/columns.png.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm

import vmachining as vm
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.geometry import Line
from vmachining.sweep import Sweep

FIGURES = Path(__file__).resolve().parent.parent / "figures"
STOCK = FlatStock((-8.0, -8.0, -20.0), (16.0, 10.0, 0.0))
BULL = vm.BullNose(diameter=10.0, corner_radius=2.0, length=60.0)

CASES = (
    ("one row of a finishing pass, bull nose 10 mm, 1 mm deep", 1.5, -1.0, 0.0),
    ("a ramp beside a slot, 6 to 9 mm deep", 4.0, -6.0, -3.0),
)
"""Title, distance from the row before, depth, rise of the block."""


def drawn(ax: plt.Axes, title: str, step: float, z: float, rise: float) -> PolyCollection:
    """Cells of one block 6 mm long behind a row of 12 mm."""
    engine = ColumnsEngine(STOCK, 0.01)
    engine.cut(Sweep.along(BULL, Line((-4, 0, z), (12, 0, z))))
    found = engine.cut(Sweep.along(BULL, Line((0, step, z), (6, step, z + rise))))
    x, y, hx, hy, lo, hi = engine.last_cells[np.ptp(engine.last_cells[:, 4:], axis=1) > 0.0].T
    corners = np.stack([
        np.column_stack([x + a * hx, y + b * hy]) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ], axis=1)  # fmt: skip
    cells = PolyCollection(
        corners, edgecolors="0.35", linewidths=0.3, cmap="viridis", norm=LogNorm(1e-4, 1.0)
    )
    cells.set_array(np.maximum((hi - lo) / (4.0 * hx * hy), 1e-4))
    ax.add_collection(cells)
    t = np.linspace(0.0, 2.0 * np.pi, 200)
    for a, b, style in (((-4.0, 0.0), (12.0, 0.0), "--"), ((0.0, step), (6.0, step), "-")):
        side = np.cos(t) > 0.0
        ax.plot(
            5.0 * np.cos(t) + np.where(side, b[0], a[0]), 5.0 * np.sin(t) + a[1], f"k{style}", linewidth=0.8
        )
    ax.set(xlim=(-6.0, 12.0), ylim=(-6.0, 10.0), aspect="equal", xlabel="x, mm", ylabel="y, mm")
    share = 100.0 * found.width / found.estimate
    ax.set_title(f"{title}\n{found.estimate:.3f} mm³ to {share:.2f} %, {len(x)} cells", fontsize=9)
    return cells


def main() -> None:
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 4.6), layout="constrained")
    for ax, case in zip(axes, CASES, strict=True):
        cells = drawn(ax, *case)
    figure.colorbar(cells, ax=axes, label="width of the bracket by area, mm", shrink=0.9)
    figure.savefig(FIGURES / "columns.png", dpi=90)


if __name__ == "__main__":
    main()
