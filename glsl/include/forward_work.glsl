// The work of a forward workgroup on GPUs: a list, or a chunk of a long list. Chunks of long lists come first, then
// the next longest lists (long_lists.glsl), then the other lists in order. Variant products has chunks only.

#ifdef MAIN
const bool HAS_PARTS = false;
#else
#include "long_lists.glsl"
const bool HAS_PARTS = LONG_LIST != 0xffffffffu;
#endif

struct Work {
    TileJob t;
    uint job;
    uint start, end; // the list,
    uint from, to;   // and what is walked of it
    uint chunk;      // of a part
    bool is_part;
};

// False for a workgroup without work.
bool find_work(StepUniforms u, out Work work) {
    uint parts = HAS_PARTS ? counters.long_chunk_count : 0u, firsts = 0u, others = 0u, group = linear_group_id();
#ifndef PRODUCTS
    firsts = HAS_PARTS ? counters.first_list_count : 0u;
    others = job_count(u);
#endif
    uint before_others = parts + firsts, groups = before_others + others;
    if (group >= groups) {
        return false;
    }
    group = TURNED != 0u ? groups - 1u - group : group;
    work.is_part = group < parts;
    work.job = group - before_others;
    work.chunk = 0u;
#ifndef MAIN
    if (work.is_part) {
        uvec2 part = long_chunks[group];
        work.job = part.x;
        work.chunk = part.y;
    }
#ifndef PRODUCTS
    if (!work.is_part && group < before_others) {
        work.job = first_lists[group - parts];
    }
#endif
#endif
    uint virtual_tile;
    work.t = locate_job(work.job, u, virtual_tile);
    work.start = fetchu(tile_starts, virtual_tile);
    work.end = fetchu(tile_ends, virtual_tile);
    work.from = work.start + work.chunk * CHUNK_LENGTH;
    work.to = work.is_part ? min(work.from + CHUNK_LENGTH, work.end) : work.end;
    bool is_taken = false;
#ifndef MAIN
    uint length = work.end - work.start;
    is_taken = HAS_PARTS && group >= before_others && work.t.layer == 0u && (is_long(length) || is_first(length));
#endif
    return !is_taken;
}
