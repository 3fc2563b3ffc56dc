from vmachining.engagement.analytic.heights import bounds, heights_of
from vmachining.engagement.analytic.passes import Corner, Pass, engaged
from vmachining.engagement.analytic.stairs import HeightStock
from vmachining.engagement.analytic.workpiece import HeightWorkpiece, corner_of

__all__ = ["Corner", "HeightStock", "HeightWorkpiece", "Pass", "bounds", "corner_of", "engaged", "heights_of"]
