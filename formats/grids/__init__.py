"""Occupancy grids: pictures of map_server and messages of ROS, to faces of walls."""
