"""Speed and quality: what the house can do, in figures, each beside its goal."""
