"""`beamfix regress` on a Dask cluster: each recording is a task, the table is the one that a single machine prints.

    python regress_dask.py MANIFEST --beamfix target/release/beamfix                       # two workers on this machine
    python regress_dask.py MANIFEST --beamfix /opt/beamfix --scheduler tcp://head:8786     # a cluster

Every worker needs the program and the recordings at the same paths. Exit status as `beamfix regress`: 0 where all poses are the
baseline's, 1 where some are not or a replay failed.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

from dask.distributed import Client, LocalCluster, as_completed


def regress(program: str, manifest: str, *options: str) -> dict:
    """What `beamfix regress` prints as JSON."""
    with tempfile.TemporaryDirectory() as state:
        command = [program, "regress", manifest, "--json", "--state", state, *options]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
    if not run.stdout:
        raise RuntimeError(run.stderr.strip() or f"{program} ended with status {run.returncode}")
    return json.loads(run.stdout)


def one(program: str, manifest: str, name: str) -> dict:
    """The row of a recording."""
    (row,) = regress(program, manifest, "--only", name, "--jobs", "1")["recordings"]
    return row


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("manifest")
    parser.add_argument("--beamfix", default="beamfix", help="the program")
    parser.add_argument("--scheduler", help="address of a running scheduler; default: a cluster of this machine's own")
    parser.add_argument("--workers", type=int, default=2, help="of this machine's own cluster")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    args = parser.parse_args()
    program = str(pathlib.Path(args.beamfix).resolve()) if "/" in args.beamfix else args.beamfix
    manifest = str(pathlib.Path(args.manifest).resolve())
    names = regress(program, manifest, "--list")["names"]
    own = None if args.scheduler else LocalCluster(n_workers=args.workers, threads_per_worker=1, dashboard_address=None)
    rows = []
    with Client(args.scheduler or own) as client:
        tasks = client.map(one, [program] * len(names), [manifest] * len(names), names, pure=False, retries=1)
        for done, task in enumerate(as_completed(tasks), 1):
            rows.append(task.result())
            print(f"{done} of {len(names)}: {rows[-1]['name']}", file=sys.stderr)
    if own is not None:
        own.close()
    rows.sort(key=lambda row: row["name"])
    changes = [row["change"] for row in rows]
    if args.json:
        print(json.dumps({"recordings": rows}))
    else:
        for row in rows:
            print(f"{row['name']:<40} {row['outcome']['scans']:>7} {row['outcome']['pose_hash']:<16} {row['change']}")
    return int("CHANGED" in changes or "FAILED" in changes)


if __name__ == "__main__":
    sys.exit(main())
