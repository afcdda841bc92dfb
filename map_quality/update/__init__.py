"""Changes of a building that scans show, found in the scans that were localized in its map."""
