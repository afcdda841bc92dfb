"""Updates of maps: whether changes of a building are found, and whether maps are ever made worse.

``python -m benchmarks upkeep``
"""

from .tables import upkeep

__all__ = ["upkeep"]
