"""Search: the poses on a map that explain a scan best.

The method is RANSAC, in the form of PoseLib's ``ransac_impl.h``: one loop, three steps, one record of statistics. The
loop is `kernels.searching.search_bases`:

1. Draw a minimal sample, here called a base: two scan segments that are not parallel fix a pose (`kernels.bases`).
   Those come first whose pose is precise and whose search costs little; at random only on request.
2. Form the hypotheses of the base: one for each pair of wall chains on which both segments may lie. Crossings of chains
   are looked up in lists (`kernels.lookup`), or else one segment is swept along each chain (`kernels.sweeping`);
   `kernels.hypotheses` turns what is found into poses. Each hypothesis is rejected early, or matched to the walls
   and refined by growing and shrinking its consensus set (`kernels.scoring`). It is then stored among the best poses
   (`kernels.best_poses`).
3. Evaluate the stopping rule, whether a better consensus set may have been missed: by a bound on its gain, and by the
   fraction of sampled consensus sets that hold none of the bases so far (`kernels.stopping`).

Parallel walls alone, as in a corridor, make no base: `kernels.sliding` lays their segments on each chain at even steps.

`candidates.find_candidates` is the entry from Python. A search is not resumed. It reads a flag between two hypotheses
and ends where the deadline has set it. The best poses so far are then the result, and its report has `complete` False.
"""
