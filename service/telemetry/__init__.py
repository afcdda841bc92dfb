"""Output for an operator: counts and the log."""
