#!/usr/bin/env python3
"""Segments the photos of a scene one by one, and writes an id picture for each, with ids of its own.

  tools/segment.py SCENE -o MASKS --with segment_anything --weights sam_vit_h_4b8939.pth
  tools/segment.py SCENE -o MASKS --with sam2 --weights sam2.1_hiera_large.pt
  tools/segment.py SCENE -o MASKS --with my_module:my_function

Then `labelgs masks repair MASKS --per-view` makes the ids agree. It needs numpy, Pillow and the segmenter; install its
package and weights as its authors say. A function of your own gets a photo, uint8 [height, width, 3], and returns a list
of masks, bool [height, width] each or a dict with one as "segmentation"; or ids, integer [height, width]. Where masks
overlap, the smaller one is seen. Photos that have a mask in MASKS are left out, so a stopped run goes on.
"""

import argparse
import importlib
import json
import os
import sys
from pathlib import Path

ENDINGS = {".jpg", ".jpeg", ".png"}


def fail(text):
    sys.exit(f"segment.py: {text}")


def package(name, remedy):
    """Imports a module, or says how it comes here."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        fail(f"the Python package {name} cannot be imported ({error}); {remedy}")


def photos(scene):
    """Paths of the photos, with the names that their masks have."""
    frames = scene / "transforms.json"
    if frames.is_file() and not (scene / "sparse").is_dir():
        try:
            listed = [Path(frame["file_path"]) for frame in json.loads(frames.read_text())["frames"]]
        except (ValueError, KeyError, TypeError) as error:
            fail(f"{frames}: is no list of frames with `file_path` ({error!r})")
        listed = [path if path.suffix else path.with_suffix(".png") for path in listed]
        found = [(scene / path, path) for path in listed]
    else:
        folder = scene / "images"
        paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in ENDINGS)
        found = [(path, path.relative_to(folder)) for path in paths]
    outside = [name for _, name in found if name.is_absolute() or ".." in name.parts]
    if outside:
        fail(f"{scene}: the photo {outside[0]} lies outside of the scene; move it inside")
    if not found:
        fail(f"{scene}: has no photos in images, and no transforms.json that lists some")
    return [(path, name.with_suffix(".png")) for path, name in found]


def segmenter(args):
    """The function that segments a photo."""
    kind, weights = args.segmenter, args.weights
    if ":" in kind:
        sys.path.insert(0, os.getcwd())
        module, name = kind.split(":", 1)
        function = getattr(package(module, "name a module of this folder or an installed one"), name, None)
        return function if callable(function) else fail(f"{module} has no function {name}")
    if kind not in ("segment_anything", "mobile_sam", "sam2"):
        fail(f"--with {kind}: expected segment_anything, mobile_sam, sam2 or MODULE:FUNCTION")
    if not weights or not Path(weights).is_file():
        what = f"there is no file {weights}" if weights else "--weights is missing"
        fail(f"{what}: download the weights that the authors of {kind} offer, and name the file with --weights")
    remedy = "install it as its authors say"
    if kind == "sam2":
        build, generator = package("sam2.build_sam", remedy), package("sam2.automatic_mask_generator", remedy)
        model = build.build_sam2(args.model or "configs/sam2.1/sam2.1_hiera_l.yaml", weights, device=args.device)
        return generator.SAM2AutomaticMaskGenerator(model).generate
    sam = package(kind, remedy)
    guess = [name for name in sam.sam_model_registry if name in Path(weights).name] or ["default"]
    name = args.model or guess[0]
    if name not in sam.sam_model_registry:
        fail(f"--model {name}: {kind} has {', '.join(sam.sam_model_registry)}")
    model = sam.sam_model_registry[name](checkpoint=weights).to(args.device)
    return sam.SamAutomaticMaskGenerator(model.eval()).generate


def ids_of(answer, size, least):
    """One id per pixel, from 1; smaller masks cover larger ones."""
    if isinstance(answer, numpy.ndarray) and answer.ndim == 2 and answer.dtype != bool:
        masks = [answer == value for value in numpy.unique(answer) if value != 0]
    else:
        masks = [numpy.asarray(mask["segmentation"] if isinstance(mask, dict) else mask, dtype=bool) for mask in answer]
    wrong = [mask.shape for mask in masks if mask.shape != size]
    if wrong:
        raise ValueError(f"a mask has the shape {wrong[0]} and the photo {size}; return masks of the photo's size")
    ids = numpy.zeros(size, dtype=numpy.uint32)
    for number, mask in enumerate(sorted(masks, key=lambda mask: -int(mask.sum())), start=1):
        ids[mask] = number
    values, where, counts = numpy.unique(ids, return_inverse=True, return_counts=True)
    keep = (values != 0) & (counts >= least * ids.size)
    if keep.sum() > 65535:
        raise ValueError(f"{keep.sum()} masks; 65535 at most have an id, set --min-area")
    return numpy.where(keep, numpy.cumsum(keep), 0)[where].reshape(size), int(keep.sum())


def write(path, ids):
    """Writes the picture; a stopped run leaves no half of one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part")
    grey = Image.fromarray(ids.astype(numpy.uint8 if ids.max(initial=0) < 256 else numpy.uint16))
    grey.save(part, format="PNG")
    os.replace(part, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, help="folder with images, or with transforms.json")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the id pictures")
    kinds = "segment_anything, mobile_sam, sam2 or MODULE:FUNCTION"
    parser.add_argument("--with", dest="segmenter", required=True, help=kinds)
    parser.add_argument("--weights", help="file of weights of the segmenter")
    parser.add_argument("--model", help="model type, or configuration of sam2; default: by the name of the weights")
    parser.add_argument("--device", default="cpu", help="cpu or cuda (default: %(default)s)")
    smallest = "smallest mask, as a share of the photo (default: %(default)s)"
    parser.add_argument("--min-area", type=float, default=0.0005, help=smallest)
    args = parser.parse_args()
    # Only now, so that --help works without them.
    global numpy, Image
    numpy = package("numpy", "install python3-numpy, or with pip: numpy")
    Image = package("PIL.Image", "install python3-pil, or with pip: Pillow")
    todo = photos(args.scene)
    names = [name for _, name in todo]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        fail(f"two photos would have the mask {twice[0]}; their names differ in the ending only")
    segment = segmenter(args)
    for at, (photo, name) in enumerate(todo, start=1):
        if (args.output / name).is_file():
            continue
        try:
            with Image.open(photo) as opened:
                pixels = numpy.array(opened.convert("RGB"))
        except OSError as error:
            fail(f"{photo}: is no photo that can be read ({error})")
        try:
            ids, count = ids_of(segment(pixels), pixels.shape[:2], args.min_area)
        except (ValueError, TypeError, KeyError) as error:
            fail(f"{photo}: {args.segmenter} failed: {type(error).__name__}: {error}")
        write(args.output / name, ids)
        print(f"{at}/{len(todo)} {name}: {count} masks", flush=True)
    print(f"next: labelgs masks repair {args.output} --per-view --model MODEL --scene {args.scene} -o REPAIRED")


if __name__ == "__main__":
    main()
