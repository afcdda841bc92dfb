"""The consensus set at a pose: matched, scored by sums, refined, ranked, and estimated with its walls."""
