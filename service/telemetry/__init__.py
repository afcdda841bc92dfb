"""What an operator sees: counts and the log."""
