"""Laser rangefinder bytes to a trustworthy pose, with the bits that a microcontroller computes.

Scans are numpy arrays with a row for each beam, in the order of measurement: bearing (rad, counter-clockwise from the
lidar's forward axis), range (m; NaN, infinite or at most 0 where there is none) and, for odometry, the time (s).
Poses are x, y (m) and theta (rad, counter-clockwise).
"""

from ._beamfix import (
    Decoded,
    Log,
    Map,
    Match,
    Odometry,
    Refused,
    Step,
    Trajectory,
    __version__,
    decode,
    lidars,
    match,
    read_log,
    read_map,
    replay,
)

__all__ = [
    "Decoded",
    "Log",
    "Map",
    "Match",
    "Odometry",
    "Refused",
    "Step",
    "Trajectory",
    "__version__",
    "decode",
    "lidars",
    "match",
    "read_log",
    "read_map",
    "replay",
]
