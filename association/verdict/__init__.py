"""How likely the best pose is right, and whether a robot may use it."""
