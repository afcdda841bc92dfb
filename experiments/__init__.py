"""The paper's experiments, reproduced and exceeded; `docs/dev/experiments.md` shows what they give.

Lengths that are reported are in the paper's units, of which the grid of its figures has 50; the libraries work in
metres, and `scenes.UNIT` is how many of those a unit is taken to be.
"""
