"""Reads a file of MAVLink 2 with pymavlink; prints a line of JSON for each message."""

import json
import math
import sys

from pymavlink.dialects.v20 import common

parser = common.MAVLink(None)
parser.robust_parsing = True
with open(sys.argv[1], "rb") as file:
    for message in parser.parse_buffer(file.read()) or []:
        fields = message.to_dict()
        for key, value in fields.items():
            if isinstance(value, (list, tuple)):
                fields[key] = [None if isinstance(v, float) and math.isnan(v) else v for v in value]
            elif isinstance(value, (bytes, bytearray)):
                fields[key] = list(value)
        fields["sequence"] = message.get_seq()
        print(json.dumps(fields))
