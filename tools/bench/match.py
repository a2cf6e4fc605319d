#!/usr/bin/env python3
"""Which label of a model is which object.

    tools/bench/match.py MODEL.ply TRUE.ply          OLD=NEW,.. for `labelgs relabel --map`
    tools/bench/match.py --iou MODEL.ply TRUE.ply    mean IoU of the pairs, by Gaussians

Both are one model: with the labels that were found, and with those of true masks (`labelgs label --masks`). Labels and objects are
paired by their Gaussians, the best IoU first. Labels that are no object's get ids from 1000 on.
"""
import collections
import struct
import sys

KINDS = {"float": "f", "double": "d", "uchar": "B", "ushort": "H", "uint": "I"}


def labels(path):
    with open(path, "rb") as file:
        columns = []
        while (line := file.readline().decode().split()) != ["end_header"]:
            if line[0] == "property":
                columns.append((line[2], KINDS[line[1]]))
        at = [name for name, _ in columns].index("label")
        return [int(row[at]) for row in struct.iter_unpack("<" + "".join(kind for _, kind in columns), file.read())]


found, true = (labels(path) for path in sys.argv[-2:])
pairs = collections.Counter(zip(found, true, strict=True))
sizes, areas = collections.Counter(found), collections.Counter(true)
ratio = {(a, b): n / (sizes[a] + areas[b] - n) for (a, b), n in pairs.items() if a and b}
paired = {}
for a, b in sorted(ratio, key=ratio.get, reverse=True):
    if a not in paired and b not in paired.values():
        paired[a] = b
if sys.argv[1] == "--iou":
    print(f"{sum(ratio[pair] for pair in paired.items()) / max(len(paired), 1):.3f}")
    sys.exit()
rest = (label for label in sorted(sizes) if label and label not in paired)
paired.update({label: 1000 + number for number, label in enumerate(rest)})
print(",".join(f"{old}={new}" for old, new in sorted(paired.items())))
