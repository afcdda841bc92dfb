"""Output for an operator: counts, the log, and traces."""
