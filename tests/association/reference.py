"""Slow, obviously right twins of the search's kernels."""

import itertools
import math

import numpy as np

from association import _agreement_kernels as agreeing
from association._match_kernels import BRIDGING


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
        if row[4] > BRIDGING:
            covered += bridged(walls, wall, middle, row[4])
        overlap = min(1.0, covered / row[4])
        cost = abs(offset) / offset_gate + 1.0 - overlap
        passes = along_wall @ d >= cos_gate and abs(offset) <= offset_gate and overlap >= min_overlap
        if passes and cost < least:
            found, least = (w, offset, d[0] * wall[1] - d[1] * wall[0], overlap), cost
    return found


def bridged(walls, wall, middle, length):
    """Return what the other walls of the run add, less the gaps up to them."""
    total = 0.0
    for side, sign in ((6, -1.0), (7, 1.0)):
        edge, v = sign * (wall[3 if sign < 0 else 4] - wall[:2] @ middle), int(wall[side])
        while v >= 0:
            begin, end = sorted(sign * (walls[v, 3:5] - walls[v, :2] @ middle))
            if begin >= length / 2:
                break
            total += min(end, length / 2) - begin - (begin - edge)
            edge, v = end, int(walls[v, side])
    return total


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


def scan_rows(directions, midpoints, lengths, centroids, spreads, sigma, points, floors):
    """One segment at a time, the longest first; `floors`: variances of map and common error, two least variances."""
    map_var, common_var, least_offset, least_angle = floors
    order = sorted(range(len(lengths)), key=lambda i: (-lengths[i], i))
    gains = [6.0 + 2.0 * min(length, 4.0) for length in lengths]
    rows = []
    for k, i in enumerate(order):
        line_var = sigma[i] ** 2 / points[i]
        offset_var = max(least_offset, line_var + map_var + 0.02**2)
        angle_var = max(least_angle, (line_var + common_var) / max(1e-6, spreads[i]) + math.radians(0.6) ** 2)
        later = sum(gains[j] for j in order[k + 1 :])
        angle = math.atan2(directions[i][1], directions[i][0])
        rows.append(
            [*directions[i], *midpoints[i], lengths[i], angle, *centroids[i], spreads[i], offset_var, angle_var,
             1.0 / offset_var, gains[i], later, max(1e-8, line_var + map_var), 0.0]
        )  # fmt: skip
    return order, np.array(rows)


def chance_matches(scan, wall_lengths, agreeing, area, gates):
    """Add up the walls that are long enough, for one segment after the other."""
    usable = [sum(length for length in wall_lengths if length >= gates[5] * row[4]) for row in scan]
    return np.clip([2.0 * gates[1] * agreeing * u / area for u in usable], 1e-6, 0.9)


def log_tail(scan, chances, score, exponents):
    """Chernoff's bound at every exponent, and the least of them."""
    moments = [np.prod(1.0 - chances + chances * np.exp(t * scan[:, 12])) for t in exponents]
    return min(math.log(m) - t * score for t, m in zip(exponents, moments, strict=True))


def accept_matches(matches, order, scan_endpoints, pose, walls, pieces_of_wall, endpoints):
    """List (scan index, piece, overlap, other pieces) by scan index; overlaps by counting 1e5 points of a segment."""
    found = []
    for i, wall in sorted((int(order[row]), int(match[0])) for row, match in enumerate(matches) if match[0] >= 0.0):
        d = walls[wall, :2]
        low, high = sorted(pose.apply(scan_endpoints[i].reshape(2, 2)) @ d)
        points = low + (high - low) * (np.arange(100_000) + 0.5) / 100_000
        run = [wall]
        if math.dist(scan_endpoints[i, :2], scan_endpoints[i, 2:]) > BRIDGING:
            while walls[run[0], 6] >= 0:
                run.insert(0, int(walls[run[0], 6]))
            while walls[run[-1], 7] >= 0:
                run.append(int(walls[run[-1], 7]))
        spans = {p: sorted(endpoints[p].reshape(2, 2) @ d) for w in run for p in pieces_of_wall[w]}
        covered = {p: min(last, high) - max(first, low) for p, (first, last) in spans.items()}
        most = max(spans, key=lambda p: (covered[p], -p))
        on_any = np.any([(points >= first) & (points <= last) for first, last in spans.values()], axis=0)
        others = [p for p in spans if p != most and covered[p] > 0.0]
        found.append((i, most, on_any.mean(), others[:8]))
    return found


def agreement(scan, viewpoint, pose, walls):
    """Compare along each ray the first scan segment with the first wall."""
    theta, at = pose[0], np.array(viewpoint)
    turn = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
    place = turn @ at + pose[1:]
    angles = math.tau * (np.arange(agreeing.RAYS) + 0.5) / agreeing.RAYS
    lines = np.zeros((len(scan), 5))
    lines[:, :2] = scan[:, :2]
    lines[:, 2] = scan[:, 0] * scan[:, 3] - scan[:, 1] * scan[:, 2]
    middle = np.einsum("ij,ij->i", scan[:, :2], scan[:, 2:4])
    lines[:, 3], lines[:, 4] = middle - scan[:, 4] / 2, middle + scan[:, 4] / 2
    seen = [first_hit(*at, math.cos(a), math.sin(a), math.inf, lines)[0] for a in angles]
    farthest = max(math.hypot(*(row[2:4] - at)) + row[4] / 2 for row in scan)
    looked = [k for k, d in enumerate(seen) if d < math.inf]
    gaps = [
        ((after - before - 1) % len(seen) + 1, before) for before, after in itertools.pairwise([*looked, looked[0]])
    ]
    widest, before = max(gaps, key=lambda gap: gap[0])
    blind = {(before + k) % len(seen) for k in range(1, widest)} if widest > len(seen) / 4 else set()
    agree = against = 0
    for k, (angle, distance) in enumerate(zip(angles, seen, strict=True)):
        d = np.array([math.cos(angle + theta), math.sin(angle + theta)])
        reach, w = first_hit(*place, *d, max(25.0, 1.5 * farthest), walls)
        if k in blind or w < 0:
            continue
        if distance < math.inf:
            agree += abs(distance - reach) < 0.2 + 0.02 * distance
            against += reach <= distance - 0.2 - 0.02 * distance
        else:
            sine = abs(walls[w][0] * d[1] - walls[w][1] * d[0])
            against += reach < min(farthest, 15.0) and walls[w][4] - walls[w][3] > 0.8 and sine > 0.3
    return agree / (agree + against) if agree + against else agreeing.NEUTRAL


def missing_pieces(scan, matches, viewpoint, pose, walls, pieces_of_wall):
    """Send a ray every quarter of a metre, at most twelve, to each matched segment; two that pass a wall tell."""
    passed = dict.fromkeys(range(len(walls)), 0)
    eye = pose.apply(viewpoint)
    for row, match in zip(scan, matches, strict=True):
        if match[0] < 0.0:
            continue
        rays = min(12, max(1, math.ceil(row[4] / 0.25)))
        for share in (np.arange(rays) + 0.5) / rays - 0.5:
            gap = pose.apply(row[2:4] + share * max(0.0, row[4] - 0.12) * row[:2]) - eye
            distance = math.hypot(*gap)
            if distance > 0.2:
                _, wall = first_hit(*eye, *(gap / distance), distance - 0.2, walls)
                if wall >= 0:
                    passed[wall] += 1
    seen = {int(match[0]) for match in matches}
    return sorted(p for w, count in passed.items() if count >= 2 and w not in seen for p in pieces_of_wall[w])


def distinct(poses, covariances, order, most, rules):
    """Take the best pose, strike what it stands for, and so on."""
    left, kept = list(order), []
    while left and len(kept) < most:
        best = left[0]
        kept.append(best)
        information = np.linalg.inv(covariances[best])
        rest = []
        for i in left[1:]:
            step = np.array([*(poses[i, 1:] - poses[best, 1:]), math.remainder(poses[i, 0] - poses[best, 0], math.tau)])
            near = math.hypot(step[0], step[1]) < rules[0] and abs(step[2]) < rules[1]
            if not near and step @ information @ step >= rules[2]:
                rest.append(i)
        left = rest
    return kept
