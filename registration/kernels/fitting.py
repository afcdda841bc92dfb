"""Both estimators and their diagnostics: from weighted pairs to a fit in one call.

There are two frames besides the caller's, or digits would be lost: the *local* one is the map's, about the middle of
the map segments, and the *centred* one is the scan's, about the middle of the scan segments.
"""

from __future__ import annotations

import math

import numpy as np

from compiled import kernel

from ..layout import INFORMATION, PAIR, Floats, Record, Records
from .joint import joint_information, joint_solve, joint_sums_compensated
from .matrices import carried, invert3_scaled, sandwich
from .observability import FIXED, FREE, PARALLEL, freedom
from .one_step import (
    determinant_and_reliability,
    one_step_costs,
    one_step_solve,
    one_step_sums,
    translation_cost,
    wahba_angle,
)
from .orientation import choose_rotation, turn_against
from .pairs import angle_chi_square, middles, move_origins, residuals
from .records import keep_alive


@kernel
def fit(
    pairs: Records, used: Floats, information: Floats, noise: Floats, how: Records, fitted: Records
) -> tuple[Floats, Floats]:
    """Fit a rigid transform to pairs, or take one that is given, and write what there is to say of it to `fitted`.

    Parameters
    ----------
    pairs : (n,) PAIR
        In the caller's frames; one of them counts at least.
    used, information, noise : (n,)
        The weights of the estimator; 1 / variance of chi2 and the covariance; 1 / variance by the sigmas,
        (0,) if a pair has none. Pairs that do not count have 0 in each.
    how : (1,) FITTING
    fitted : (1,) FITTED

    Returns
    -------
    Offsets at the midpoints, metres, and angles, radians, (n,) each.
    """
    out = fitted[0]
    map_x, map_y, scan_x, scan_y, out.count = middles(pairs, used)
    local = np.empty(len(pairs), PAIR)
    centred = np.empty(len(pairs), PAIR)
    move_origins(pairs, map_x, map_y, 0.0, 0.0, local)
    move_origins(local, 0.0, 0.0, scan_x, scan_y, centred)
    out.unique = 1
    if not how[0].oriented:
        judged = noise if len(noise) > 0 else used
        theta, unique = choose_rotation(centred, judged, len(noise) > 0)
        turn_against(centred, local, theta)
        out.unique = unique
    reference = wahba_angle(local, used)
    sums = joint_sums_compensated(centred, used)
    theta, moves = transform(local, sums, used, reference, how[0], (map_x, map_y, scan_x, scan_y), out)
    find_free(centred, sums, noise, theta, how[0].parallel, out)
    pose = out.pose
    between = out.between
    if moves and (out.free == FREE or out.free == PARALLEL):
        # Of those that fit the one receives whose translation in the caller's frames is shortest that way.
        back = out.free_x * (map_x + pose.x) + out.free_y * (map_y + pose.y)
        back = -min(out.slack, max(-out.slack, back))
        pose.x += back * out.free_x
        pose.y += back * out.free_y
        between.x += back * out.free_x
        between.y += back * out.free_y
    if how[0].covariance and out.free == FIXED and out.unique:
        covariance(centred, sums, used, information, how[0].informed != 0, out)
        c = math.cos(theta)
        s = math.sin(theta)
        # From the middle of the scan segments to the origin of the scan frame.
        carried(out.covariance, c * scan_x - s * scan_y, s * scan_x + c * scan_y, out.covariance)
    keep_alive(sums)
    measure(local, used, reference, how[0], (map_x, map_y), out)
    offsets, angles, out.chi2, out.rms_offset, out.rms_angle, against = residuals(
        centred, used, information, theta, between.x, between.y
    )
    out.against = against
    pose.x += map_x
    pose.y += map_y
    keep_alive(local)
    return offsets, angles


@kernel
def transform(
    local: Records,
    sums: Records,
    used: Floats,
    reference: float,
    how: Record,
    middle: tuple[float, float, float, float],
    out: Record,
) -> tuple[float, bool]:
    """Write the transforms local from scan to ``pose`` and local from centred to ``between``.

    `sums` (2,) are the joint ones of the centred pairs; `reference` is Wahba's angle, radians; `middle` is that of the
    map segments and that of the scan segments. Returns the rotation, and whether the translation may be moved where it
    is free: it may not where it is given, nor where the paper has an answer.
    """
    map_x, map_y, scan_x, scan_y = middle
    pose = out.pose
    between = out.between
    moves = False
    if how.given:
        pose.theta = how.at.theta
        pose.x = how.at.x - map_x
        pose.y = how.at.y - map_y
    elif how.one_step:
        moves = not paper_transform(local, used, reference, how.wahba != 0, pose)
    else:
        start = paper_angle(local, used, reference, how.wahba != 0)
        theta, between.x, between.y, _, _ = joint_solve(sums[0], start, False)
        pose.theta = theta
        pose.x = between.x - math.cos(theta) * scan_x + math.sin(theta) * scan_y
        pose.y = between.y - math.sin(theta) * scan_x - math.cos(theta) * scan_y
        return theta, True
    between.x = pose.x + math.cos(pose.theta) * scan_x - math.sin(pose.theta) * scan_y
    between.y = pose.y + math.sin(pose.theta) * scan_x + math.cos(pose.theta) * scan_y
    return pose.theta, moves


@kernel
def paper_angle(local: Records, used: Floats, reference: float, wahba: bool) -> float:
    """Return the paper's rotation, radians, Wahba's or Mitsuta's; angles wrap opposite to `reference`."""
    sums = one_step_sums(local, 0.0, 0.0, reference, used)
    angle = one_step_solve(sums[0], wahba)[0]
    keep_alive(sums)
    return reference + angle


@kernel
def paper_transform(local: Records, used: Floats, reference: float, wahba: bool, pose: Record) -> bool:
    """Write the paper's transform, local from scan, to `pose`; return whether the lines fix its translation.

    It is fitted in the caller's scan frame, on whose origin the translation depends. Moving the map's origin moves it
    along and no more. A second pass about the first answer takes out what the first lost to rounding.
    """
    pose.theta = paper_angle(local, used, reference, wahba)
    pose.x = 0.0
    pose.y = 0.0
    observable = False
    for _ in range(2):
        sums = one_step_sums(local, pose.x, pose.y, reference, used)
        _, x, y, observable = one_step_solve(sums[0], wahba)
        keep_alive(sums)
        pose.x += x
        pose.y += y
    return observable


@kernel
def find_free(centred: Records, sums: Records, noise: Floats, theta: float, parallel: float, out: Record) -> None:
    """Write what the pairs leave free; `parallel` is the chi-square of their angles up to which lines are parallel.

    That is a question of noise, and not of how a caller weighs.
    """
    noisy = len(noise) > 0
    of_noise = joint_sums_compensated(centred, noise) if noisy else sums
    along = False
    if noisy:
        unlike, _ = angle_chi_square(centred, noise)
        along = unlike <= parallel
    out.free, x, y, out.slack = freedom(sums, of_noise, theta, noisy, along)
    # Of two opposite unit vectors the one that points right, or straight up.
    sign = -1.0 if x <= 1e-12 and y < 0.0 else 1.0
    out.free_x = sign * x
    out.free_y = sign * y


@kernel
def covariance(centred: Records, sums: Records, used: Floats, information: Floats, informed: bool, out: Record) -> None:
    """Write the covariance of additive (x, y, theta) of the centred scan in the map frame.

    The inverse of the information matrix ``F`` when the weights are the information; else, for pairs weighted ``w`` of
    information ``i``, ``F(w)^-1 F(w^2 / i) F(w)^-1``.
    """
    joint_information(sums[0], out.pose.theta, out.covariance)
    invert3_scaled(out.covariance, out.covariance)
    if informed:
        return
    weights = np.zeros(len(used), np.float64)
    for i in range(len(used)):
        if used[i] > 0.0:
            weights[i] = used[i] * used[i] / information[i]
    scatter_sums = joint_sums_compensated(centred, weights)
    scatter = np.empty(1, INFORMATION)
    joint_information(scatter_sums[0], out.pose.theta, scatter[0])
    keep_alive(scatter_sums)
    sandwich(out.covariance, scatter[0], out.covariance)
    keep_alive(scatter)


@kernel
def measure(
    local: Records, used: Floats, reference: float, how: Record, middle: tuple[float, float], out: Record
) -> None:
    """Write the paper's measures at the transform that was found, at T = 0, and where else they are asked."""
    pose = out.pose
    map_x, map_y = middle
    wahba = how.wahba != 0
    sums = one_step_sums(local, pose.x, pose.y, reference, used)
    out.translation = translation_cost(local, used, pose.x, pose.y)
    out.rotation = rotation_cost(sums, pose.theta - reference, wahba)
    out.translation_before = translation_cost(local, used, -map_x, -map_y)
    out.rotation_before = rotation_cost(sums, 0.0 - reference, wahba)
    if how.elsewhere:
        out.translation_elsewhere = translation_cost(local, used, how.other.x - map_x, how.other.y - map_y)
        out.rotation_elsewhere = rotation_cost(sums, how.other.theta - reference, wahba)
    out.determinant, out.reliability = determinant_and_reliability(sums[0])
    keep_alive(sums)


@kernel
def rotation_cost(sums: Records, turn: float, wahba: bool) -> float:
    """Return the paper's cost of a rotation by `turn` from the reference of its sums, radians, by one of its ways."""
    wrapped = turn - 2.0 * math.pi * math.ceil(turn / (2.0 * math.pi) - 0.5)
    _, mitsuta, by_wahba = one_step_costs(sums, 0.0, 0.0, wrapped)
    return by_wahba if wahba else mitsuta
