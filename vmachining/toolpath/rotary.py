"""A path with a leaning tool as an NC program of one machine: rotary words, by its inverse kinematics.

1. `machine.follow` gives the joints of every pose, with the fewest rewinds over the whole path.
2. Under tool centre point control (M128) X, Y, Z are the tip in work coordinates and go straight; the rotary joints are linear,
   and blocks are halved until the axis stays within `angle_deg` of the great circle on which the path was found free.
3. Without it all joints are linear and X, Y, Z are those of the slides; blocks are halved until the tip stays within
   `tolerance_mm` of its straight line too, by the proven bound of `machine.tip_deviation`.

Near the pole of the first rotary axis that axis swings, however short a block is: such blocks are reported.
"""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Bools, Floats
from vmachining.errors import InputError
from vmachining.geometry.rotation import great_circle
from vmachining.machine import Machine, axis_deviation, follow, tip_deviation
from vmachining.toolpath.clpath import CLPath, changed_lines, iso_head, positive, words_of

ROUNDS = 10
"""Halvings of a block: a thousandth of it."""


def rotary_program(
    path: CLPath,
    machine: Machine,
    *,
    feed_mm_min: float,
    spindle_rev_min: float = 6000.0,
    title: str = "",
    tcp: bool = True,
    tolerance_mm: float = 0.005,
    angle_deg: float = 0.1,
) -> tuple[str, tuple[str, ...]]:
    """Program of dialect `iso` with rotary words, and what is to be known of it.

    tcp : tool centre point control; else all joints are linear and X, Y, Z are slides.
    tolerance_mm : of the tip, without tcp. angle_deg : of the axis.
    Raises InputError: A machine without rotary axes, a feed or tolerance that is not positive.
    Raises KinematicsError: A pose out of reach or outside of the travels.
    """
    positive(" of mm/min", feed=feed_mm_min)
    if not machine.rotary:
        raise InputError(f"machine {machine.name} has no rotary axis", remedy="name one such as ac-table")
    positive("", tolerance_mm=tolerance_mm, angle_deg=angle_deg)
    tips, axes, rapid = path.tips, path.axes, path.rapid
    limit = np.radians(angle_deg)
    for _ in range(ROUNDS):
        turned, off = _off(machine, follow(machine, tips, axes, easy=rapid).joints, rapid, tcp=tcp)
        split = (turned > limit) | (off > tolerance_mm)
        if not split.any():
            break
        tips, axes, rapid = _halved(tips, axes, rapid, split)
    found = follow(machine, tips, axes, easy=rapid)
    notes = [
        f"block to point {j.pose}: {j.name} turns by {np.degrees(j.turn):.0f} degrees ({j.kind})"
        for j in found.jumps
        if not rapid[j.pose]
    ]
    turned, off = _off(machine, found.joints, rapid, tcp=tcp)
    if count := int(((turned > limit) | (off > tolerance_mm)).sum()):
        notes.append(
            f"{count} blocks near a pole leave the path, the tip by up to {off.max():.3g} mm, the axis by up to "
            f"{np.degrees(turned.max()):.3g} degrees"
        )
    turning = [machine.names[k] for k in machine.rotary]
    angles = np.degrees(found.joints[:, list(machine.rotary)])
    places = tips if tcp else found.joints[:, list(machine.slides)]
    letters = "XYZ" if tcp else "".join(machine.names[k] for k in machine.slides)
    lines = iso_head(title, 1, spindle_rev_min, f"(MACHINE {machine.name.upper()})")
    lines += ["M128"] if tcp else []
    rows = [
        [*words_of(letters, place), *words_of("".join(turning), angle)]
        for place, angle in zip(places, angles, strict=True)
    ]
    lines += changed_lines(rows, rapid, feed_mm_min)
    lines += (["M129"] if tcp else []) + ["M5", "M2"]
    return "\n".join(lines) + "\n", tuple(notes)


def _off(machine: Machine, joints: Floats, rapid: Bools, *, tcp: bool) -> tuple[Floats, Floats]:
    """(n - 1,) rad of the axis from its great circle, and mm of the tip from its line at most; 0 for rapids."""
    feed = ~rapid[1:]
    turned, off = np.zeros((2, len(feed)))
    start, end = joints[:-1][feed], joints[1:][feed]
    if len(start):
        turned[feed] = axis_deviation(machine, start, end, samples=17).from_circle
        if not tcp:
            off[feed] = tip_deviation(machine, start, end, samples=17).bound
    return turned, off


def _halved(tips: Floats, axes: Floats, rapid: Bools, split: Bools) -> tuple[Floats, Floats, Bools]:
    """Poses halfway in the blocks that are marked (n - 1,)."""
    at = np.flatnonzero(split) + 1
    middle = great_circle(axes[at - 1], axes[at], np.full(len(at), 0.5))
    return (
        np.insert(tips, at, 0.5 * (tips[at - 1] + tips[at]), axis=0), np.insert(axes, at, middle, axis=0),
        np.insert(rapid, at, False),
    )  # fmt: skip
