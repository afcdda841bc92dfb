"""Hypotheses from minimal samples of two scan segments, and the rule that stops the search."""
