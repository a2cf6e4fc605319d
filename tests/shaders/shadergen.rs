//! The shader generator: the interface that it reads from a shader, and each fault that it reports.

#[path = "../../tools/shadergen/mod.rs"]
pub mod tool;

use std::fs;
use tempfile::TempDir;
use tool::interface::{Access, Kind, LocalSize};
use tool::{Finding, Generated};

const CONSTANTS: &str = include_str!("../../glsl/include/constants.glsl");
const LAYOUT: &str = include_str!("../../glsl/include/layout.glsl");

/// A shader that keeps all rules, and uses all that an interface can have.
const GOOD: &str = r#"#version 460
#include "layout.glsl"
#include "constants.glsl"

// good — do a little of everything.
// Work: one invocation per element.

struct Inner { vec2 a; float b, c; };
struct Counters { vec3 x; uint n; Inner inner[2]; mat4 m; int k; uint l; uvec2 o; };

READ1(0, Counters, counters);
FETCH4(1, means);
FETCHU(2, labels);
INOUT(3, vec4, colors);
WRITE(7, uvec2, keys);
layout(constant_id = 0) const uint WIDTH = 8;
layout(constant_id = 1) const float SCALE = 0.25;
layout(constant_id = 2) const bool CLAMP = true;
layout(constant_id = 5) const int OFFSET = -3;
layout(local_size_x_id = 0, local_size_y_id = 6) in;

void main() {
    uint i = gl_GlobalInvocationID.x;
    float sum = subgroupAdd(fetch4(means, i).x) * (CLAMP ? ALPHA_MIN : SCALE) + float(OFFSET);
    colors[i] += sum * counters.m * vec4(counters.x, counters.inner[1].b);
    keys[i] = uvec2(fetchu(labels, i), WIDTH + counters.n + SEGMENT);
}
"#;

/// The smallest shader that keeps all rules; `body` stands before `main`, `code` in it.
fn small(body: &str, code: &str) -> String {
    format!(
        "#version 460\n#include \"layout.glsl\"\n\n// probe — try one thing.\n// Work: one invocation.\n\n\
         WRITE(0, uint, words);\n{body}\nlayout(local_size_x = 1) in;\nvoid main() {{\n    words[0] = 1u;\n    {code}\n}}\n"
    )
}

/// A folder with the real includes and these files.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().expect("temporary folder");
    let includes = [("include/layout.glsl", LAYOUT), ("include/constants.glsl", CONSTANTS)];
    for (name, text) in includes.iter().chain(files) {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a parent")).expect("folder made");
        fs::write(path, text).expect("file written");
    }
    folder
}

fn generate(files: &[(&str, &str)]) -> Result<Generated, Vec<Finding>> {
    tool::generate(folder(files).path())
}

/// The findings of these files, one text each.
fn findings(files: &[(&str, &str)]) -> Vec<String> {
    generate(files).expect_err("no finding").iter().map(Finding::to_string).collect()
}

/// Exactly one finding, with all of `parts` in it.
#[track_caller]
fn one_finding(files: &[(&str, &str)], parts: &[&str]) {
    let found = findings(files);
    assert_eq!(found.len(), 1, "{found:#?}");
    for part in parts {
        assert!(found[0].contains(part), "`{part}` is not in: {}", found[0]);
    }
}

#[track_caller]
fn probe(body: &str, code: &str, parts: &[&str]) {
    one_finding(&[("test/probe.comp", &small(body, code))], parts);
}

#[test]
fn a_good_shader_is_reflected_in_full() {
    let generated = generate(&[("test/good.comp", GOOD), ("variants.txt", "good + texel: TEXEL # views\n")])
        .unwrap_or_else(|findings| panic!("{findings:#?}"));
    let [base, texel] = generated.shaders[0].variants.as_slice() else { panic!("two variants") };
    let shape: Vec<_> = base
        .interface
        .bindings
        .iter()
        .map(|binding| (binding.name.as_str(), binding.binding, binding.access, binding.element_bytes))
        .collect();
    let expected = [
        ("counters", 0, Access::Read, 128),
        ("means", 1, Access::Read, 16),
        ("labels", 2, Access::Read, 4),
        ("colors", 3, Access::ReadWrite, 16),
        ("keys", 7, Access::Write, 8),
    ];
    assert_eq!(shape, expected);
    assert!(base.interface.bindings.iter().all(|binding| binding.kind == Kind::Storage));
    let texels = texel.interface.bindings.iter().filter(|binding| binding.kind == Kind::Texel);
    assert_eq!(texels.map(|binding| binding.name.as_str()).collect::<Vec<_>>(), ["means", "labels"]);
    let spec: Vec<_> =
        base.interface.spec.iter().map(|spec| (spec.name.as_str(), spec.id, spec.rust, spec.default)).collect();
    let expected = [
        ("WIDTH", 0, "u32", 8),
        ("SCALE", 1, "f32", 0.25f32.to_bits()),
        ("CLAMP", 2, "bool", 1),
        ("OFFSET", 5, "i32", -3i32 as u32),
        ("LOCAL_SIZE_Y", 6, "u32", 1),
        ("SEGMENT", 5, "u32", 0),
    ];
    assert_eq!(spec, expected);
    assert!(base.interface.spec.iter().all(|spec| spec.is_pushed == (spec.name == "SEGMENT")));
    assert!(base.interface.uses_subgroups);
    let expected = [LocalSize::Constant(0), LocalSize::Constant(6), LocalSize::Fixed(1)];
    assert_eq!(base.interface.local_size, expected);
    let counters = &base.interface.structs["Counters"];
    let offsets: Vec<_> = counters.fields.iter().map(|field| (field.offset, field.ty.rust.as_str())).collect();
    let expected = [
        (0, "[f32; 3]"),
        (12, "u32"),
        (16, "[super::structs::Inner; 2]"),
        (48, "[[f32; 4]; 4]"),
        (112, "i32"),
        (116, "u32"),
        (120, "[u32; 2]"),
    ];
    assert_eq!(offsets, expected);
    for text in [
        "macros: &[\"TEXEL\"]",
        "pub mod good",
        "`glsl/test/good.comp`: do a little of everything.",
        "&good::VARIANTS[1]",
    ] {
        assert!(generated.rust.contains(text), "`{text}` is not generated");
    }
}

#[test]
fn a_shader_without_subgroup_operations_says_so() {
    let generated = generate(&[("test/probe.comp", &small("", ""))]).expect("no finding");
    let interface = &generated.shaders[0].variants[0].interface;
    assert!(!interface.uses_subgroups);
    assert_eq!(interface.local_size, [LocalSize::Fixed(1); 3]);
}

#[test]
fn the_same_input_gives_the_same_files() {
    let folder = folder(&[("test/good.comp", GOOD), ("test/probe.comp", &small("", ""))]);
    let written = || {
        let out = tempfile::tempdir().expect("temporary folder");
        tool::run(folder.path(), out.path()).expect("no finding");
        ["shaders.rs", "good.spv", "probe.spv"].map(|name| fs::read(out.path().join(name)).expect("file written"))
    };
    assert_eq!(written(), written());
}

#[test]
fn constants_have_the_bits_of_the_shaders() {
    use labelgs::shaders::constants::{ALPHA_MAX, ALPHA_MIN, LOG2_ALPHA_MIN, TRANSMITTANCE_MIN};
    assert_eq!(ALPHA_MIN.to_bits(), (1.0f32 / 255.0).to_bits());
    assert_eq!(ALPHA_MAX.to_bits(), 0.99f32.to_bits());
    assert_eq!(TRANSMITTANCE_MIN.to_bits(), 1e-4f32.to_bits());
    assert_eq!(LOG2_ALPHA_MIN.to_bits(), ((1.0f64 / 255.0).log2() as f32).to_bits());
    let text = "const uint COUNT = 3u * 4u; // how many\nconst int LOW = -2;\n";
    let constants = generate(&[("include/constants.glsl", text)]).expect("no finding").rust;
    assert!(constants.contains("/// how many") && constants.contains("pub const COUNT: u32 = 12;"), "{constants}");
    assert!(constants.contains("pub const LOW: i32 = -2;"), "{constants}");
}

#[test]
fn a_constant_that_is_not_known_at_build_time_is_found() {
    let text = "const float HALF = 0.5;\nconst uint GROUPS = gl_NumWorkGroups.x;\n";
    let found = findings(&[("include/constants.glsl", text)]);
    assert!(found[0].starts_with("glsl/include/constants.glsl"), "{found:#?}");
}

#[test]
fn text_that_does_not_compile_is_found_with_its_line() {
    probe("", "words[0] = nothing;", &["glsl/test/probe.comp:12", "'nothing' : undeclared identifier"]);
    one_finding(&[("test/probe.comp", "#version 460\n#include \"gone.glsl\"\n")], &["probe.comp", "gone.glsl"]);
}

#[test]
fn another_set_than_0_is_found() {
    let body = "layout(std430, set = 1, binding = 1) buffer other_block { uint other[]; };";
    probe(body, "other[0] = 1u;", &["glsl/test/probe.comp:8", "`other` is in set 1; only set 0"]);
}

#[test]
fn a_binding_that_is_not_used_is_found() {
    probe("READ(1, uint, idle);", "", &["probe.comp:8", "binding 1 `idle` is used by no variant of probe"]);
    let code = "uint unused = idle[3]; if (false) words[1] = unused;";
    probe("READ(1, uint, idle);", code, &["binding 1 `idle` is used by no variant"]);
    let text = small("READ(1, uint, busy);", "#ifdef OTHER\n    words[1] = busy[0];\n    #endif");
    assert!(generate(&[("test/probe.comp", &text), ("variants.txt", "probe + other: OTHER\n")]).is_ok());
}

#[test]
fn a_binding_number_used_twice_is_found() {
    probe("READ(0, uint, twin);", "words[1] = twin[0];", &["binding 0 is declared twice"]);
}

#[test]
fn a_block_without_exactly_one_member_is_found() {
    let body = "layout(std430, set = 0, binding = 1) buffer pair_block { uint first; uint second[]; };";
    probe(body, "first = second[0];", &["probe.comp:8", "`pair_block` has 2 members", "exactly one"]);
}

#[test]
fn padding_is_found() {
    probe("WRITE(1, vec3, normals);", "normals[0] = vec3(1);", &["16 bytes apart and 12 bytes long", "std430"]);
    let body = "struct Gap { float first; vec2 second; };\nWRITE1(1, Gap, gap);";
    probe(body, "gap.first = 1.0;", &["`second` of `Gap` is at byte 8, not 4", "follow each vec3"]);
    let body = "struct Odd { vec2 first; float second; };\nWRITE1(1, Odd, odd);";
    probe(
        body,
        "odd.second = 1.0;",
        &["`Odd` ends at byte 12, which std430 rounds up to multiples of 8", "at the end"],
    );
}

#[test]
fn other_resources_than_buffers_are_found() {
    let image = "layout(set = 0, binding = 1, rgba8) uniform image2D canvas;";
    probe(image, "imageStore(canvas, ivec2(0), vec4(1));", &["`canvas` is neither a storage block nor"]);
    let uniform = "layout(set = 0, binding = 1) uniform rates_block { float rate; };";
    probe(uniform, "words[0] = uint(rate);", &["uniform blocks are not supported"]);
    let push = "layout(push_constant) uniform push_block { uint many[4]; } push;";
    probe(push, "words[0] = push.many[3];", &["glsl/test/probe.comp", "one push_constant block"]);
}

#[test]
fn a_block_both_readonly_and_writeonly_is_found() {
    let body = "layout(std430, set = 0, binding = 1) readonly writeonly buffer odd_block { uint odd[]; };";
    probe(body, "words[0] = odd.length();", &["`odd` is readonly and writeonly"]);
}

#[test]
fn a_missing_header_is_found() {
    let text = small("", "");
    one_finding(
        &[("test/probe.comp", &text.replace("// probe — try one thing.", ""))],
        &["probe.comp:1", "no header comment", "// probe — what it does."],
    );
    one_finding(&[("test/probe.comp", &text.replace("// Work:", "// Play:"))], &["no header comment"]);
}

#[test]
fn literals_of_the_constants_are_found() {
    for (literal, name) in
        [("1.0/255.0", "1/255"), ("1 / 255.0f", "1/255"), ("0.99", "0.99"), ("1e-4", "1e-4"), (".0001", "1e-4")]
    {
        probe("", &format!("words[1] = uint({literal} * 9.0);"), &["glsl/test/probe.comp:12", name, "constants.glsl"]);
    }
    let helper = "// 0.99 in a comment is fine\nconst float LIMIT = 0.99;\n";
    let files = [("include/helper.glsl", helper), ("test/probe.comp", &small("", ""))];
    one_finding(&files, &["glsl/include/helper.glsl:2", "literal 0.99"]);
    let fine = small("", "words[1] = uint(1.99 + 0.991 + 21e-4 + 1.0 / 2550.0); // 0.99\n    /* 1e-4 */");
    assert!(generate(&[("test/probe.comp", &fine)]).is_ok());
}

#[test]
fn variants_with_different_interfaces_are_found() {
    let variants = ("variants.txt", "probe + other: OTHER\n");
    let with =
        |base: &str, other: &str, code: &str| small(&format!("#ifdef OTHER\n{other}\n#else\n{base}\n#endif"), code);
    let cases = [
        (with("READ(1, uint, a);", "READ(1, uint, b);\n#define a b", "words[1] = a[0];"), "bindings"),
        (with("READ(1, uint, a);", "INOUT(1, uint, a);", "words[1] = a[0];"), "bindings"),
        (with("READ(1, uint, a);", "READ(2, uint, a);", "words[1] = a[0];"), "bindings"),
        (with("READ(1, uint, a);", "READ(1, uvec2, a);", "words[1] = uvec2(a[0]).x;"), "bindings"),
        (
            with(
                "layout(constant_id = 0) const uint A = 1;",
                "layout(constant_id = 0) const uint A = 2;",
                "words[1] = A;",
            ),
            "specialisation constants",
        ),
    ];
    for (text, what) in &cases {
        let rule = format!("probe and probe_other have different {what}");
        one_finding(&[("test/probe.comp", text), variants], &[&rule]);
    }
}

#[test]
fn a_constant_that_differs_between_siblings_is_found() {
    let text = small(
        "#ifdef OTHER\nlayout(constant_id = 0) const uint A = 1;\n#else\nlayout(constant_id = 0) const uint A = 2;\n#endif",
        "words[1] = A;",
    );
    let files = [("test/probe.comp", text.as_str()), ("variants.txt", "wide = probe: OTHER\n")];
    one_finding(&files, &["glsl/test/probe.comp:9", "`A` differs between probe and wide"]);
}

#[test]
fn a_struct_with_two_layouts_is_found() {
    let one = small("struct Pair { uint a; uint b; };\nREAD(1, Pair, pairs);", "words[1] = pairs[0].b;");
    let two = one.replace("probe —", "second —").replace("uint a;", "float a;");
    one_finding(
        &[("test/probe.comp", &one), ("test/second.comp", &two)],
        &["glsl/test/second.comp:8", "struct `Pair` differs from the one of glsl/test/probe.comp"],
    );
}

#[test]
fn names_that_rust_cannot_use_are_found() {
    probe("READ(1, uint, type);", "words[1] = type[0];", &["`type` cannot be the name of a Rust field"]);
    probe("READ(1, uint, keyList);", "words[1] = keyList[0];", &["`keyList` cannot be", "snake_case"]);
    one_finding(&[("test/Probe.comp", &small("", ""))], &["glsl/test/Probe.comp", "snake_case"]);
    let text = small("", "");
    one_finding(
        &[("a/probe.comp", &text), ("b/probe.comp", &text)],
        &["b/probe.comp", "a/probe.comp has the same stem"],
    );
}

#[test]
fn bad_lines_of_the_variants_are_found() {
    let text = small("", "");
    for (line, part) in [
        ("probe other: OTHER", "is no variant"),
        ("probe + other:", "is no variant"),
        ("probe + base: OTHER", "is no variant"),
        ("gone + other: OTHER", "there is no shader `gone`"),
        ("probe + a: A\nprobe + a: B", "declared twice"),
    ] {
        let lines = format!("# comment\n{line}\n");
        one_finding(&[("test/probe.comp", &text), ("variants.txt", &lines)], &["glsl/variants.txt:", part]);
    }
    let twin = small("", "").replace("probe —", "probe_fast —");
    let files =
        [("test/probe.comp", text.as_str()), ("test/probe_fast.comp", &twin), ("variants.txt", "probe + fast: F")];
    one_finding(&files, &["variants.txt:1", "`probe_fast` is a shader's name already"]);
}

#[test]
fn siblings_have_an_interface_of_their_own_and_a_star_reaches_all_callers() {
    let fetching = small(
        "FETCHU(1, keys);\n#ifdef MORE\nREAD(2, uint, more);\n#else\n#define more keys\n#endif",
        "words[1] = more[0];",
    );
    let fetching = fetching
        .replace("words[1] =", "words[2] = fetchu(keys, 1);\n#ifdef MORE\n    words[1] =")
        .replace("[0];\n}", "[0];\n#endif\n}");
    let plain = small("", "").replace("probe —", "plain —");
    let lines = "wide = probe: MORE\nfetchu* + half: HALF\nfetch* + texel: TEXEL\netchu* + none: A\nkeys* + none: A\n";
    let files = [("test/probe.comp", fetching.as_str()), ("test/plain.comp", &plain), ("variants.txt", lines)];
    let generated = generate(&files).unwrap_or_else(|findings| panic!("{findings:#?}"));
    let shaders: Vec<_> = generated
        .shaders
        .iter()
        .map(|shader| {
            let variants: Vec<&str> = shader.variants.iter().map(|variant| variant.name.as_str()).collect();
            (shader.stem.as_str(), variants, shader.variants[0].interface.bindings.len())
        })
        .collect();
    let expected = [
        ("plain", vec!["plain"], 1),
        ("probe", vec!["probe", "probe_half", "probe_texel", "probe_half_texel"], 2),
        ("wide", vec!["wide", "wide_half", "wide_texel", "wide_half_texel"], 3),
    ];
    assert_eq!(shaders, expected);
    // One module for both: the macro that chooses, and every binding once.
    for (text, times) in [("pub mod probe {", 1), ("pub mod wide", 0), ("pub more: bool,", 1), ("pub keys: B,", 1)] {
        assert_eq!(generated.rust.matches(text).count(), times, "{text}");
    }
    assert!(generated.rust.contains("/// Binding 2, read where there is MORE."), "{}", generated.rust);
    one_finding(
        &[("test/probe.comp", &plain.replace("plain", "probe")), ("variants.txt", "probe = probe: A")],
        &["already"],
    );
    one_finding(&[("variants.txt", "wide = gone: A")], &["variants.txt:1", "there is no shader `gone`"]);
}

/// On a GPU, a barrier that a part of a workgroup does not reach hangs or lets the others go on too early.
#[test]
fn a_barrier_that_only_some_invocations_reach_is_a_finding() {
    let body = "INOUT(1, uint, found);\nshared uint first;\nuint own() { return gl_LocalInvocationIndex; }";
    let differing = [
        "if (own() == found[0]) { memoryBarrierBuffer(); }",
        "for (uint i = found[0]; i < own(); i++) { barrier(); }",
        "if (gl_GlobalInvocationID.x > found[0]) { return; }\n    barrier();",
        "if (atomicAdd(found[0], 1u) == 0u) { barrier(); }",
        "if (found[own()] == 0u) { barrier(); }",
        "uint sum = 0u;\n    for (uint i = 0u; i < own() + found[0]; i++) { sum += found[i]; }\n    \
         if (sum > 4u) { barrier(); }",
        "uint some[4];\n    some[found[0]] = own();\n    if (some[found[1]] > 4u) { barrier(); }",
        "if (subgroupAdd(found[own()]) > 1u) { barrier(); }",
    ];
    for code in differing {
        probe(body, code, &["glsl/test/probe.comp:1", "1 barriers of probe stand where only some"]);
    }
    let equal = [
        "if (gl_WorkGroupID.x == found[0]) { barrier(); }",
        "if (own() == found[0]) { first = atomicAdd(found[0], 1u); }\n    barrier();\n    if (first > 4u) { barrier(); }",
        "for (uint i = 0u; i < found[0]; i++) {\n    if (found[own()] > i) { found[own()] = i; }\n    barrier();\n    }",
    ];
    for code in equal {
        let shader = small(body, code);
        generate(&[("test/probe.comp", &shader)]).unwrap_or_else(|findings| panic!("{code}: {findings:#?}"));
    }
}
