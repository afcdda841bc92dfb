"""Updates of maps: whether changes of a building are found, and whether maps are ever made worse.

``python -m benchmarks upkeep``, or a part of it, such as ``upkeep-changes``.
"""

from .tables import UPKEEP

__all__ = ["UPKEEP"]
