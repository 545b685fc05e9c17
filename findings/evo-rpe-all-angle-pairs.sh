#!/usr/bin/env bash
# evo's error per angle pairs headings whole turns apart when it takes all pairs.
#
# evo_rpe --delta 90 --delta_unit d --all_pairs asks for the error over each quarter turn. The guess before running it:
# pairs of poses between which the robot has turned by 90 degrees, as without --all_pairs.
# Seen: pairs whose headings differ by 90 degrees, however far the robot has turned between them: 90, 270, 450 and so on, to
# the end of the recording. A gyroscope with 1 % of scale error, spinning for 10 turns, has 0.9 degrees per quarter turn
# without the option and 12 on average with it, and the longer the recording, the more.
# For who measures heading per turn: leave --all_pairs out for angles, or cut the recording into turns first.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install --only-binary :all: evo==1.38.1 numpy==2.4.6
cd "$folder"
export HOME="$folder" MPLBACKEND=agg
venv/bin/python - <<'PYTHON'
import importlib.metadata
import numpy as np
from evo.core import metrics, trajectory
from evo.core.units import Unit

print("evo", importlib.metadata.version("evo"))


def spin(turns, scale=1.0, step=5.0):
    half = np.radians(np.arange(0, turns * 360, step) * scale) / 2
    none = np.zeros(len(half))
    return trajectory.PoseTrajectory3D(np.zeros((len(half), 3)), np.c_[np.cos(half), none, none, np.sin(half)], np.arange(len(half)) / 10)


def rpe(turns, all_pairs):
    metric = metrics.RPE(metrics.PoseRelation.rotation_angle_deg, delta=90, delta_unit=Unit.degrees, all_pairs=all_pairs, pairs_from_reference=True)
    metric.process_data((spin(turns), spin(turns, 1.01)))
    return len(metric.error), float(np.mean(metric.error)), float(np.max(metric.error))


seen = {}
for turns in (3, 10):
    for all_pairs in (False, True):
        seen[turns, all_pairs] = rpe(turns, all_pairs)
        number, mean, largest = seen[turns, all_pairs]
        print(f"{turns:2} turns, all pairs {all_pairs!s:5}: {number:5} pairs, mean {mean:5.2f} deg, largest {largest:5.2f} deg")
right = all(seen[turns, False][2] < 1.0 for turns in (3, 10))
right &= seen[3, True][1] > 2 and seen[10, True][1] > 2 * seen[3, True][1]
raise SystemExit(0 if right else "it behaves otherwise now")
PYTHON
