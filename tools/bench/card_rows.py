#!/usr/bin/env python3
"""Rows of tools/bench/card: what was timed, with which kernels, at which clocks; and their tables.

    card_rows.py row FOLDER NAME RESULT BEGAN [VARIABLE=VALUE ..]
    card_rows.py tables FOLDER
"""
import hashlib
import json
import statistics
import sys
import time
from datetime import datetime
from pathlib import Path


def clocks(folder, began, ended):
    """Medians over the samples in which the card worked; None without a sample."""
    names = ["sm_mhz", "memory_mhz", "utilisation", "watts", "celsius"]
    file, samples = folder / "clocks.csv", []
    for line in file.read_text().splitlines() if file.exists() else []:
        try:
            at, *cells = [cell.strip() for cell in line.split(",")]
            sample = {name: float(cell) for name, cell in zip(names, cells) if not cell.startswith("[")}
            at = datetime.strptime(at, "%Y/%m/%d %H:%M:%S.%f").timestamp()
        except ValueError:
            continue  # a line that is being written
        if began <= at <= ended and "sm_mhz" in sample and sample.get("utilisation", 1) > 0:
            samples.append(sample)
    told = {name: [sample[name] for sample in samples if name in sample] for name in names}
    return {name: statistics.median(values) for name, values in told.items() if values} if samples else None


def profile(found):
    median = lambda name: found["counters"][name]["median"]
    return {
        "kind": "profile", "device": found["device"], "driver": found["driver"], "size": found["size"],
        "sh_degree": found["sh_degree"], "labels": found["labels"], "gaussians": found["gaussians"],
        "visible": median("visible"), "instances": median("instances"), "pairs": median("pairs_walked"),
        "longest_list": median("longest_list"), "items": sum(stage["items"] for stage in found["stages"]),
        "passes_ms": found["passes_ms"]["median"], "pipeline_ms": found["pipeline_ms"]["mean"],
        "stages_ms": {row["stage"]: row["median_ms"] for row in found["stages"]},
    }


def training(run):
    info, metrics = (json.loads((run / name).read_text()) for name in ("run.json", "metrics.json"))
    model = sorted(run.glob("point_cloud/iteration_*/point_cloud.ply"))[-1]
    return {
        "kind": "training", "device": info["parts"][-1]["device"], "steps": metrics["steps"],
        "gaussians": metrics["gaussians"], "seconds": metrics["seconds"], "phases": info["phases"],
        "psnr": (metrics["test"] or {}).get("psnr"), "device_peak": info["memory"]["device_peak"],
        "sha256": hashlib.sha256(model.read_bytes()).hexdigest(),
    }


def add_row(folder, name, result, began, *values):
    """The result is the folder of a training, the JSON of a profile, or what another program wrote."""
    ended, result = time.time(), Path(result)
    if result.is_dir():
        found = training(result)
    elif result.suffix == ".json":
        found = profile(json.loads(result.read_text()))
    else:
        found = {"kind": "text", "text": result.read_text().strip()}
    row = {"name": name, "commit": (folder / "version.txt").read_text().strip(), "forms": values,
           "clocks": clocks(folder, float(began), ended), **found}
    with open(folder / "rows.jsonl", "a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")


def table(head, rows):
    rows = [[*head, "SM MHz"], *rows]
    widths = [max(len(str(row[column])) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        print("  ".join(str(cell).ljust(width) if not column else str(cell).rjust(width)
                        for column, (cell, width) in enumerate(zip(row, widths))))
    print()


def mhz(row):
    return f"{row['clocks']['sm_mhz']:.0f}" if row["clocks"] else "void"


def tables(folder):
    file = folder / "rows.jsonl"
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    of = lambda kind: [row for row in rows if row["kind"] == kind]
    print(f"\n{(folder / 'version.txt').read_text().strip()}; a row without a clock is void as one of a card\n")
    for row in of("text"):
        print(f"{row['name']} ({' '.join(row['forms'])}), SM clock {mhz(row)} MHz\n{row['text']}\n")
    steps, trainings = of("profile"), of("training")
    table(["step", "px", "degree", "labels", "Gaussians", "visible", "instances", "M pairs", "longest", "items",
           "passes ms", "in flight ms"], [
        [row["name"], "x".join(map(str, row["size"])), row["sh_degree"], "yes" if row["labels"] else "no",
         row["gaussians"], f"{row['visible']:.0f}", f"{row['instances']:.0f}", f"{row['pairs'] / 1e6:.1f}",
         f"{row['longest_list']:.0f}", row["items"], f"{row['passes_ms']:.3f}", f"{row['pipeline_ms']:.3f}", mhz(row)]
        for row in steps])
    stages = list(dict.fromkeys(stage for row in steps for stage in row["stages_ms"]))
    table(["median ms", *stages], [
        [row["name"], *(f"{row['stages_ms'].get(stage, 0):.3f}" for stage in stages), mhz(row)] for row in steps])
    phases = list(dict.fromkeys(phase for row in trainings for phase in row["phases"]))
    table(["training", "steps", "Gaussians", "s", *phases, "PSNR", "peak MiB", "sha256"], [
        [row["name"], row["steps"], row["gaussians"], f"{row['seconds']:.1f}",
         *(f"{row['phases'].get(phase, 0):.2f}" for phase in phases), f"{row['psnr'] or float('nan'):.2f}",
         (row["device_peak"] or 0) >> 20, row["sha256"][:12], mhz(row)] for row in trainings])
    # All rows of bits are promised to be equal, and trainings that run again.
    kin = lambda row: "bits" if row["name"].startswith("bits") else row["name"].removesuffix("-again")
    bits = {(kin(row), row["sha256"]) for row in trainings}
    differ = len(bits) > len({name for name, _ in bits})
    print("DIFFERENT BITS where equal ones are promised" if differ else "equal bits where promised")
    return int(differ)


if __name__ == "__main__":
    command, folder, *rest = sys.argv[1:]
    if command == "row":
        add_row(Path(folder), *rest)
    else:
        sys.exit(tables(Path(folder)))
