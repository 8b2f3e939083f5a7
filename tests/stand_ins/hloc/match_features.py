"""Stands in for hloc.match_features where hloc is not installed: reads the list of pairs as hloc does."""

import argparse
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
import checks  # noqa: E402  pylint: disable=wrong-import-position

parser = argparse.ArgumentParser(prog="hloc.match_features", allow_abbrev=False)
parser.add_argument("--pairs", required=True, type=pathlib.Path)
parser.add_argument("--export_dir", required=True, type=pathlib.Path)
parser.add_argument("--features", default="feats-superpoint-n4096-r1024")
parser.add_argument("--matches", type=pathlib.Path)
parser.add_argument("--conf", default="superglue")
options = parser.parse_args()

pairs = set()
for number, line in enumerate(options.pairs.read_text().rstrip("\n").split("\n"), 1):
    names = line.split()
    if len(names) != 2:
        checks.refuse(f"line {number} of {options.pairs} is not two names: {line}")
    if names[0] == names[1]:
        checks.refuse(f"line {number} of {options.pairs} pairs an image with itself")
    if frozenset(names) in pairs:
        checks.refuse(f"line {number} of {options.pairs} comes twice: {line}")
    pairs.add(frozenset(names))
print(f"stand-in for hloc.match_features: {len(pairs)} pairs")
