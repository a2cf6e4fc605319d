#!/usr/bin/env python3
"""Models a training step on two GPUs: bytes and issue slots of each pass, over the rates of the GPU.

    tools/bench/step_model.py

A pass takes the longer of its bytes and its slots. Bytes follow from the layout of the buffers. Waiting, and the last
wave of workgroups, are left out. No GPU has checked the results: trust a ratio, not a millisecond.
"""

# Issue slots a second (SMs x 4 x clock), bytes a second; the shares of both that kernels reach.
CARDS = {"RTX 4090": (128 * 4 * 2.52e9, 1008e9), "H200": (132 * 4 * 1.83e9, 4800e9)}
SLOTS_REACHED, BYTES_REACHED = 0.62, 0.9
GAP = 3.5e-6  # seconds between two dependent dispatches

# Gaussians, visible share, (splat, tile) pairs, width, height.
SIZES = {"S": (27e3, 0.6, 90e3, 320, 240), "M": (133e3, 0.6, 300e3, 1440, 1080), "L": (1e6, 0.4, 1.5e6, 1600, 1064),
         "XL": (5e6, 0.4, 5.5e6, 1600, 1064)}
LATE = 0.6  # share of Gaussians with missed updates
FORWARD, BACKWARD = 65, 190  # slots of a splat and a subgroup of 64 and of 128 pixels (ptxas, sm_89)
HITS = 0.6  # share of (splat, subgroup) pairs that the cull keeps
PARAMETERS = 59 * 4  # bytes of a Gaussian at degree 3
HARMONICS = 48 * 4

# What differs between the programs that are compared. `moments`: share of late Gaussians whose moments the cull reads
# beyond the visible ones; `dense`: separate passes update all Gaussians; `moves`: random moves and loss terms.
PROGRAMS = {
    "98d2fc79": dict(moments=1.0, marks=True, items=17),
    "now": dict(moments=0.05, marks=False, items=16),
    "now, half moments": dict(moments=0.05, marks=False, items=16, half=True),
    "98d2fc79, mcmc": dict(moments=0.0, marks=True, items=27, dense=True),
    "now, mcmc": dict(moments=0.05, marks=False, items=16, moves=True),
}


def passes(size, of):
    """Bytes and issue slots of each pass."""
    n, share, pairs, width, height = SIZES[size]
    visible, pixels, tiles = n * share, width * height, width * height / 256
    late = 0 if of.get("dense") else LATE
    moments, harmonics = [bytes // (2 if of.get("half") else 1) for bytes in (2 * PARAMETERS, 2 * HARMONICS)]
    culled = n * late * min(1, share + of["moments"]) * (32 if of.get("half") else 64)
    updated = visible * (2 * PARAMETERS + 2 * moments + 60) + pairs * 40
    if of.get("dense"):  # records to sums, sums to gradients, and Adam of all
        updated = pairs * 40 + visible * (2 * PARAMETERS + 200) + n * (2 * PARAMETERS + 2 * moments + 4)
    if of.get("moves"):  # loss terms of all visible, and random moves of all
        updated += n * 164
    return {
        # Means, scales and lateness of all; moments that the cull reads; rest of the visible, harmonics of late ones.
        "project": (n * 36 + culled + visible * (PARAMETERS + 60) + visible * late * 0.3 * harmonics, visible * 30),
        "sort": (4 * visible * 16 + 2 * pairs * 12, (4 * visible + 2 * pairs) * 2.5),
        "emit, ranges": (visible * 60 + pairs * 8, visible * 12),
        "forward": (visible * 48 + pixels * 24, pairs * 4 * HITS * FORWARD),
        "loss": (pixels * 36, tiles * 23900),
        "backward": (visible * 48 + pixels * 36 + pairs * 40, pairs * 2 * HITS * 1.1 * BACKWARD),
        "update": (updated, visible * 100),
        "marks": (n * (36 + late * 64) if of["marks"] else 0, 0),
        "gaps": (0, 0),
    }


def main():
    for card, (slots, memory) in CARDS.items():
        print(f"\n| {card} | size | " + " | ".join(passes("S", PROGRAMS["now"])) + " | sum, ms |")
        print("| --- " * 12 + "|")
        for program, of in PROGRAMS.items():
            for size in SIZES:
                rows = passes(size, of)
                times = [max(b / (memory * BYTES_REACHED), s / (slots * SLOTS_REACHED)) for b, s in rows.values()]
                times[-1] = of["items"] * GAP
                cells = " | ".join(f"{1e3 * time:.2f}" for time in times)
                print(f"| {program} | {size} | {cells} | {1e3 * sum(times):.2f} |")


if __name__ == "__main__":
    main()
