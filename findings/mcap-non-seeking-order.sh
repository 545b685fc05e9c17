#!/usr/bin/env bash
# mcap (Python 1.6.0): NonSeekingReader gives no message before it has read the whole stream, unless log_time_order=False.
#
# A robot that loses power leaves an MCAP recording without its end, and a live one has none yet. For such streams the
# package has NonSeekingReader. The guess before running it: it gives the messages one after the other as they come, and an
# error at the end of what there is.
# Seen: iter_messages() sorts by log time by default, in memory, and so reads everything first. Of a recording that stops in
# the middle the default gives none of the messages but an error; log_time_order=False gives all that came before.
# For our users: `replay` keeps what came before a cut and says so; a script that looks at the same file with this package
# needs log_time_order=False, or sees an empty recording.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install mcap==1.6.0
"$folder/venv/bin/python" - "$folder/scans.mcap" <<'PYTHON'
import io
import sys
from importlib.metadata import version

from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, Writer

print("mcap", version("mcap"))
with open(sys.argv[1], "wb") as file:
    # Chunks as small as a recorder's that flushes once a second.
    writer = Writer(file, chunk_size=4000, compression=CompressionType.NONE)
    writer.start()
    channel = writer.register_channel(topic="/scan", message_encoding="raw", schema_id=0)
    for k in range(100):
        writer.add_message(channel, log_time=k * 10**8, publish_time=k * 10**8, data=bytes(1440))
    writer.finish()
whole = open(sys.argv[1], "rb").read()


class Counted(io.BytesIO):
    taken = 0

    def read(self, size=-1):
        data = super().read(size)
        self.taken += len(data)
        return data


def first_comes_after(order):
    """Share of a whole, valid stream that is read before the first message comes."""
    stream = Counted(whole)
    next(iter(NonSeekingReader(stream).iter_messages(log_time_order=order)))
    return stream.taken / len(whole)


def kept_of_half(order):
    """Messages of the first half of the stream, and the error that ends them."""
    count, error = 0, None
    try:
        for _ in NonSeekingReader(io.BytesIO(whole[: len(whole) // 2])).iter_messages(log_time_order=order):
            count += 1
    except Exception as problem:
        error = type(problem).__name__
    return count, error


for order in (True, False):
    share, kept = first_comes_after(order), kept_of_half(order)
    print(f"log_time_order={order}: first message after {100 * share:.0f} % of the stream; of its first half {kept}")
    held = share > 0.9 and kept[0] == 0 and kept[1] if order else share < 0.1 and 40 <= kept[0] <= 55
    if not held:
        raise SystemExit("it behaves otherwise now")
PYTHON
