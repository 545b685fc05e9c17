#!/usr/bin/env bash
# PyYAML takes numbers with an exponent for text where they lack a point or the exponent's sign.
#
# A map's YAML file may hold its origin as C++ and JSON write small numbers: [1e-05, -1e-3, 0]. yaml-cpp, which nav2's
# map_server uses, reads numbers. The guess before running it: PyYAML reads them as well, for YAML 1.2 calls both floats.
# Seen: text. It follows YAML 1.1, where a float needs a point and its exponent a sign: a Python tool that adds to such an
# origin fails, or joins strings. What we do: `field` and `replay --map` read them as numbers, in quotes too.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" -q install pyyaml==6.0.3
"$folder/venv/bin/python" - <<'PYTHON'
import yaml

print("PyYAML", yaml.__version__)
text = "origin: [1e-05, -1e-3, 1.5e3, 1.0e-05, 1.5e+3]"
origin = yaml.safe_load(text)["origin"]
print(text, "->", origin)
expected = ["1e-05", "-1e-3", "1.5e3", 1e-05, 1500.0]
raise SystemExit(0 if origin == expected else "it behaves otherwise now")
PYTHON
