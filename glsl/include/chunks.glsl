// What the forward walk of group_tile.glsl keeps of the chunks of a list, for the backward walk. Nothing in variant main.

#ifdef CHANNEL
#include "channel.glsl"
shared uint staged_channel[BATCH];
#endif

// The channel (channel.glsl) as far as the walk is, and what it ends with where nothing is behind.
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

// Keeps the light and the transmittance of pixel k at the end of a chunk, and begins the next.
void keep(uint at, uint k, inout vec3 light, float transmittance, inout Channel channel) {
#ifndef MAIN
    chunk_states[at] = vec4(light, transmittance);
#endif
#ifdef CHANNEL
    chunk_channel[at] = channel.sum[k];
    channel.sum[k] = 0.0;
#endif
    light = vec3(0.0);
}

// Turns the light of each of the `kept` chunks into the light behind it, given that of the last one and of the background; and the
// channel likewise, whose sum is then that of the whole list.
void look_behind(TileJob t, uint states, uint kept, uint k, vec3 light, float transmittance, inout Channel channel) {
#ifdef CHANNEL
    channel.sum[k] += transmittance * channel.behind[k];
#endif
#ifndef MAIN
    for (uint e = kept; e-- > 0u;) {
        uint at = (states + e) * TILE_PIXELS + tile_pixel(t, k);
        vec4 state = chunk_states[at];
        chunk_states[at] = vec4(light / state.w, state.w);
        light += state.xyz;
#ifdef CHANNEL
        float of_chunk = chunk_channel[at];
        chunk_channel[at] = channel.sum[k] / state.w;
        channel.sum[k] += of_chunk;
#endif
    }
#endif
}

#ifndef MAIN
// Says in which chunks of job's list, up to its deepest splat that counts, the backward walk has work.
void list_chunks(uint job, uint start, uint end, uint deepest) {
    uint first = start / CHUNK_LENGTH + job, next = end / CHUNK_LENGTH + job + 1u;
    uint walked = (deepest + CHUNK_LENGTH - 1u) / CHUNK_LENGTH;
    for (uint slot = first + gl_LocalInvocationID.x; slot < next; slot += GROUP_LANES) {
        uint chunk = slot - first;
        chunk_jobs[slot] = chunk >= walked ? NO_CHUNK : job | (chunk + 1u == walked ? LAST_CHUNK : 0u);
    }
}
#endif
