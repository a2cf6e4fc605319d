// State that the forward pass of group_tile.glsl stores per list chunk, for the backward pass and for the last
// workgroup of a list in parts. Nothing in variant main.

#ifndef MAIN
#include "arrival.glsl"
shared uint deepest;
#endif

#ifdef CHANNEL
#include "channel.glsl"
shared uint staged_channel[BATCH];
#endif

// The channel (channel.glsl) so far, and its final value if nothing is behind.
struct Channel {
#ifdef CHANNEL
    uint own[ROWS];
    float weight[ROWS], sum[ROWS], behind[ROWS];
#else
    uint none;
#endif
};

void begin_channel(uint p, bool inside, StepUniforms u, uint k, inout Channel channel) {
#ifdef CHANNEL
    channel.own[k] = channel_of_pixel(p, inside, u, channel.weight[k], channel.behind[k]);
    channel.sum[k] = 0.0;
#endif
}

// Index of pixel k's state at the end of a chunk; channels have one in each slot.
uint state_of(Work work, uint chunk, uint k) {
    return (work.start / CHUNK_LENGTH + chunk) * TILE_PIXELS + tile_pixel(work.t, k);
}

uint channel_state_of(Work work, uint chunk, uint k) {
    return state_of(work, chunk, k) + work.job * TILE_PIXELS;
}

// Ends a chunk for pixel k: sums over the transmittance at its start become sums, and the next chunk starts with this
// one's transmittance. Products are rounded only here, whichever workgroup processes the next chunk.
void close_chunk(uint k, inout float p, inout float transmittance, inout vec3 light, inout Channel channel) {
    precise vec3 of_chunk = transmittance * light;
    light = of_chunk;
#ifdef CHANNEL
    precise float sum = transmittance * channel.sum[k];
    channel.sum[k] = sum;
#endif
    precise float next = transmittance * abs(p);
    transmittance = next;
    p = p < 0.0 ? -1.0 : 1.0;
}

// Keeps the light and the transmittance of pixel k at the end of a chunk, and begins the next.
void keep(Work work, uint chunk, uint k, inout vec3 light, float transmittance, inout Channel channel) {
#ifndef MAIN
    chunk_states[state_of(work, chunk, k)] = vec4(light, transmittance);
#endif
#ifdef CHANNEL
    chunk_channel[channel_state_of(work, chunk, k)] = channel.sum[k];
    channel.sum[k] = 0.0;
#endif
    light = vec3(0.0);
}

// Converts the light of each `kept` chunk to the light behind it, given the light of the last chunk and the background;
// the same for the channel, whose sum is then that of the whole list.
void look_behind(Work work, uint kept, uint k, vec3 light, float transmittance, inout Channel channel) {
#ifdef CHANNEL
    precise float back = transmittance * channel.behind[k], sum = channel.sum[k] + back;
    channel.sum[k] = sum;
#endif
#ifndef MAIN
    for (uint e = kept; e-- > 0u;) {
        uint at = state_of(work, e, k);
        vec4 state = chunk_states[at];
        chunk_states[at] = vec4(light / state.w, state.w);
        light += state.xyz;
#ifdef CHANNEL
        at = channel_state_of(work, e, k);
        float of_chunk = chunk_channel[at];
        chunk_channel[at] = channel.sum[k] / state.w;
        channel.sum[k] += of_chunk;
#endif
    }
#endif
}

#ifdef PRODUCTS
// Prepares what the parts of a list add to.
void clear_list(Work work, StepUniforms u) {
    TileJob t = work.t;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        if (t.x < u.width && t.y0 + k < u.height) {
            uint pixel = (t.y0 + k) * u.width + t.x;
            last[pixel] = 0u;
            image[pixel].w = 0.0;
        }
    }
    if (gl_LocalInvocationID.x == 0u) {
        chunk_jobs[work.start / CHUNK_LENGTH + work.job] = 0u;
    }
}
#endif

#ifndef MAIN
// Stores pixel k of a part. Values without a state slot are stored in the picture: the light of the last chunk, and the
// final transmittance from the chunk in which the pixel stops or the list ends. Components are written separately,
// because other workgroups access the others.
void put_part(Work work, uint k, vec3 light, float transmittance, bool stops, uint final_, StepUniforms u, Channel channel) {
    TileJob t = work.t;
    uint at = state_of(work, work.chunk, k), pixel = (t.y0 + k) * u.width + t.x;
    bool inside = t.x < u.width && t.y0 + k < u.height, ends = work.to == work.end;
    if (!ends) {
        chunk_states[at].x = light.x;
        chunk_states[at].y = light.y;
        chunk_states[at].z = light.z;
    } else if (inside) {
        image[pixel].x = light.x;
        image[pixel].y = light.y;
        image[pixel].z = light.z;
    }
    if (inside && (stops || ends && transmittance >= TRANSMITTANCE_MIN)) {
        image[pixel].w = transmittance;
    }
    if (inside && final_ > 0u) {
        atomicMax(last[pixel], final_);
    }
#ifdef CHANNEL
    chunk_channel[channel_state_of(work, work.chunk, k)] = channel.sum[k];
#endif
}

// Loads what the parts stored for pixel k, as if this workgroup had processed them all: the states between them, the
// light before the last chunk and of that chunk, the final transmittance, the last splat.
void take_parts(Work work, uint kept, uint k, inout vec3 before, inout vec3 light, inout float at_end, inout uint final_,
    StepUniforms u, inout Channel channel) {
    TileJob t = work.t;
    bool inside = t.x < u.width && t.y0 + k < u.height;
    uint pixel = (t.y0 + k) * u.width + t.x;
    vec4 of_last = vec4(0.0, 0.0, 0.0, 1.0);
    if (inside) {
        of_last = image[pixel];
        final_ = last[pixel];
    }
    light = of_last.xyz;
    at_end = of_last.w;
    float transmittance = 1.0;
    for (uint e = 0u; e < kept; e++) {
        uint at = state_of(work, e, k);
        vec4 state = chunk_states[at];
        before += state.xyz;
        precise float next = transmittance * state.w;
        transmittance = next;
        chunk_states[at].w = next < TRANSMITTANCE_MIN ? at_end : next;
    }
#ifdef CHANNEL
    channel.sum[k] = chunk_channel[channel_state_of(work, kept, k)];
#endif
}
#endif

// Sets pixel k's transmittance at the start of a part: the product of the transmittances of all earlier chunks
// (variant products). It decreases from chunk to chunk, so if it is too low, the pixel has stopped before.
void start_part(Work work, uint k, inout float p, inout float transmittance) {
#ifndef MAIN
    for (uint e = 0u; e < work.chunk; e++) {
        precise float next = transmittance * chunk_states[state_of(work, e, k)].w;
        transmittance = next;
    }
    p = transmittance < TRANSMITTANCE_MIN ? -1.0 : p;
#endif
}

// Ends the last chunk. Parts are completed by the last workgroup of their list; there, as for whole lists, returns true
// and the results of the whole list.
bool finish_walk(Work work, inout uint kept, inout float p[ROWS], inout float T[ROWS], inout vec3 light[ROWS],
    inout vec3 before[ROWS], inout uint final_[ROWS], StepUniforms u, inout Channel channel) {
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        bool stops = p[k] < 0.0 && T[k] >= TRANSMITTANCE_MIN;
        close_chunk(k, p[k], T[k], light[k], channel);
#ifndef MAIN
        if (work.is_part) {
            put_part(work, k, light[k], T[k], stops, final_[k], u, channel);
        }
#endif
    }
#ifndef MAIN
    if (work.is_part) {
        kept = (work.end - work.start - 1u) / CHUNK_LENGTH;
        arrive(chunk_jobs[work.start / CHUNK_LENGTH + work.job]);
        if (arrived_before < kept) {
            return false;
        }
        [[unroll]] for (uint k = 0u; k < ROWS; k++) {
            take_parts(work, kept, k, before[k], light[k], T[k], final_[k], u, channel);
        }
    }
#endif
    return true;
}

// Lists the chunks, up to the furthest splat that counts in any lane, for which the backward pass has work.
void list_chunks(Work work, uint furthest) {
#ifndef MAIN
    if (gl_LocalInvocationID.x == 0u) {
        deepest = 0u;
    }
    barrier();
    furthest = subgroup_max(furthest);
    if (subgroup_lane() == 0u) {
        atomicMax(deepest, furthest);
    }
    barrier();
    uint first = work.start / CHUNK_LENGTH + work.job, next = work.end / CHUNK_LENGTH + work.job + 1u;
    uint walked = (deepest + CHUNK_LENGTH - 1u) / CHUNK_LENGTH;
    for (uint slot = first + gl_LocalInvocationID.x; slot < next; slot += GROUP_LANES) {
        uint chunk = slot - first;
        chunk_jobs[slot] = chunk >= walked ? NO_CHUNK : work.job | (chunk + 1u == walked ? LAST_CHUNK : 0u);
    }
#endif
}
