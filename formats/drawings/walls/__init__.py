"""From the lines of a drawing to walls: units, lines far away, doubles, centre lines, faces, directions.

`to_map` calls the others; it does not matter here which file the drawing comes from.
"""
