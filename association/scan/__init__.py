"""A scan as the search reads it: its lines, several views put together."""
