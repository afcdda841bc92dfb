"""Places of a map where localization fails: a virtual scanner on a grid of poses, each scan searched in the map."""
