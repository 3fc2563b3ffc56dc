from vmachining.engagement.analytic.passes import Corner, Pass, engaged
from vmachining.engagement.analytic.stairs import HeightStock

__all__ = ["Corner", "HeightStock", "Pass", "engaged"]
