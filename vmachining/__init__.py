"""vmachining: removed volume of every NC block with its error, and the feed it allows.

    import vmachining as vm
    result = vm.run("models/slot/job.toml")
    vm.swept_volume(vm.Sweep(vm.BallNose(diameter=10, length=40), (0, 0, 0), (30, 0, 0)))
    workpiece = vm.Workpiece(vm.Box((0, 0, -20), (100, 60, 0)))
    workpiece.cut(vm.Sweep(vm.FlatEnd(diameter=10, length=40), (-10, 30, -5), (110, 30, -5)))

| Question | Place |
|---|---|
| Reading programs | `vmachining.nc` |
| Cutters, sweeps, stock minus sweep | `vmachining.tool`, `vmachining.sweep`, `vmachining.engines` |
| What the edge of a cutter touches | `vmachining.engagement` |
| Times, feeds | `vmachining.machine`, `vmachining.feed` |
| A job from file to result, its report | `vmachining.job`, `vmachining.report` |
| Other people's results, reference packs | `vmachining.oracle` |

Each thing has one name: `engage` computes an `Engagement`. The room `vmachining.engagement` and the older name `Bracket` of
`Interval` still load, and are not listed.

Names are loaded when they are first used: importing the package loads no kernel.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from vmachining.later import later as _later

if TYPE_CHECKING:
    from vmachining import engagement as engagement
    from vmachining import engines, nc
    from vmachining.engagement import Engagement
    from vmachining.errors import (
        AccuracyWarning,
        EngineError,
        FeedError,
        InputError,
        JobError,
        KinematicsError,
        NCError,
        StockError,
        SweepError,
        ToolError,
        VMachiningError,
    )  # fmt: skip
    from vmachining.geometry import Arc, Line
    from vmachining.interval import Bracket as Bracket
    from vmachining.interval import Interval
    from vmachining.job import Feed, Force, Job, RunResult, engage, run, swept_volume
    from vmachining.machine import MachineLimits
    from vmachining.nc import parse_program, read_program
    from vmachining.oracle import Comparison, compare, compare_engagement, write_pack
    from vmachining.report import write_engagement, write_report
    from vmachining.sweep import Pose, Sweep, Turn
    from vmachining.tool import (
        AptTool,
        BallNose,
        BullNose,
        FlatEnd,
        Profile,
        ProfileTool,
        Taper,
        tool_from_mapping,
    )  # fmt: skip
    from vmachining.workpiece import Box, Cylinder, Mesh, Step, Workpiece

_ROOMS = {
    "engagement": "Engagement",
    "errors": "AccuracyWarning EngineError FeedError InputError JobError KinematicsError NCError StockError SweepError "
    "ToolError VMachiningError",
    "geometry": "Arc Line",
    "interval": "Bracket Interval",
    "job": "Feed Force Job RunResult engage run swept_volume",
    "machine": "MachineLimits",
    "nc": "parse_program read_program",
    "oracle": "Comparison compare compare_engagement write_pack",
    "report": "write_engagement write_report",
    "sweep": "Pose Sweep Turn",
    "tool": "AptTool BallNose BullNose FlatEnd Profile ProfileTool Taper tool_from_mapping",
    "workpiece": "Box Cylinder Mesh Step Workpiece",
}  # fmt: skip
_load = _later(__name__, _ROOMS)
_PACKAGES = {"engagement": (), "engines": ("mesh", "brep"), "nc": ()}

__all__ = [
    "AccuracyWarning", "AptTool", "Arc", "BallNose", "Box", "BullNose", "Comparison", "Cylinder", "Engagement", "EngineError",
    "Feed", "FeedError", "FlatEnd", "Force", "InputError", "Interval", "Job", "JobError", "KinematicsError", "Line",
    "MachineLimits", "Mesh", "NCError", "Pose", "Profile", "ProfileTool", "RunResult", "Step", "StockError", "Sweep",
    "SweepError", "Taper", "ToolError", "Turn", "VMachiningError", "Workpiece", "compare", "compare_engagement", "engage",
    "engines", "nc", "parse_program", "read_program", "run", "swept_volume", "tool_from_mapping", "write_engagement",
    "write_pack", "write_report",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """PEP 562: load a name from its room when it is requested."""
    if name not in _PACKAGES:
        return _load(name)
    value = globals()[name] = import_module(f"{__name__}.{name}")
    for part in _PACKAGES[name]:
        import_module(f"{__name__}.{name}.{part}")
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
