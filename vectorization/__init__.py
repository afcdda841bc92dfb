"""vectorization."""
