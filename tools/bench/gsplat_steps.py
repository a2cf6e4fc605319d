#!/usr/bin/env python3
"""Times training steps of gsplat on a model and the views of a run of labelgs: the same Gaussians, pictures and loss.

    gsplat_steps.py RUN SCENE [--steps N]

Each step is waited for once, and once many are submitted without a wait, as in a training.

RUN is the folder of `labelgs train`, SCENE the scene that it was trained on. Needs torch with CUDA, gsplat, numpy and
pillow; fused_ssim for the D-SSIM part of the loss, without which the loss is L1 alone and the output says so.
"""
import argparse
import json
import statistics
import sys
import time
from pathlib import Path

import numpy as np

TYPES = {"float": "<f4", "uint": "<u4", "double": "<f8", "uchar": "u1", "int": "<i4"}


def read_ply(path):
    """Columns of a binary PLY by name."""
    with open(path, "rb") as file:
        names, count = [], 0
        for line in iter(file.readline, b"end_header\n"):
            words = line.decode("ascii").split()
            if words[:2] == ["element", "vertex"]:
                count = int(words[2])
            elif words[:1] == ["property"]:
                names.append((words[2], TYPES[words[1]]))
            elif not line:
                sys.exit(f"{path}: the header has no end")
        return np.fromfile(file, dtype=np.dtype(names), count=count)


def newest_model(run):
    """The model of the last iteration."""
    folders = sorted(run.glob("point_cloud/iteration_*"), key=lambda folder: int(folder.name.split("_")[1]))
    if not folders:
        sys.exit(f"{run}: no model in point_cloud/")
    return folders[-1] / "point_cloud.ply"


def columns(ply, names):
    return np.stack([ply[name] for name in names], axis=1).astype(np.float32)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("run", type=Path)
    arguments.add_argument("scene", type=Path)
    arguments.add_argument("--steps", type=int, default=200)
    arguments = arguments.parse_args()

    import torch
    from gsplat import rasterization
    from PIL import Image

    try:
        from fused_ssim import fused_ssim
    except ImportError:
        fused_ssim = None

    ply = read_ply(newest_model(arguments.run))
    rest = len([name for name in ply.dtype.names if name.startswith("f_rest_")]) // 3
    constant = columns(ply, [f"f_dc_{i}" for i in range(3)])[:, None, :]
    # The file has all coefficients of red, then green, then blue.
    higher = columns(ply, [f"f_rest_{i}" for i in range(3 * rest)]).reshape(-1, 3, rest).transpose(0, 2, 1)
    tensor = lambda values: torch.tensor(np.ascontiguousarray(values), device="cuda")
    parameters = {
        "means": tensor(columns(ply, ["x", "y", "z"])),
        "quats": tensor(columns(ply, [f"rot_{i}" for i in range(4)])),
        "scales": tensor(columns(ply, [f"scale_{i}" for i in range(3)])),
        "opacities": tensor(ply["opacity"].astype(np.float32)),
        "colours": tensor(np.concatenate([constant, higher], axis=1)),
    }
    for value in parameters.values():
        value.requires_grad_(True)
    adam = torch.optim.Adam(list(parameters.values()), lr=1e-6, eps=1e-15, fused=True)

    views = []
    for camera in json.loads((arguments.run / "cameras.json").read_text()):
        photo = arguments.scene / "images" / camera["img_name"]
        if not photo.exists():
            matches = list((arguments.scene / "images").glob(Path(camera["img_name"]).stem + ".*"))
            photo = matches[0] if matches else sys.exit(f"{photo}: no such photo")
        # The file has camera-to-world.
        world = np.eye(4, dtype=np.float32)
        world[:3, :3], world[:3, 3] = camera["rotation"], camera["position"]
        size = (camera["width"], camera["height"])
        intrinsics = [[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1]]
        picture = np.asarray(Image.open(photo).convert("RGB").resize(size), dtype=np.float32) / 255
        views.append((tensor(np.linalg.inv(world)), tensor(np.array(intrinsics, dtype=np.float32)), tensor(picture), size))

    def step(number, packed):
        pose, intrinsics, photo, (width, height) = views[number % len(views)]
        picture, _, _ = rasterization(
            parameters["means"], parameters["quats"], parameters["scales"].exp(), parameters["opacities"].sigmoid(),
            parameters["colours"], pose[None], intrinsics[None], width, height, sh_degree=3, near_plane=0.2, packed=packed)
        loss = 0.8 * (picture[0] - photo).abs().mean()
        if fused_ssim is not None:
            one = fused_ssim(picture.permute(0, 3, 1, 2), photo[None].permute(0, 3, 1, 2))
            loss = loss + 0.2 * (1 - one)
        adam.zero_grad(set_to_none=True)
        loss.backward()
        adam.step()

    def timed(work):
        torch.cuda.synchronize()
        start = time.perf_counter()
        work()
        torch.cuda.synchronize()
        return (time.perf_counter() - start) * 1e3

    ways = []
    for name, packed in [("unpacked", False), ("packed", True)]:
        for number in range(20):
            step(number, packed)
        times = sorted(timed(lambda: step(number, packed)) for number in range(arguments.steps))
        together = timed(lambda: [step(number, packed) for number in range(arguments.steps)])
        ways.append({
            "name": name, "median_ms": statistics.median(times), "p90_ms": times[len(times) * 9 // 10],
            "in_flight_ms": together / arguments.steps,
        })
    print(json.dumps({
        "device": torch.cuda.get_device_name(),
        "gaussians": len(ply),
        "size": max(view[3] for view in views),
        "sh_degree": 3,
        "ssim": fused_ssim is not None,
        "ways": ways,
    }))


if __name__ == "__main__":
    main()
