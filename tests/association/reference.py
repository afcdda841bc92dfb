"""Slow, obviously right twins of the search's kernels."""

import math

import numpy as np


def first_hit(x, y, dx, dy, limit, walls):
    """Go through all walls."""
    best, wall = limit, -1
    for w, row in enumerate(walls):
        d, n = row[:2], np.array([-row[1], row[0]])
        across = n @ np.array([dx, dy])
        if abs(across) < 1e-9:
            continue
        reach = (row[2] - n @ np.array([x, y])) / across
        along = d @ np.array([x + reach * dx, y + reach * dy])
        if 1e-6 < reach < best and row[3] <= along <= row[4]:
            best, wall = reach, w
    return best, wall


def match_segment(row, theta, tx, ty, offset_gate, cos_gate, min_overlap, walls):
    """Go through all walls."""
    c, s = math.cos(theta), math.sin(theta)
    turn = np.array([[c, -s], [s, c]])
    middle, d = turn @ row[2:4] + np.array([tx, ty]), turn @ row[:2]
    found, least = (-1, 0.0, 0.0, 0.0), math.inf
    for w, wall in enumerate(walls):
        along_wall, normal = wall[:2], np.array([-wall[1], wall[0]])
        offset = normal @ middle - wall[2]
        along = along_wall @ middle
        covered = min(wall[4], along + row[4] / 2) - max(wall[3], along - row[4] / 2)
        overlap = min(1.0, covered / row[4])
        cost = abs(offset) / offset_gate + 1.0 - overlap
        passes = along_wall @ d >= cos_gate and abs(offset) <= offset_gate and overlap >= min_overlap
        if passes and cost < least:
            found, least = (w, offset, d[0] * wall[1] - d[1] * wall[0], overlap), cost
    return found


def match_scan(scan, pose, covariance, walls, gates):
    """Match every segment, gated by its innovation, without stopping early; also sum the gains by overlap."""
    c, s = math.cos(pose[0]), math.sin(pose[0])
    turn = np.array([[c, -s], [s, c]])
    found, total = [], 0.0
    for row in scan:
        middle, d = turn @ row[2:4], turn @ row[:2]
        n = np.array([-d[1], d[0]])
        g = np.array([*n, n @ np.array([-middle[1], middle[0]])])
        offset_gate = min(gates[2], max(gates[1], gates[0] * math.sqrt(row[9] + g @ covariance @ g)))
        angle_gate = min(gates[4], max(gates[3], gates[0] * math.sqrt(row[10] + covariance[2, 2])))
        match = match_segment(row, *pose, offset_gate, 1.0 - 0.5 * angle_gate**2, gates[5], walls)
        found.append(match)
        total += row[12] * match[3]
    return found, total


def placements(scan, a, b, walls, slack, tolerance):
    """List the poses that lay segments a and b within the ends of any two walls, by going through all pairs."""
    poses = []
    for wa in walls:
        for wb in walls:
            gap = math.remainder(wb[5] - wa[5] - scan[b, 5] + scan[a, 5], math.tau)
            crossing = wa[0] * wb[1] - wa[1] * wb[0]
            if abs(gap) > tolerance or abs(crossing) < 0.1:
                continue
            theta = wa[5] - scan[a, 5] + gap * scan[a, 10] / (scan[a, 10] + scan[b, 10])
            turn = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
            normals = np.array([[-wa[1], wa[0]], [-wb[1], wb[0]]])
            middles = [turn @ scan[a, 2:4], turn @ scan[b, 2:4]]
            t = np.linalg.solve(normals, [wa[2] - normals[0] @ middles[0], wb[2] - normals[1] @ middles[1]])
            inside = True
            for wall, middle, row in ((wa, middles[0], scan[a]), (wb, middles[1], scan[b])):
                along = wall[:2] @ (middle + t)
                half = row[4] / 2 - slack(row[4])
                inside = inside and wall[3] <= along - half and along + half <= wall[4]
            if inside:
                poses.append((theta, *t))
    return poses
