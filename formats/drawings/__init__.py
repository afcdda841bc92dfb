"""Drawings of buildings, DXF, SVG, GeoJSON, CSV and JSON, to walls with directions where these can be found."""
