// Workgroups of a dispatch that wait for each other's results without waiting: each arrives at a counter, and whichever
// is the last continues. All invocations of a workgroup call it in uniform flow.

// A barrier that also orders accesses of buffers. barrier() alone orders shared memory only.
#define buffer_barrier() \
    controlBarrier(gl_ScopeWorkgroup, gl_ScopeDevice, gl_StorageSemanticsBuffer | gl_StorageSemanticsShared, \
        gl_SemanticsAcquireRelease)

shared uint arrived_before;

// Counts this workgroup in `counter`, a word of a buffer. Afterwards arrived_before has the workgroups that came before,
// whose writes are visible if they are in coherent buffers or atomic.
#define arrive(counter) \
    buffer_barrier(); \
    if (gl_LocalInvocationIndex == 0u) { \
        arrived_before = atomicAdd(counter, 1u); \
    } \
    buffer_barrier()
