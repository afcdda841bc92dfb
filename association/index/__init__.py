"""A map of segments as the search reads it: walls, wall chains, the grids over them."""
