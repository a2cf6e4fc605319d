"""usd.py FILE MODEL.ply: opens a stage of labelgs in OpenUSD (usd-core) and compares it with the model: the schema of each prim and the
types of its attributes, values, boxes, labels, and OpenUSD's own rules, those of packages too."""
import math, struct, sys
from pxr import Gf, Usd, UsdGeom, UsdSemantics, UsdValidation
path, ply = sys.argv[1:]
with open(ply, "rb") as file:
    names = []
    while (line := file.readline().decode().split()) != ["end_header"]:
        if line[0] == "property": names.append(line[2])
    rows = [dict(zip(names, row)) for row in struct.iter_unpack(f"<{len(names)}f", file.read())]
bad, counted, worst = [], 0, {}
def check(holds, what):
    if not holds: bad.append(what)
stage = Usd.Stage.Open(path)
check(UsdGeom.GetStageUpAxis(stage) == "Y" and UsdGeom.GetStageMetersPerUnit(stage) == 1, "axis or unit")
root = stage.GetDefaultPrim()
check(root and root.IsA(UsdGeom.Xform), "no default prim")
schema = Usd.SchemaRegistry().FindConcretePrimDefinition("ParticleField3DGaussianSplat")
if not schema: sys.exit(f"this OpenUSD {Usd.GetVersion()} lacks the schema; it needs 26.03")
place = {(row["x"], -row["y"], -row["z"]): row for row in rows}
# The degrees whose functions change sign with y and z, as those of the files do.
signs = [1, -1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1]
def off(key, a, b): worst[key] = max([worst.get(key, 0)] + [abs(p - q) for p, q in zip(a, b, strict=True)])
for prim in Usd.PrimRange(root):
    if prim == root: continue
    check(prim.GetTypeName() == "ParticleField3DGaussianSplat", f"{prim.GetPath()} is a {prim.GetTypeName()}")
    for name in prim.GetAuthoredPropertyNames():
        spec, own = schema.GetSchemaAttributeSpec(name), prim.GetAttribute(name)
        if spec: check(spec.typeName == own.GetTypeName() and spec.variability == own.GetVariability(), f"type of {name}")
        else: check(name.split(":")[0] in ("labelgs", "semantics"), f"{name} is not in the schema")
    get = lambda name: prim.GetAttribute(name).Get()
    positions, degree = get("positions"), get("radiance:sphericalHarmonicsDegree")
    each = (degree + 1) ** 2
    coefficients, shares = get("radiance:sphericalHarmonicsCoefficients"), get("labelgs:confidence")
    label = prim.GetCustomDataByKey("labelgs:label")
    shown = UsdSemantics.LabelsAPI(prim, "class").GetLabelsAttr().Get() if label else None
    check(not label or len(shown) == 1 and shown[0], f"semantics of {prim.GetPath()}")
    box, inside = Gf.Range3d(), Gf.Range3d(*map(Gf.Vec3d, get("extent")))
    # The same box by what every program uses for bounds.
    check(UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"]).ComputeUntransformedBound(prim).GetRange() == inside, "bound")
    for i, at in enumerate(positions):
        counted += 1
        row = place.pop(tuple(at), None)
        if row is None: bad.append(f"no Gaussian at {at}"); continue
        scales, turn = get("scales")[i], get("orientations")[i]
        length = math.hypot(*[row[f"rot_{k}"] for k in range(4)])
        w, x, y, z = (row[f"rot_{k}"] / length for k in range(4))
        off("rotation", [turn.real, *turn.imaginary], [w, x, -y, -z])
        off("size", map(math.log, scales), [row[f"scale_{k}"] for k in range(3)])
        off("opacity", [get("opacities")[i]], [1 / (1 + math.exp(-row["opacity"]))])
        rest = len([name for name in names if name.startswith("f_rest_")]) // 3
        for k in range(each):
            expected = [row[f"f_dc_{c}"] if k == 0 else row[f"f_rest_{c * rest + k - 1}"] if k <= rest else 0 for c in range(3)]
            off("harmonics", coefficients[i * each + k], [signs[k] * value for value in expected])
        check(row["label"] == label, f"label {label}, and {row['label']} in the PLY")
        if shares: off("confidence", [shares[i]], [row["label_confidence"]])
        matrix = Gf.Matrix3d(Gf.Rotation(Gf.Quatd(turn)))
        half = [3 * math.hypot(*[scales[k] * matrix[k][axis] for k in range(3)]) for axis in range(3)]
        for sign in (1, -1): box.UnionWith(Gf.Vec3d(*[at[axis] + sign * half[axis] for axis in range(3)]))
    off("box", [*box.min, *box.max], [*inside.min, *inside.max])
check(not place, f"{len(place)} Gaussians are missing")
size = max(abs(value) for at in [(row["x"], row["y"], row["z"]) for row in rows] for value in at)
most = dict(rotation=1e-6, size=1e-5, opacity=1e-6, harmonics=0, confidence=0, box=1e-4 * size)
bad += [f"{key} off by {value:.3g}" for key, value in worst.items() if value > most[key]]
validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
bad += [error.GetErrorAsString() for error in UsdValidation.ValidationContext(validators).Validate(stage)]
shown = ", ".join(f"{key} {value:.2g}" for key, value in worst.items())
print(f"{'usd, ' + path.rsplit('.')[-1] + ' read by OpenUSD ' + '.'.join(map(str, Usd.GetVersion()[1:])):<44} {counted:>6} Gaussians, off by: {shown}; "
      f"{'; '.join(map(str, bad[:5])) or 'passed'}")
sys.exit(bool(bad))
