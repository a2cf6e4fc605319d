#!/usr/bin/env python3
"""Models a training step on two GPUs that nobody lent: bytes and issue slots of each pass, over the rates of the card.

    tools/bench/step_model.py

A pass takes the longer of its bytes and its slots. Slots of the inner loops are those that NVIDIA's and Mesa's
compilers make of the kernels (registers and instructions: `labelgs kernels`, tests/golden/kernels); bytes follow from
the layout of the buffers. No card has checked the results: trust a ratio, not a millisecond.
"""

# Issue slots a second (SMs x 4 x clock), bytes a second; the shares of both that kernels reach.
CARDS = {"RTX 4090": (128 * 4 * 2.52e9, 1008e9), "H200": (132 * 4 * 1.83e9, 4800e9)}
SLOTS_REACHED, BYTES_REACHED = 0.62, 0.9
GAP = 3.5e-6  # seconds between two dependent dispatches

# Gaussians, visible share, (splat, tile) pairs, width, height.
SIZES = {"S": (27e3, 0.6, 90e3, 320, 240), "M": (133e3, 0.6, 300e3, 1440, 1080), "L": (1e6, 0.4, 1.5e6, 1600, 1064),
         "XL": (5e6, 0.4, 5.5e6, 1600, 1064)}
LATE = 0.6  # share of Gaussians with missed updates
HITS = 0.6  # share of (splat, subgroup) pairs that the cull keeps
PARAMETERS = 59 * 4  # bytes of a Gaussian at degree 3
HARMONICS = 48 * 4

# What differs between the programs that are compared, newest last.
PROGRAMS = {
    "98d2fc79": {"forward": 65, "backward": 190, "digits": 4, "moments_culled": 64, "marks": True, "items": 17, "half": False},
    "now": {"forward": 65, "backward": 190, "digits": 4, "moments_culled": 64, "marks": True, "items": 17, "half": False},
    "now, half moments": {"forward": 65, "backward": 190, "digits": 4, "moments_culled": 64, "marks": True, "items": 17, "half": True},
}


def passes(size, of):
    """Bytes and issue slots of each pass."""
    n, share, pairs, width, height = SIZES[size]
    visible, pixels, tiles = n * share, width * height, width * height / 256
    moments = PARAMETERS if of["half"] else 2 * PARAMETERS
    harmonics = HARMONICS if of["half"] else 2 * HARMONICS
    return {
        # Means, scales and lateness of all; moments that the cull reads; rest of the visible, harmonics of late ones.
        "project": (n * 36 + n * LATE * of["moments_culled"] + visible * (PARAMETERS + 60) + visible * LATE * 0.3 * harmonics, visible * 30),
        "sort": (of["digits"] * visible * 16 + 2 * pairs * 12, (of["digits"] * visible + 2 * pairs) * 2.5),
        "emit, ranges": (visible * 60 + pairs * 8, visible * 12),
        "forward": (visible * 48 + pixels * 24, pairs * 4 * HITS * of["forward"]),
        "loss": (pixels * 36, tiles * 23900),
        "backward": (visible * 48 + pixels * 36 + pairs * 40, pairs * 2 * HITS * 1.1 * of["backward"]),
        "update": (visible * (2 * PARAMETERS + 2 * moments + 60) + pairs * 40, visible * 100),
        "marks": (n * (36 + LATE * of["moments_culled"]), 0) if of["marks"] else (0, 0),
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
