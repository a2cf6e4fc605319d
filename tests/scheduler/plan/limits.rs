//! Plans that exceed a limit or mismatch a shader are refused; the error names the buffer, the number and the remedy.

use super::*;
use labelgs::Error;
use labelgs::cli::support::exit_status::exit_status;

fn plan_with(list: &PassList, limits: &Limits) -> labelgs::Result<Plan> {
    Plan::new(table::TABLE, &counts(), list, limits, PlanOptions::default())
}

fn one(pass: PassDecl) -> PassList {
    let mut list = PassList::new("one");
    list.pass(pass);
    list
}

const GROUP: Grid = Grid::Groups(1, 1, 1);

#[test]
fn a_binding_that_is_too_large_names_the_capacity_that_fits() {
    let list = one(pass("read", &[(MODEL, Access::Read)], GROUP));
    let limits = Limits { max_storage_range: 15_999, ..Limits::default() };
    let error = plan_with(&list, &limits).unwrap_err();
    assert_eq!(
        error.to_string(),
        "model needs 16000 bytes, the largest storage binding of this device is 15999 bytes; \
         lower `max_gaussians` to 999 or use another device"
    );
    assert_eq!(exit_status(&error), 5);
    plan_with(&list, &Limits { max_storage_range: 16_000, ..Limits::default() }).unwrap();
}

#[test]
fn allocations_and_sums_are_checked() {
    let list = one(pass("write", &[(D, Access::Write)], GROUP));
    let limits = Limits { max_allocation: 30_000, ..Limits::default() };
    let message = plan_with(&list, &limits).unwrap_err().to_string();
    assert!(message.starts_with("d needs 59392 bytes") && message.contains("instances fit"), "{message}");
    let options = PlanOptions::default();
    let predict = |max_memory| {
        let limits = Limits { max_memory, ..Limits::default() };
        MemoryReport::predict(table::TABLE, &counts(), std::slice::from_ref(&list), &limits, options)
    };
    let total = predict(u64::MAX).unwrap().total;
    assert_eq!(predict(total).unwrap().total, total);
    let error = predict(total - 1).unwrap_err();
    assert!(matches!(error, Error::OutOfMemory { needed, .. } if needed == total), "{error}");
}

#[test]
fn a_texel_view_that_is_too_large_is_refused() {
    let mut list = one(pass("write", &[(A, Access::Write)], GROUP));
    let mut texel = shader("fetch", &[Access::Read]).bindings.to_vec();
    texel[0].kind = BindingKind::Texel;
    let fetch = ShaderDesc { bindings: Box::leak(texel.into_boxed_slice()), ..*shader("fetch", &[]) };
    list.pass(PassDecl::new(Box::leak(Box::new(fetch)), vec![A], GROUP));
    plan_with(&list, &Limits { max_texel_elements: 777, ..Limits::default() }).unwrap();
    let message = plan_with(&list, &Limits { max_texel_elements: 776, ..Limits::default() }).unwrap_err().to_string();
    assert!(message.starts_with("a (read as texels) needs 3108 bytes") && message.contains("776"), "{message}");
    let mut wrong = list.clone();
    if let Work::Pass(pass) = &mut wrong.work[1] {
        pass.buffers = vec![LABELS];
    }
    let message = plan_with(&wrong, &Limits::default()).unwrap_err().to_string();
    assert!(message.contains("labels has no texel format"), "{message}");
}

#[test]
fn declarations_that_do_not_match_their_shader_are_bugs() {
    let two = || pass("two", &[(MODEL, Access::Read), (A, Access::Write)], GROUP);
    let mut few = two();
    few.buffers.pop();
    let wide = Grid::Groups(70_000, 1, 1);
    let mut odd = PassList::new("copy");
    odd.copy(MODEL, LABELS, 4001);
    for (list, expected) in [
        (one(few), "1 buffers given, the shader has 2"),
        (one(two().spec(vec![1])), "1 specialisation constants given, the shader has 0"),
        (one(pass("wide", &[(A, Access::Write)], wide)), "70000 x 1 x 1 workgroups"),
        (one(pass("far", &[(A, Access::Write)], Grid::Indirect(TOTALS, 0))), "indirect arguments at byte 0 of totals"),
        (one(pass("none", &[(Buf(77), Access::Write)], GROUP)), "no buffer 77"),
        (one(pass("early", &[(A, Access::Read)], GROUP)), "early reads the scratch buffer a before anything"),
        (odd, "copy of 4001 bytes from model to labels"),
    ] {
        let error = plan_with(&list, &Limits::default()).unwrap_err();
        assert!(matches!(error, Error::Bug(_)) && error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn a_shader_block_must_fit_its_buffer() {
    let mut bindings = shader("wide", &[Access::Read]).bindings.to_vec();
    bindings[0].element_bytes = 12;
    let wide = ShaderDesc { bindings: Box::leak(bindings.into_boxed_slice()), ..*shader("wide", &[]) };
    let wide: &'static ShaderDesc = Box::leak(Box::new(wide));
    plan_with(&one(PassDecl::new(wide, vec![UNIFORMS], GROUP)), &Limits::default()).unwrap();
    for buf in [MODEL, TOTALS] {
        let message =
            plan_with(&one(PassDecl::new(wide, vec![buf], GROUP)), &Limits::default()).unwrap_err().to_string();
        assert!(message.contains("whose elements have 12 bytes"), "{message}");
    }
}

#[test]
fn a_scene_without_gaussians_can_be_planned() {
    let none = Capacity::default().counts();
    let plan = Plan::new(table::TABLE, &none, &small_list(), &Limits::default(), PlanOptions::default()).unwrap();
    assert_eq!(plan.placement(MODEL).unwrap().bytes, 16, "room for one element");
}

#[test]
fn capacities_grow_by_half_or_twofold_and_past_the_need() {
    assert_eq!(Capacity::grown(1000, 1001, false), 1500);
    assert_eq!(Capacity::grown(1000, 1001, true), 2000);
    for on_card in [false, true] {
        assert_eq!(Capacity::grown(1000, 5000, on_card), 5500);
        assert_eq!(Capacity::grown(u64::MAX, 1, on_card), u64::MAX);
    }
}
