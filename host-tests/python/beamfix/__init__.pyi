from os import PathLike
from typing import Literal, final

import numpy as np
from numpy.typing import NDArray

__version__: str

Pose = tuple[float, float, float]
Order = Literal["reversed", "in-order", "at-once"]

class Refused(ValueError):
    """A match that was refused: too few beams, an ambiguous or degenerate scene, no convergence."""

@final
class Decoded:
    """What was in the bytes of a lidar. Each array has an element for each measurement."""

    lidar: str
    packets: int
    check_errors: int
    skipped_bytes: int
    scan: NDArray[np.uint32]
    time: NDArray[np.float64]
    angle_deg: NDArray[np.float32]
    bearing: NDArray[np.float32]
    range: NDArray[np.float32]
    quality: NDArray[np.uint16]
    def __len__(self) -> int: ...

@final
class Match:
    """A pose found by matching two scans, and how far it can be trusted."""

    pose: NDArray[np.float32]
    covariance: NDArray[np.float32]
    score: float
    residual: float
    inliers: int
    overlap: int
    beams: int
    iterations: int
    degenerate_direction: tuple[float, float, float] | None
    lever: float | None

@final
class Step:
    """What a scan told about the robot."""

    pose: NDArray[np.float32]
    covariance: NDArray[np.float32]
    match: Match | None
    refused: str | None
    keyframe: bool

@final
class Odometry:
    """Lidar odometry: a pose for every scan."""

    def __new__(
        cls, directions: int = 360, mount: Pose = (0.0, 0.0, 0.0), upside_down: bool = False
    ) -> Odometry: ...
    def update(
        self, scan: NDArray[np.float64], wheels: Pose | None = None, rotation: float | None = None
    ) -> Step: ...
    @property
    def pose_hash(self) -> str: ...
    @property
    def counters(self) -> tuple[int, int, int, int]: ...

@final
class Log:
    """A recorded log."""

    def __len__(self) -> int: ...
    @property
    def source(self) -> str: ...
    def beams(self, scan: int) -> NDArray[np.float64]: ...
    def time(self, scan: int) -> float: ...
    def wheels(self, scan: int) -> Pose | None: ...

@final
class Trajectory:
    """A pose for every scan of a log."""

    times: NDArray[np.float64]
    poses: NDArray[np.float32]
    measured: NDArray[np.bool_]
    pose_hash: str
    keyframes: int
    lost: int
    source: str
    def __len__(self) -> int: ...

@final
class Map:
    """An occupancy grid: 0 free, 100 occupied, -1 unknown, rows from the lowest y up."""

    cells: NDArray[np.int8]
    resolution: float
    origin: Pose
    remarks: list[str]

def lidars() -> list[str]: ...
def decode(data: bytes, lidar: str = "auto") -> Decoded: ...
def match(
    reference: NDArray[np.float64],
    scan: NDArray[np.float64],
    guess: Pose = (0.0, 0.0, 0.0),
    mode: Literal["local", "global"] = "local",
) -> Match: ...
def read_log(
    path: str | PathLike[str],
    *,
    lidar: str | None = None,
    order: Order | None = None,
    scan_topic: str | None = None,
    odom_topic: str | None = None,
) -> Log: ...
def replay(
    path: str | PathLike[str],
    *,
    lidar: str | None = None,
    order: Order | None = None,
    scan_topic: str | None = None,
    odom_topic: str | None = None,
    mount: Pose | None = None,
    upside_down: bool = False,
    prior: Literal["odometry", "none"] = "odometry",
    map: str | PathLike[str] | None = None,
    start: Pose | None = None,
    scans: int | None = None,
) -> Trajectory: ...
def read_map(path: str | PathLike[str]) -> Map: ...
