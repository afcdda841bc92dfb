"""``linefix map``: maps of other tools in, maps checked, updated, drawn, stored."""
