"""compare.py NAME A B: the largest differences of values of two models; those beyond the steps of the format NAME are failures."""
import math, struct, sys
name, paths = sys.argv[1], sys.argv[2:]
def read(path):
    with open(path, "rb") as file:
        columns, rows = [], 0
        while (line := file.readline().decode().split()) != ["end_header"]:
            if line[:2] == ["element", "vertex"]: rows = int(line[2])
            elif line[0] == "property": columns.append((line[2], {"float": "f", "double": "d", "uchar": "B", "uint": "I"}[line[1]]))
        data = list(struct.iter_unpack("<" + "".join(kind for _, kind in columns), file.read()))
    assert rows == len(data), f"{path}: {rows} rows promised, {len(data)} are there"
    return [name for name, _ in columns], data
(names, a), (others, b) = map(read, paths)
sigmoid = lambda v: 1 / (1 + math.exp(-max(-80, min(80, v))))
def row(names, values):
    at = dict(zip(names, values))
    length = math.hypot(*[at[f"rot_{k}"] for k in range(4)])
    return {"position": [at[k] for k in "xyz"], "rotation": [at[f"rot_{k}"] / length for k in range(4)],
            "scale": [at[f"scale_{k}"] for k in range(3)], "opacity": [sigmoid(at["opacity"])],
            "colour": [at[f"f_dc_{k}"] for k in range(3)],
            "harmonics": [at[k] for k in sorted(at) if k.startswith("f_rest_")], "label": [at[k] for k in ["label"] if k in at]}
a, b = [row(names, v) for v in a], [row(others, v) for v in b]
# Largest difference of each value; None where a format clusters values and has no bound.
spz = dict(position=1.01 / 8192, rotation=0.0022, scale=1.01 / 32, opacity=1.5 / 255, colour=1.01 / 76.5, harmonics=8.51 / 128)
BOUNDS = {"same": {key: 1e-5 for key in spz}, "spz": spz, "sog": dict(position=2e-3, rotation=0.012, scale=None, opacity=1.5 / 255, colour=None, harmonics=None),
          "packed": dict(position=None, rotation=0.0022, scale=None, opacity=1.01 / 255, colour=None, harmonics=1.01 / 64),
          "glb": dict(position=0, rotation=1e-6, scale=1e-5, opacity=1e-6, colour=0, harmonics=0)}
BOUNDS["usd"] = BOUNDS["glb"]
bounds, worst, bad = BOUNDS[name.replace(",", " ").split()[0]], {}, []
if len(a) != len(b): bad.append(f"{len(a)} and {len(b)} Gaussians")
for one in a:
    other = min(b, key=lambda other: sum((p - q) ** 2 for p, q in zip(one["position"], other["position"])))
    for key, most in bounds.items():
        values = other[key]
        if key == "harmonics":  # Values beyond the range are cut off.
            clip = (lambda v: max(-1, min(0.9921875, v))) if name.startswith("spz") else (lambda v: max(-4, min(4, v)))
            pairs = list(zip(map(clip, one[key]), map(clip, values)))
        elif key == "rotation":  # Both signs, and half turns about its own axes, are the same Gaussian.
            w, x, y, z = values
            same = [[s * v for v in b] for s in (1, -1) for b in ([w, x, y, z], [-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w])]
            pairs = min((list(zip(one[key], b)) for b in same), key=lambda pairs: max(abs(p - q) for p, q in pairs))
        else: pairs = list(zip(one[key], values))
        worst[key] = max([worst.get(key, 0)] + [abs(p - q) for p, q in pairs])
bad += [f"{key} off by {worst[key]:.5g}, at most {most:.5g}" for key, most in bounds.items() if most is not None and worst[key] > most]
shown = ", ".join(f"{key} {value:.2g}" for key, value in worst.items())
print(f"{name:<44} {len(b):>6} Gaussians, off by: {shown}; {'; '.join(bad) or 'passed'}")
sys.exit(bool(bad))
