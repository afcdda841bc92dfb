"""Search: the poses on a map that explain a scan best.

The method is RANSAC, in the form of PoseLib's ``ransac_impl.h``: one loop in Python, whose steps are kernels.

1. Draw a minimal sample, here called a base: two scan segments that are not parallel fix a pose. Those come first whose
   pose is precise and whose search costs little (`rank_bases`); at random only on request.
2. Propose the poses of the base: one segment is swept along each wall chain, and the other one lies on the chains that
   its midpoint crosses (`sweep_base`). Each pose is rejected early (`reject`), or matched to the walls and refined by
   growing and shrinking its consensus set (`score_poses`), and stored among the best poses.
3. Evaluate the stopping rule, whether a better consensus set may have been missed: by a bound on its gain, and by the
   fraction of sampled consensus sets that hold none of the bases so far (`count_missed`).

Parallel walls alone, as in a corridor, make no base: `slide_line` lays their segments on each chain at even steps.

The deadline is looked at between two calls of kernels. The best poses so far are then the result, and its report has
`complete` False.
"""
