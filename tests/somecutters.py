"""One cutter of every kind, small enough for tests of the mesh engine."""

from vmachining.tool import BallNose, BullNose, FlatEnd, ProfileTool, Taper

TOOLS = {
    "flat": FlatEnd(diameter=6, length=8),
    "ball": BallNose(diameter=6, length=8),
    "bull": BullNose(diameter=8, corner_radius=1.5, length=8),
    "taper": Taper(diameter=3, taper_deg=10, corner_radius=0.7, length=8),
    "barrel": ProfileTool(points=[(0, 0), (2, 0), (4, 3), (2.5, 8)]),
}
