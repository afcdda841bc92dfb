"""The page at ``/``: built from ``web/`` by ``make page``, with its examples; nothing here is written by hand."""
