"""What an operator sees: counts, the log, and traces."""
