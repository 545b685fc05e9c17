#!/usr/bin/env bash
# evo counts the metres of "error per metre" along the estimate: a pose that trembles on the spot drives metres.
#
# evo_rpe --delta 1 --delta_unit m takes pairs of poses a metre of path apart. The guess before running it: a metre of the
# reference's path, as KITTI's odometry score has it.
# Seen: a metre of the estimate's. A robot that stands for 40 s with 2 cm of noise on its pose "drives" 13 m, each counted
# at 4 cm per metre; noise makes more pairs of the same drive, and an estimate that is 10 % long gets shorter pairs than one
# that is 10 % short. Angles (--delta_unit d) likewise. --pairs_from_reference counts along the reference.
# For who compares matchers: pass --pairs_from_reference, or two estimates of one drive are scored over other pieces of it.
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
from evo.core import filters, metrics, trajectory
from evo.core.units import Unit

print("evo", importlib.metadata.version("evo"))


def path(x, y=None):
    places = np.c_[x, np.zeros(len(x)) if y is None else y, np.zeros(len(x))]
    return trajectory.PoseTrajectory3D(places, np.tile([1.0, 0, 0, 0], (len(x), 1)), np.arange(len(x)) / 10)


def pairs(reference, estimate, **options):
    rpe = metrics.RPE(metrics.PoseRelation.translation_part, delta=1, delta_unit=Unit.meters, **options)
    try:
        rpe.process_data((reference, estimate))
    except filters.FilterException:
        return 0, float("nan")
    return len(rpe.error), float(np.mean(rpe.error))


random = np.random.default_rng(1)
standing = path(np.zeros(400))
trembling = path(*random.normal(0, 0.02, (2, 400)))
drive = path(np.arange(1, 401) * 0.05)
cases = {
    "standing for 40 s, 2 cm of noise": (standing, trembling),
    "20 m, exact": (drive, drive),
    "20 m, 1 cm of noise": (drive, path(np.arange(1, 401) * 0.05 + random.normal(0, 0.01, 400), random.normal(0, 0.01, 400))),
    "20 m, 10 % long": (drive, path(np.arange(1, 401) * 0.055)),
    "20 m, 10 % short": (drive, path(np.arange(1, 401) * 0.045)),
}
seen = {}
for name, (reference, estimate) in cases.items():
    seen[name] = pairs(reference, estimate)[0], pairs(reference, estimate, pairs_from_reference=True)[0]
    print(f"{name:34} {seen[name][0]:3} pairs ({pairs(reference, estimate)[1]:.3f} m), along the reference {seen[name][1]:3}")
by_estimate = [along for along, _ in seen.values()]
by_reference = [along for _, along in seen.values()]
right = by_reference[0] == 0 and len(set(by_reference[1:])) == 1
right &= by_estimate[0] >= 10 and by_estimate[2] > by_estimate[1] and by_estimate[3] > by_estimate[4]
raise SystemExit(0 if right else "it behaves otherwise now")
PYTHON
