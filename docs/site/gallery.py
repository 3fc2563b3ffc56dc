"""Pictures of docs/gallery.md, the finished workpieces of models: .venv/bin/python docs/site/gallery.py [MODEL ...]"""

import sys
from pathlib import Path

import vmachining as vm

ROOT = Path(__file__).parents[2]
MODELS = (
    "slot",
    "pocket",
    "staircase",
    "mould_cover",
    "triangular_pocket",
    "half_cylinder",
    "impeller",
    "mill_turn",
    "blade",
)

for name in sys.argv[1:] or MODELS:
    figure = vm.run(ROOT / "models" / name / "job.toml", stages="cut").surface.plot()
    figure.savefig(ROOT / "docs" / "figures" / f"part_{name}.png", dpi=70)
    print(name)
