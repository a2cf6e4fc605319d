"""Prints the third camera of a run's cameras.json in the layout of `labelgs render --camera`."""
import json, sys

entry = json.load(open(sys.argv[1]))[2]
rotation, position = entry["rotation"], entry["position"]
rows = [[rotation[j][i] for j in range(3)] for i in range(3)]
w2c = [row + [-sum(a * b for a, b in zip(row, position))] for row in rows] + [[0, 0, 0, 1]]
lens = {key: entry[key] for key in ("fx", "fy", "cx", "cy")}
print(json.dumps({"w2c": w2c, **lens, "W": entry["width"], "H": entry["height"]}))
