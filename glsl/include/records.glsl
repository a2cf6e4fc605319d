// Sums of the gradient records of a splat. The includer declares their planes, the offsets, densify_stats and step.
// With GROUP, all invocations of a workgroup sum a splat with many records.

#ifdef GROUP
const uint WALKERS = 64u; // invocations of a workgroup
shared vec4 shared_a[WALKERS / 2u], shared_b[WALKERS / 2u]; // sums of a splat
shared vec3 shared_c[WALKERS / 2u];
#endif

// Records of a splat; records of the scene layer come first.
struct Records {
    uint first, total, scene, gaussian;
};

struct Sums {
    vec4 a, b;
    vec3 c; // blue; v_mean2d of the scene layer for the statistic
};

Records records(uint s, uint gaussian) {
    Records r;
    r.total = fetchu(tiles_touched, s);
    r.first = fetchu(instance_offsets, s);
    r.scene = r.total;
    r.gaussian = gaussian;
#ifdef LABELS
    r.scene = fetchu(layer_from_label, fetchu(labels, r.gaussian)) != 0u ? r.total / 2u : r.total;
#endif
    return r;
}

// Adds up every stride-th record.
Sums sum_records(Records r, uint from, uint stride) {
    uint stamp = step.stamp;
    Sums sums = Sums(vec4(0.0), vec4(0.0), vec3(0.0));
    for (uint k = from; k < r.total; k += stride) {
        uint at = r.first + k;
        vec4 ra = fetch4(v_instances_a, at), rb = fetch4(v_instances_b, at);
        vec2 rc = fetch2(v_instances_c, at);
        bool current = floatBitsToUint(rc.y) == stamp;
        sums.a += current ? ra : vec4(0.0);
        sums.b += current ? rb : vec4(0.0);
        sums.c.x += current ? rc.x : 0.0;
        vec2 tile_mean = step.sum_absolute != 0u ? abs(ra.xy) : ra.xy;
        sums.c.yz += current && k < r.scene ? tile_mean : vec2(0.0);
    }
    return sums;
}

// Adds the scene's gradient to the statistic of a trained Gaussian.
void note_gradient(Records r, Sums sums) {
    if (r.total > 0u && r.gaussian < step.trained_count) {
        float size = length(sums.c.yz * vec2(0.5 * float(step.width), 0.5 * float(step.height)));
        // As in project_backward, which drops the gradients of such a splat: an infinity would stay in the sum.
        if (finite(size) && size < GRADIENT_MAX) {
            densify_stats[r.gaussian] += vec2(size, 1.0);
        }
    }
}

#ifdef GROUP
// The sums of a splat by all invocations: each adds up every 64th record, and a tree their sums, for the first
// invocation.
Sums sum_together(Records r) {
    uint lane = gl_LocalInvocationID.x;
    Sums sums = sum_records(r, lane, WALKERS);
    for (uint width = WALKERS / 2u; width > 0u; width /= 2u) {
        if (lane >= width && lane < 2u * width) {
            shared_a[lane - width] = sums.a;
            shared_b[lane - width] = sums.b;
            shared_c[lane - width] = sums.c;
        }
        barrier();
        if (lane < width) {
            sums.a += shared_a[lane];
            sums.b += shared_b[lane];
            sums.c += shared_c[lane];
        }
        barrier();
    }
    return sums;
}

shared uint large_count; // splats with more records than invocations: whose they are, and one of them
shared uint large_lane[WALKERS];
shared Records large;

// Sums the records of the splat of each invocation; a splat may have none.
Sums sum_all(Records r) {
    uint lane = gl_LocalInvocationID.x;
    if (lane == 0u) {
        large_count = 0u;
    }
    barrier();
    Sums sums = Sums(vec4(0.0), vec4(0.0), vec3(0.0));
    if (r.total <= WALKERS) {
        sums = sum_records(r, 0u, 1u);
    } else {
        large_lane[atomicAdd(large_count, 1u)] = lane; // in any order: each splat is summed for itself
    }
    barrier();
    for (uint k = 0u; k < large_count; k++) {
        if (lane == large_lane[k]) {
            large = r;
        }
        barrier();
        Sums all = sum_together(large);
        if (lane == 0u) {
            shared_a[0] = all.a;
            shared_b[0] = all.b;
            shared_c[0] = all.c;
        }
        barrier();
        if (lane == large_lane[k]) {
            sums = Sums(shared_a[0], shared_b[0], shared_c[0]);
        }
        barrier();
    }
    return sums;
}
#endif
