#!/usr/bin/env bash
# mcap's Python reader forgets `reverse=True` where a file has no chunk index.
#
# iter_messages(reverse=True) gives a recording from its end: the usual way to the last pose or the last map. The guess
# before running it: it holds for each file, if need be by sorting in memory, as log_time_order does for files without
# chunks.
# Seen: a file without chunks (use_chunking=False) or without a chunk index is sorted, but from the start: the first message
# comes first, without a word, so the "last" pose is the first one.
# For who takes the last message of a recording: take the one with the largest log_time.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install --only-binary :all: mcap==1.6.0
"$folder/venv/bin/python" - <<'PYTHON'
import importlib.metadata
import io
from mcap.reader import make_reader
from mcap.writer import IndexType, Writer

print("mcap", importlib.metadata.version("mcap"))


def times(reverse, **options):
    file = io.BytesIO()
    writer = Writer(file, **options)
    writer.start()
    channel = writer.register_channel("/pose", "json", 0)
    for time in (30, 10, 20):
        writer.add_message(channel, time, b"{}", time)
    writer.finish()
    file.seek(0)
    return [message.log_time for _, _, message in make_reader(file).iter_messages(reverse=reverse)]


seen = {}
for name, options in {"chunks": {}, "no chunks": {"use_chunking": False}, "no chunk index": {"index_types": IndexType.NONE}}.items():
    seen[name] = times(False, **options), times(True, **options)
    print(f"{name:15} forwards {seen[name][0]}, reverse=True {seen[name][1]}")
up, down = [10, 20, 30], [30, 20, 10]
right = seen == {"chunks": (up, down), "no chunks": (up, up), "no chunk index": (up, up)}
raise SystemExit(0 if right else "it behaves otherwise now")
PYTHON
