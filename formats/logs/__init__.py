"""Logs of robots, bags of ROS 1 and 2 and text of CARMEN, to scans with the poses that odometry had for them."""
