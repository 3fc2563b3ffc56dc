"""The shipped models as the tests use them: the generator beside each, and jobs cut down to size."""

from __future__ import annotations

import importlib.util
import re
import shutil
import sys
from functools import cache
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parents[2]
MODELS = ROOT / "models"
NAMES = ("slot", "pocket", "half_cylinder", "mould")


@cache
def generator(name: str) -> ModuleType:
    """models/NAME/make.py as a module."""
    spec = importlib.util.spec_from_file_location(f"make_{name}", MODELS / name / "make.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def reduced(name: str, folder: Path, *, chord: float, feed: bool = False, program: str | None = None) -> Path:
    """A copy of a model: coarser chord, no scheduling unless asked, another program if given."""
    target = folder / name
    shutil.copytree(MODELS / name, target)
    job = target / "job.toml"
    text = re.sub(r"chord_mm = \S+", f"chord_mm = {chord}", job.read_text(encoding="utf-8"))
    if not feed:
        text = text.split("[feed]")[0]
    job.write_text(text, encoding="utf-8")
    if program is not None:
        (target / f"{name}.nc").write_text(program, encoding="ascii")
    return job
