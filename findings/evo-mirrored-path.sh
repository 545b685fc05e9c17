#!/usr/bin/env bash
# evo's alignment forgives a mirrored path: a clockwise lidar read as a counter-clockwise one scores an error of 0.
#
# A lidar whose sense of rotation is taken wrong gives the mirror image of the truth as map and path. The guess before
# running it: evo_ape --align shows it as a large error, for the alignment is a rotation and a shift, never a reflection.
# Seen: 0.000 m. The rotation is one in space, and in a flat world half a turn about a horizontal axis is the mirror image.
# --correct_scale and --project_to_plane xy do not help. Without alignment, with --align_origin, or compared by angle (-r
# angle_deg: 180 degrees everywhere) the fault is there.
# For who scores a lidar's odometry: look at the alignment's rotation (-v), compare angles too, or align in the plane.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install --only-binary :all: evo==1.38.1 numpy==2.4.6
cd "$folder"
export HOME="$folder" MPLBACKEND=agg
venv/bin/python - <<'PYTHON'
import importlib.metadata
import math
from evo.core.metrics import PoseRelation
from evo.core.trajectory import Plane
from evo.main_ape import ape
from evo.tools import file_interface

print("evo", importlib.metadata.version("evo"))
with open("truth.tum", "w") as truth, open("mirrored.tum", "w") as mirrored:
    x = y = heading = 0.0
    for step in range(200):
        for file, sign in ((truth, 1), (mirrored, -1)):
            half = sign * heading / 2
            file.write(f"{step / 10} {x} {sign * y} 0 0 0 {math.sin(half)} {math.cos(half)}\n")
        heading += 0.05 * math.sin(step / 15) + 0.02
        x, y = x + 0.1 * math.cos(heading), y + 0.1 * math.sin(heading)


def rmse(relation=PoseRelation.translation_part, **options):
    paths = [file_interface.read_tum_trajectory_file(f"{name}.tum") for name in ("truth", "mirrored")]
    return ape(*paths, pose_relation=relation, **options).stats["rmse"]


cases = {
    "no alignment": (rmse(), False),
    "--align": (rmse(align=True), True),
    "--align --correct_scale": (rmse(align=True, correct_scale=True), True),
    "--align --project_to_plane xy": (rmse(align=True, project_to_plane=Plane.XY), True),
    "--align_origin": (rmse(align_origin=True), False),
    "--align -r angle_deg": (rmse(PoseRelation.rotation_angle_deg, align=True), False),
}
for name, (value, _) in cases.items():
    print(f"evo_ape {name:30} rmse {value:.6f}")
right = all((value < 1e-6) == forgiven and (forgiven or value > 1) for value, forgiven in cases.values())
raise SystemExit(0 if right else "it behaves otherwise now")
PYTHON
