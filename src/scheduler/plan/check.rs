//! Checks a pass list against the shaders' interfaces and the device's limits, before planning.

use super::Limits;
use super::buffers::{Buf, BufferDecl, Count, Table};
use super::name;
use super::pass::{Grid, PassDecl, PassList, Work};
use crate::error::{Error, Result};
use crate::shaders::{BindingDesc, BindingKind};

/// Checks every item of a list.
pub(super) fn list(table: &'static Table, sizes: &[u64], list: &PassList, limits: &Limits) -> Result<()> {
    for work in &list.work {
        match work {
            Work::Pass(pass) => check_pass(table, sizes, pass, limits)
                .map_err(|error| if let Error::Bug(what) = error { in_pass(list, pass, &what) } else { error })?,
            Work::Fill { buf, .. } => row(table, *buf).map(|_| ())?,
            Work::Copy { from, to, bytes, .. } => check_copy(table, sizes, *from, *to, *bytes)?,
        }
    }
    Ok(())
}

fn in_pass(list: &PassList, pass: &PassDecl, what: &str) -> Error {
    Error::Bug(format!("pass {} of list {}: {what}", pass.label, list.name))
}

fn row(table: &'static Table, buf: Buf) -> Result<&'static BufferDecl> {
    table.get(buf.index()).ok_or_else(|| Error::Bug(format!("there is no buffer {} in the table", buf.0)))
}

fn check_copy(table: &'static Table, sizes: &[u64], from: Buf, to: Buf, bytes: u64) -> Result<()> {
    row(table, from)?;
    row(table, to)?;
    let most = sizes[from.index()].min(sizes[to.index()]);
    if from == to || bytes > most || !bytes.is_multiple_of(4) {
        let (from, to) = (name(table, from), name(table, to));
        return Err(Error::Bug(format!(
            "copy of {bytes} bytes from {from} to {to}: expected two different buffers, a multiple of 4 bytes, at \
            most {most}"
        )));
    }
    Ok(())
}

fn check_pass(table: &'static Table, sizes: &[u64], pass: &PassDecl, limits: &Limits) -> Result<()> {
    let shader = pass.shader;
    let expect = |what: &str, found: usize, expected: usize| {
        let problem = || Error::Bug(format!("{found} {what} given, the shader has {expected}"));
        if found == expected { Ok(()) } else { Err(problem()) }
    };
    expect("buffers", pass.buffers.len(), shader.bindings.len())?;
    if !pass.spec.is_empty() {
        expect("specialisation constants", pass.spec.len(), shader.spec.len())?;
    }
    check_counts(pass, limits)?;
    check_grid(table, sizes, pass, limits)?;
    for (binding, &buf) in shader.bindings.iter().zip(&pass.buffers) {
        let decl = row(table, buf)?;
        match binding.kind {
            BindingKind::Storage => check_storage(decl, sizes[buf.index()], binding, limits)?,
            BindingKind::Texel => check_texel(decl, sizes[buf.index()], binding, limits)?,
        }
    }
    Ok(())
}

fn check_counts(pass: &PassDecl, limits: &Limits) -> Result<()> {
    let texel = pass.shader.bindings.iter().filter(|binding| binding.kind == BindingKind::Texel).count();
    let storage = pass.shader.bindings.len() - texel;
    for (what, found, limit) in
        [("storage", storage, limits.max_storage_buffers), ("texel", texel, limits.max_texel_buffers)]
    {
        if found > limit as usize {
            let problem = format!(
                "the shader {} has {found} {what} buffers; the device supports at most {limit}",
                pass.shader.name
            );
            return Err(Error::NoDevice(problem));
        }
    }
    Ok(())
}

fn check_grid(table: &'static Table, sizes: &[u64], pass: &PassDecl, limits: &Limits) -> Result<()> {
    match pass.grid {
        Grid::Groups(x, y, z) => {
            let fits = [x, y, z].iter().zip(&limits.max_groups).all(|(count, limit)| count <= limit);
            let problem = || format!("{x} x {y} x {z} workgroups; the device supports at most {:?}", limits.max_groups);
            if fits { Ok(()) } else { Err(Error::Bug(problem())) }
        }
        Grid::Indirect(buf, offset) => {
            let decl = row(table, buf)?;
            let inside = u64::from(offset) + 12 <= sizes[buf.index()] && offset.is_multiple_of(4);
            let problem = || format!("indirect arguments at byte {offset} of {}: outside of the buffer", decl.name);
            if inside { Ok(()) } else { Err(Error::Bug(problem())) }
        }
    }
}

fn check_storage(decl: &BufferDecl, bytes: u64, binding: &BindingDesc, limits: &Limits) -> Result<()> {
    let (ours, shaders) = (decl.element_bytes, binding.element_bytes);
    // In a buffer of fixed size, a shader's struct may span several elements. In other buffers, wider elements would
    // read past the end.
    let fixed = matches!(decl.domain.count, Count::Fixed(_)) && shaders.is_multiple_of(ours);
    let divides = shaders == 0 || ours.is_multiple_of(shaders) || fixed;
    if !divides || bytes < u64::from(shaders) {
        let (name, block) = (decl.name, binding.name);
        return Err(Error::Bug(format!(
            "buffer {name} ({bytes} bytes, elements of {ours}) is bound as {block}, whose elements have {shaders} bytes"
        )));
    }
    // Compare without the guard: it exists in tests only, and the message would name a size that includes it.
    if bytes <= limits.max_storage_range {
        return Ok(());
    }
    Err(Error::OutOfMemory {
        what: decl.name.to_owned(),
        needed: bytes,
        limit_name: "the largest storage binding of this device".to_owned(),
        limit: limits.max_storage_range,
        cure: (decl.domain.cure)(limits.max_storage_range / u64::from(ours)),
    })
}

fn check_texel(decl: &BufferDecl, bytes: u64, binding: &BindingDesc, limits: &Limits) -> Result<()> {
    let Some(format) = decl.texel else {
        let (name, block) = (decl.name, binding.name);
        return Err(Error::Bug(format!("buffer {name} has no texel format but is bound as the texel buffer {block}")));
    };
    let texel = u64::from(format.bytes());
    if !u64::from(decl.element_bytes).is_multiple_of(texel) {
        let (name, ours) = (decl.name, decl.element_bytes);
        return Err(Error::Bug(format!(
            "elements of {name} have {ours} bytes; expected a multiple of the texel size, {texel}"
        )));
    }
    if bytes / texel <= limits.max_texel_elements {
        return Ok(());
    }
    Err(Error::OutOfMemory {
        what: format!("{} (read as texels)", decl.name),
        needed: bytes,
        limit_name: "the largest texel view of this device".to_owned(),
        limit: limits.max_texel_elements * texel,
        cure: (decl.domain.cure)(limits.max_texel_elements * texel / u64::from(decl.element_bytes)),
    })
}
