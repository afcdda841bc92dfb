"""Doubtful parts of a map, found in the map alone and with sample scans."""
