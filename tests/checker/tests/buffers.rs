//! The same for buffers: what orders accesses, and what does not.

use crate::faults::planted;
use labelgs_checker::findings::Kind;

#[test]
fn plain_accesses_of_a_buffer_by_two_workgroups() {
    planted(
        Kind::BufferRace,
        "
        void main() {
            #ifdef FAULT
            data[lane] = group;
            #else
            data[index] = group;
            #endif
        }",
    );
}

/// A counter that others may change is read once, atomically.
#[test]
fn plain_reads_of_words_with_atomics() {
    planted(
        Kind::BufferRace,
        "
        void main() {
            #ifdef FAULT
            data[index] = counters[3];
            #else
            data[index] = atomicLoad(counters[3], gl_ScopeDevice, gl_StorageSemanticsNone, gl_SemanticsRelaxed);
            #endif
            if (lane == 0 && group == 2) atomicOr(counters[3], 4);
        }",
    );
}

#[test]
fn buffers_between_invocations_of_a_workgroup() {
    planted(
        Kind::BufferRace,
        "
        void main() {
            data[index] = lane;
            #ifndef FAULT
            memoryBarrierBuffer();
            #endif
            barrier();
            memoryBarrierBuffer();
            counters[0];
            uint other = data[index ^ 127];
            barrier();
            if (other == 1000) counters[1] = other;
        }",
    );
}

/// The last workgroup sums what the others wrote. Without a second fence, invocation 0 hands over its own word only.
#[test]
fn hand_over_to_the_last_workgroup() {
    planted(
        Kind::BufferRace,
        "
        shared uint ticket;
        void main() {
            data[index] = lane;
            memoryBarrierBuffer();
            barrier();
            #ifndef FAULT
            memoryBarrierBuffer();
            #endif
            if (lane == 0) ticket = atomicAdd(counters[0], 1);
            barrier();
            memoryBarrierBuffer();
            barrier();
            memoryBarrierBuffer();
            if (ticket == 3) {
                uint sum = 0;
                for (uint other = 0; other < 4; ++other) sum += data[128 * other + lane];
                data[512 + lane] = sum;
            }
        }",
    );
}

/// The same by a control barrier that names buffers.
#[test]
fn hand_over_by_control_barriers() {
    planted(
        Kind::BufferRace,
        "
        shared uint ticket;
        void meet() {
            #ifdef FAULT
            controlBarrier(gl_ScopeWorkgroup, gl_ScopeWorkgroup, gl_StorageSemanticsShared, gl_SemanticsAcquireRelease);
            #else
            controlBarrier(gl_ScopeWorkgroup, gl_ScopeDevice, gl_StorageSemanticsBuffer | gl_StorageSemanticsShared,
                gl_SemanticsAcquireRelease);
            #endif
        }
        void main() {
            data[index] = lane;
            meet();
            if (lane == 0) ticket = atomicAdd(counters[0], 1);
            meet();
            if (ticket == 3) {
                uint sum = 0;
                for (uint other = 0; other < 4; ++other) sum += data[128 * other + lane];
                data[512 + lane] = sum;
            }
        }",
    );
}

#[test]
fn what_others_wrote_through_a_buffer_that_is_not_coherent() {
    planted(
        Kind::Coherence,
        "
        #ifdef FAULT
        #define coherent
        #endif
        layout(binding = 3) coherent buffer Other { uint other[]; };
        void main() {
            other[index] = index;
            controlBarrier(gl_ScopeWorkgroup, gl_ScopeWorkgroup, gl_StorageSemanticsBuffer, gl_SemanticsAcquireRelease);
            if (other[index ^ 127] == 5000) other[512 + index] = 1;
        }",
    );
}
