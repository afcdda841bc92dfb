"""Limits and thresholds of the package, with unit and origin."""

from __future__ import annotations

import math

# Limits of messages from outside. The node refuses more, and never cuts.
MAX_TRANSFORMS = 2_000  # of one message; a humanoid robot has some 200
MAX_FRAMES = 5_000  # that are stored, some 2 KB each
TRANSFORMS_KEPT = 200  # of a moving frame: 2 s at 100 Hz
MAX_MOUNT = 100.0  # m from the base to a laser; the longest vehicles with lasers have some 60 m
MAX_GRID_BYTES = 64 * 2**20  # of an OccupancyGrid: 64 million cells
MAX_SPEED = 100.0  # m/s
MAX_TURN_RATE = 100.0  # rad/s
CLOCK_BACK_NS = 1_000_000_000  # ns; stamps that jump back by more are those of a clock that was set back

CLOCK_AHEAD_NS = 5_000_000_000  # ns by which a scan may be newer than the last one; a laser without return has 1 Hz

# Times of work.
CONVERSION_SECONDS = 60.0  # s of a core for a grid: the slowest public plan takes 4 s, noise some minutes
CONVERSION_PATIENCE = 300.0  # s, where others are at work on the cores
CONVERSION_IDLE = 60.0  # s after which the process of conversions ends; it holds some 200 MB
CONVERSION_BYTES = 4 * 2**30  # address space of the process that converts a grid
SEARCH_SECONDS = 10.0  # s for one scan; the slowest of the public logs takes 1 s
END_SECONDS = 0.5  # s that the end waits for a search
ODOMETRY_SECONDS = 0.5  # s that a result waits for odometry of its time; the slowest usual odometry has 10 Hz
REPEAT_SECONDS = 1.0  # s within which the same problem is published once

SAME_MAP = 0.8  # of the walls; a map of which more has changed may be another one, and its pose is found again

# When scans agree.
AGREEING_CHI_SQUARE = 16.27  # quantile of 99.9 % at three degrees of freedom
ODOMETRY_DISTANCE = 0.03  # m, standard deviation of a step of any length: times of scans and odometry differ
ODOMETRY_DISTANCE_PER_METRE = 0.05  # wheels slip by some per cent
ODOMETRY_ANGLE = 0.01  # rad
ODOMETRY_ANGLE_PER_ANGLE = 0.05
ODOMETRY_ANGLE_PER_METRE = 0.02  # rad/m
UNKNOWN_SPEED = 1.0  # m/s, and
UNKNOWN_TURN_RATE = 1.0  # rad/s; standard deviations of a motion that odometry does not show
UNKNOWN_SECONDS = 2.0  # s without odometry over which a scan may still confirm an agreed pose
RIVAL_NATS = 15.0  # another pose whose score is lower by less is likely: more scans have to agree
SEPARATE_DISTANCE = 0.15  # m; scans nearer to each other in place,
SEPARATE_ANGLE = math.radians(10.0)  # heading,
SEPARATE_NS = 1_000_000_000  # ns and time count once: their errors are the same
MOVED = 0.5  # m, or
TURNED = math.radians(30.0)  # between the scans that agree, or
RESTED_NS = 5_000_000_000  # ns at rest
UNEXPLAINED_SCANS = 5  # that agree with no hypothesis by odometry, from which on only way counts
FORGOTTEN_NS = 60_000_000_000  # ns after which a hypothesis without support is dropped
MAX_HYPOTHESES = 20
INCONCLUSIVE_NATS = 10.0  # a scan decides only if poses that are not listed score lower by at least this

# Limits and times of publishing.
LOCALIZER_SIGMA = 0.1  # m; how far a localizer that is right may be off besides its own covariance,
LOCALIZER_SIGMA_THETA = math.radians(3.0)  # rad
MAX_COVARIANCE = 1e6  # m^2, rad^2
SETTLE_SECONDS = 1.0  # s until a new subscriber has discovered the publisher, too: what comes earlier is lost
LOST_SCANS = 3  # scans that confirm another pose than the localizer's
LOST_SECONDS = 10.0  # s between two poses for a lost localizer: it needs some time to take one
ALWAYS_SECONDS = 0.5  # s between two poses with `--when always`
UNCONFIRMED_SECONDS = 0.5  # s without odometry, after which a scan has to confirm the published transform
CORRECTION_SPEED = 0.2  # m/s, and
CORRECTION_TURN_RATE = math.radians(10.0)  # rad/s, with which the published transform follows the agreed pose
TRANSFORM_PERIOD_NS = 50_000_000  # ns between two transforms: 20 Hz
TRANSFORM_TOLERANCE_NS = 200_000_000  # ns that a published transform is dated ahead, as AMCL does
ENDED_SECONDS = 2.0  # s without scans or odometry after which the pose is stale
MISSED_PERIODS = 3  # of scans, at least, before they count as ended: slow lasers
SEVERAL_SCANS = 3  # within `ENDED_SECONDS`, from which on a publisher counts: drivers start again
CLOCKS_AGREE_NS = 200_000_000  # ns; times from stamp to reception may differ by so much where the clocks agree
LAG_SECONDS = 3.0  # s between two scans whose motion is compared with odometry
LAG_DECIDES = 12.0  # by which a sum of chi-squares has to be less before the time of odometry is chosen otherwise
SILENT_SECONDS = 10.0  # s without scans, a map or a transform, after which that is logged
LOG_SECONDS = 60.0  # s within which the same line is logged once
