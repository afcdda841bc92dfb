"""Drawings in SVG: the XML within bounds, styles by CSS, what is visible and where, shapes to polylines.

::

    xml       bytes to elements
    styles    what CSS and attributes say of each element
    visible   which shapes are drawn, and where: groups, nested pictures, copies by use
    shapes    shapes and paths to polylines; lengths with units
    reading   the four of them, one after the other
"""
