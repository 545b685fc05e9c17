"""Checked by mypy --strict: what a user writes has types."""

import numpy as np
from numpy.typing import NDArray

import beamfix


def drive(scans: list[NDArray[np.float64]]) -> NDArray[np.float32]:
    odometry = beamfix.Odometry(directions=360, mount=(0.1, 0.0, 0.0))
    steps = [odometry.update(scan, wheels=(0.01, 0.0, 0.0)) for scan in scans]
    refused: list[str] = [step.refused for step in steps if step.refused is not None]
    print(len(refused), odometry.counters[3])
    return steps[-1].pose


def last(path: str) -> float:
    trajectory = beamfix.replay(path, prior="none")
    return float(trajectory.poses[-1, 2])
