#!/usr/bin/env python3
"""Rows of tools/bench/card: what was timed, with which kernels, at which clocks; and their tables.

    card_rows.py row FOLDER PART NAME KIND RESULT BEGAN [VARIABLE=VALUE ..]
    card_rows.py tables FOLDER PART
"""
import hashlib
import json
import statistics
import sys
import time
from datetime import datetime
from pathlib import Path


def clocks(folder, part, began, ended):
    """Medians over the samples in which the card worked; None without a sample."""
    names = ["sm_mhz", "memory_mhz", "utilisation", "watts", "celsius"]
    file, samples = folder / f"clocks-{part}.csv", []
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
        "device": found["device"], "driver": found["driver"], "size": found["size"], "sh_degree": found["sh_degree"],
        "labels": found["labels"], "gaussians": found["gaussians"], "visible": median("visible"),
        "instances": median("instances"), "pairs": median("pairs_walked"), "longest_list": median("longest_list"),
        "items": sum(stage["items"] for stage in found["stages"]), "passes_ms": found["passes_ms"],
        "pipeline_ms": found["pipeline_ms"], "stages_ms": {row["stage"]: row["median_ms"] for row in found["stages"]},
    }


def training(run):
    info, metrics = (json.loads((run / name).read_text()) for name in ("run.json", "metrics.json"))
    model = sorted(run.glob("point_cloud/iteration_*/point_cloud.ply"))[-1]
    return {
        "device": info["parts"][-1]["device"], "steps": metrics["steps"], "gaussians": metrics["gaussians"],
        "seconds": metrics["seconds"], "phases": info["phases"], "psnr": (metrics["test"] or {}).get("psnr"),
        "device_peak": info["memory"]["device_peak"], "sha256": hashlib.sha256(model.read_bytes()).hexdigest(),
    }


def add_row(folder, part, name, kind, result, began, *values):
    ended, result = time.time(), Path(result)
    text = "" if kind == "training" else result.read_text().strip()
    # gsplat may say other things before.
    found = training(result) if kind == "training" else json.loads(text.splitlines()[-1] if kind == "gsplat" else text)
    row = {
        "name": name, "kind": kind, "commit": (folder / "version.txt").read_text().strip(), "forms": values,
        "clocks": clocks(folder, part, float(began), ended), **(profile(found) if kind == "profile" else found),
    }
    with open(folder / f"rows-{part}.jsonl", "a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")


def table(head, rows):
    rows = [head, *rows]
    widths = [max(len(str(row[column])) for row in rows) for column in range(len(head))]
    for row in rows:
        print("  ".join(str(cell).ljust(width) if not column else str(cell).rjust(width)
                        for column, (cell, width) in enumerate(zip(row, widths))))
    print()


def mhz(row):
    return f"{row['clocks']['sm_mhz']:.0f}" if row["clocks"] else "void"


def kernels(file):
    """Registers and memory of the kernels, under the names of the driver."""
    try:
        found = json.loads(file.read_text())["kernels"]
    except (OSError, ValueError):
        print("the driver tells nothing of compiled kernels\n")
        return
    of = lambda row, *names: sum(row["statistics"].get(name, 0) for name in names)
    spills = lambda row: of(row, "Local Memory Size", "Scratch size", "Stack Size", "Spilled VGPRs", "Spill Count")
    registers = lambda row: of(row, "Register Count", "VGPRs", "Max live registers")
    known = lambda row: (row["name"], row["subgroup_size"], f"{registers(row):.0f}", f"{spills(row):.0f}",
                         f"{of(row, 'Shared Memory Size', 'LDS size'):.0f}",
                         f"{of(row, 'Instruction Count', 'Instructions'):.0f}")
    spilling = [row for row in found if spills(row) > 0]
    most = sorted((row for row in found if row not in spilling), key=registers)[-6:]
    print(f"{len(found)} kernels, {len(spilling)} of them with memory of their own; these, and those with most registers:")
    table(["kernel", "subgroup", "registers", "local memory", "shared B", "instructions"], map(known, spilling + most))


def tables(folder, part):
    file = folder / f"rows-{part}.jsonl"
    rows = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    of = lambda kind: [row for row in rows if row["kind"] == kind]
    print(f"\n{(folder / 'version.txt').read_text().strip()}; a row without a clock is void as one of a card\n")
    if part == "1":
        kernels(folder / "kernels.json")
        for row in of("other"):
            print(f"{row['name']} ({' '.join(row['forms'])}), SM clock {mhz(row)} MHz\n{(folder / (row['name'] + '.txt')).read_text().strip()}\n")
    if of("training"):
        phases = list(of("training")[0]["phases"])
        table(["training", "steps", "Gaussians", "s", *phases, "PSNR", "peak MiB", "sha256", "SM MHz"], [
            [row["name"], row["steps"], row["gaussians"], f"{row['seconds']:.1f}",
             *(f"{row['phases'][phase]:.2f}" for phase in phases), f"{row['psnr'] or float('nan'):.2f}",
             (row["device_peak"] or 0) >> 20, row["sha256"][:12], mhz(row)] for row in of("training")])
    # All of part 1 are promised to be equal, and those of part 3 that are trained again.
    kin = lambda row: "" if part == "1" else row["name"].removesuffix("-again")
    bits = {(kin(row), row["sha256"]) for row in of("training")}
    differ = len(bits) > len({name for name, _ in bits})
    if differ:
        print("DIFFERENT BITS where equal ones are promised\n")
    steps = of("profile")
    if steps:
        table(["step", "px", "degree", "labels", "Gaussians", "visible", "instances", "M pairs", "longest", "items",
               "passes ms", "in flight ms", "SM MHz"], [
            [row["name"], "x".join(map(str, row["size"])), row["sh_degree"], "yes" if row["labels"] else "no",
             row["gaussians"], f"{row['visible']:.0f}", f"{row['instances']:.0f}", f"{row['pairs'] / 1e6:.1f}",
             f"{row['longest_list']:.0f}", row["items"], f"{row['passes_ms']['median']:.3f}",
             f"{row['pipeline_ms']['mean']:.3f}", mhz(row)] for row in steps])
        stages = list(dict.fromkeys(stage for row in steps for stage in row["stages_ms"]))
        table(["median ms", *stages], [
            [row["name"], *(f"{row['stages_ms'].get(stage, 0):.3f}" for stage in stages)] for row in steps])
    for row in of("gsplat"):
        for way in row["ways"]:
            print(f"{row['name']}: {row['gaussians']} Gaussians, {row['size'][0]}x{row['size'][1]} px, degree {row['sh_degree']}, "
                  f"{way['name']}: {way['median_ms']:.3f} ms waited for, {way['in_flight_ms']:.3f} ms in flight, "
                  f"{'with' if row['ssim'] else 'WITHOUT'} SSIM, SM clock {mhz(row)} MHz")
    return int(differ)


if __name__ == "__main__":
    command, folder, *rest = sys.argv[1:]
    if command == "row":
        add_row(Path(folder), *rest)
    else:
        sys.exit(tables(Path(folder), *rest))
