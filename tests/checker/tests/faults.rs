//! One fault of each kind, and what it is when mended: without a finding.

use crate::support::{Buffers, compile};
use labelgs_checker::findings::Kind;

const SEEDS: u64 = 8;

/// The shader with `FAULT` defined has findings of this kind only, with every seed. Without it, there is none.
fn planted_at(sizes: &[u32], kind: Kind, glsl: &str) {
    let faulty = compile(&format!("#define FAULT\n{HEAD}{glsl}"), &[]);
    let mended = compile(&format!("{HEAD}{glsl}"), &[]);
    for (&lanes, seed) in sizes.iter().flat_map(|lanes| (0..SEEDS).map(move |seed| (lanes, seed))) {
        let buffers = || Buffers { device: vec![2], ..Buffers::zeros(&[64, 1024, 1024, 1024]) };
        let run = |program| buffers().run(program, [4, 1, 1], lanes, seed);
        let (found, none) = (run(&faulty), run(&mended));
        assert!(found.contains(&kind), "{lanes} lanes, seed {seed}: {kind} is not found, only {found:?}");
        assert!(found.iter().all(|found| *found == kind), "{lanes} lanes, seed {seed}: {found:?}");
        assert_eq!(none, [], "{lanes} lanes, seed {seed}: the mended shader");
    }
}

/// The same with subgroups of every size.
pub fn planted(kind: Kind, glsl: &str) {
    planted_at(&[4, 8, 16, 32, 64], kind, glsl);
}

const HEAD: &str = "
    layout(local_size_x = 128) in;
    layout(binding = 0) coherent buffer Counters { uint counters[]; };
    layout(binding = 1) coherent buffer Data { uint data[]; };
    layout(binding = 2) coherent buffer Fresh { uint fresh[]; };
    shared uint words[128];
    uint lane = gl_LocalInvocationIndex, group = gl_WorkGroupID.x, index = gl_GlobalInvocationID.x;
";

#[test]
fn barriers_that_not_all_reach() {
    planted(
        Kind::Barrier,
        "
        void main() {
            words[lane] = 1;
            #ifdef FAULT
            if (lane < 64)
            #endif
                barrier();
            data[index] = words[lane];
        }",
    );
}

#[test]
fn invocations_that_end_before_a_barrier() {
    planted(
        Kind::Barrier,
        "
        void main() {
            words[lane] = 1;
            #ifdef FAULT
            if (lane == 77) return;
            #endif
            barrier();
            if (lane == 77) return;
            data[index] = words[lane];
        }",
    );
}

#[test]
fn different_barriers() {
    planted(
        Kind::Barrier,
        "
        void main() {
            words[lane] = 1;
            #ifdef FAULT
            if (lane % 2 == 0) { barrier(); data[index] = 1; } else { barrier(); data[index] = 2; }
            #else
            if (group % 2 == 0) { barrier(); data[index] = 1; } else { barrier(); data[index] = 2; }
            #endif
        }",
    );
}

#[test]
fn a_barrier_in_a_loop_that_some_leave_early() {
    planted(
        Kind::Barrier,
        "
        void main() {
            #ifdef FAULT
            uint rounds = lane == 5 ? 2 : 3;
            #else
            uint rounds = 2 + group % 2;
            #endif
            for (uint round = 0; round < rounds; ++round) barrier();
            data[index] = rounds;
        }",
    );
}

#[test]
fn races_in_shared_memory() {
    planted(
        Kind::SharedRace,
        "
        void main() {
            words[lane] = lane;
            barrier();
            uint other = words[127 - lane];
            #ifndef FAULT
            barrier();
            #endif
            words[lane] = other;
            barrier();
            data[index] = words[lane];
        }",
    );
}

/// As `count_visible` of a projection once was: a loop without a round has no barrier.
#[test]
fn races_beside_a_skipped_loop() {
    planted(
        Kind::SharedRace,
        "
        uint count() {
            #ifndef FAULT
            barrier();
            #endif
            if (lane < 4) words[lane] = 0;
            barrier();
            atomicAdd(words[lane / 32], 1);
            barrier();
            return words[3];
        }
        void main() {
            uint sum = count();
            for (uint before = 0; before < group; ++before) { barrier(); sum += 1; }
            data[index] = sum + count();
        }",
    );
}

#[test]
fn plain_accesses_of_shared_words_with_atomics() {
    planted(
        Kind::SharedRace,
        "
        void main() {
            if (lane == 0) words[0] = 0;
            barrier();
            atomicMax(words[0], lane);
            #ifndef FAULT
            barrier();
            #endif
            data[index] = words[0];
        }",
    );
}

/// A barrier of the subgroup orders its own lanes.
#[test]
fn subgroup_barriers_order_a_subgroup() {
    planted_at(
        &[32],
        Kind::SharedRace,
        "
        void main() {
            words[lane] = 0;
            barrier();
            words[lane] = lane;
            subgroupBarrier();
            #ifdef FAULT
            data[index] = words[lane ^ 32];
            #else
            data[index] = words[lane ^ 31];
            #endif
        }",
    );
}

#[test]
fn fences_that_not_all_run() {
    planted(
        Kind::Fence,
        "
        void main() {
            data[index] = lane;
            #ifdef FAULT
            if (lane == 0)
            #endif
                memoryBarrierBuffer();
            barrier();
            if (lane == 0) atomicAdd(counters[0], 1);
        }",
    );
}

#[test]
fn subgroup_operations_without_all_lanes() {
    planted(
        Kind::Subgroup,
        "
        void main() {
            uint sum = 0;
            #ifdef FAULT
            if (lane % 2 == 0)
            #else
            if (gl_SubgroupID % 2 == 0)
            #endif
                sum = subgroupAdd(lane);
            data[index] = sum;
        }",
    );
}

#[test]
fn subgroup_operations_in_a_loop_that_some_leave_early() {
    planted(
        Kind::Subgroup,
        "
        void main() {
            uint sum = 0;
            #ifdef FAULT
            uint rounds = lane % 4;
            #else
            uint rounds = gl_SubgroupID % 4;
            #endif
            for (uint round = 0; round < rounds; ++round) sum += subgroupAdd(lane + round);
            data[index] = sum;
        }",
    );
}

#[test]
fn reads_of_unwritten_shared_words() {
    planted(
        Kind::Unwritten,
        "
        void main() {
            #ifdef FAULT
            if (lane < 100)
            #endif
                words[lane] = lane;
            barrier();
            data[index] = words[127 - lane];
        }",
    );
}

#[test]
fn reads_of_unwritten_memory() {
    planted(
        Kind::Stale,
        "
        void main() {
            #ifdef FAULT
            if (lane < 100)
            #endif
                fresh[index] = lane;
            data[index] = fresh[index];
        }",
    );
}

#[test]
fn accesses_out_of_bounds() {
    planted(
        Kind::Bounds,
        "
        void main() {
            #ifdef FAULT
            uint at = index * 3;
            #else
            uint at = index * 2;
            #endif
            data[at] = lane;
        }",
    );
    planted(
        Kind::Bounds,
        "
        void main() {
            #ifdef FAULT
            uint at = lane + 1;
            #else
            uint at = lane ^ 1;
            #endif
            words[at] = lane;
            barrier();
            data[index] = words[at];
        }",
    );
    planted(
        Kind::Bounds,
        "
        void main() {
            uint local[4];
            for (uint place = 0; place < 4; ++place) local[(place + lane) % 4] = place;
            #ifdef FAULT
            uint at = counters[2] + 4 + lane % 2;
            #else
            uint at = counters[2] + lane % 4;
            #endif
            data[index] = local[at];
        }",
    );
}
