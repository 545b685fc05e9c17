#!/usr/bin/env bash
# GTSAM's reader of 2-D g2o files loses every edge behind a FIX line or a comment, without a word.
#
# A pose graph's file says which pose is held with a line `FIX 0`, and g2o itself writes it right behind that pose, before
# the other poses and all edges. The guess before running it: readG2o skips a line that it does not know, as it does with
# landmarks (EDGE_SE2_XY) and parameters, and keeps all edges.
# Seen: all poses are read and none of the edges behind the line. No error, no warning. A comment that starts with # does
# the same; a FIX line with two numbers does not, nor does FIX in a 3-D file.
# For who checks SLAM by GTSAM: count the factors against the file's EDGE lines, or take FIX and comments out first.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install --only-binary :all: gtsam==4.3.0 numpy==2.4.6
cd "$folder"
venv/bin/python - <<'PYTHON'
import importlib.metadata
import gtsam

print("gtsam", importlib.metadata.version("gtsam"))
POSES = ["VERTEX_SE2 0 0 0 0", "VERTEX_SE2 1 1 0 1.57", "VERTEX_SE2 2 1 1 3.14"]
EDGES = [f"EDGE_SE2 {a} {b} 1 0 1.57 100 0 0 100 0 400" for a, b in ((0, 1), (1, 2), (2, 0))]
SE3 = [
    "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1",
    "FIX 0",
    "VERTEX_SE3:QUAT 1 1 0 0 0 0 0 1",
    "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1  1 0 0 0 0 0  1 0 0 0 0  1 0 0 0  1 0 0  1 0  1",
]


def read(lines, is_3d=False):
    with open("graph.g2o", "w") as file:
        file.write("\n".join(lines) + "\n")
    factors, poses = gtsam.readG2o("graph.g2o", is_3d)
    return poses.size(), factors.size()


seen = {
    "no FIX": read(POSES + EDGES),
    "FIX behind its pose, as g2o writes it": read(POSES[:1] + ["FIX 0"] + POSES[1:] + EDGES),
    "FIX behind the first edge": read(POSES + EDGES[:1] + ["FIX 0"] + EDGES[1:]),
    "FIX at the end": read(POSES + EDGES + ["FIX 0"]),
    "a comment before the edges": read(POSES + ["# loops"] + EDGES),
    "FIX with two numbers": read(POSES + ["FIX 0 1"] + EDGES),
    "a landmark's edge before them": read(POSES + ["EDGE_SE2_XY 0 7 1 1 1 0 1"] + EDGES),
    "FIX in a 3-D file of one edge": read(SE3, True),
}
for name, (poses, edges) in seen.items():
    print(f"{name:40} {poses} poses, {edges} edges")
expected = [(3, 3), (3, 0), (3, 1), (3, 3), (3, 0), (3, 3), (3, 3), (2, 1)]
raise SystemExit(0 if list(seen.values()) == expected else "it behaves otherwise now")
PYTHON
