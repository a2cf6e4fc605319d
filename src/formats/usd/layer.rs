//! Parses the prims with Gaussians in a text layer, and the prims around them.

use super::text::{Scanner, Span};
use super::{
    CONFIDENCE_ATTRIBUTE, DEGREE_ATTRIBUTE, HARMONICS_ATTRIBUTE, MAGIC, OPACITIES_ATTRIBUTE, ORIENTATIONS_ATTRIBUTE,
    OWN_DICTIONARY, POSITIONS_ATTRIBUTE, SCALES_ATTRIBUTE, SEMANTICS_PREFIX, SPLATS_SCHEMA, xform,
};
use glam::DMat4;
use labelgs_scene::Result;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::FRAC_PI_2;

/// Deepest nesting of prims.
const DEPTH_MAX: usize = 256;
/// Words before the type of an attribute.
const ATTRIBUTE_MODIFIERS: [&str; 8] = ["custom", "uniform", "varying", "config", "prepend", "append", "delete", "add"];
/// Metadata keys by which a prim or a layer includes content from elsewhere.
const ARC_KEYS: [&str; 6] = ["references", "payload", "inherits", "specializes", "subLayers", "variantSets"];

/// A prim with Gaussians.
#[derive(Debug)]
pub(super) struct SplatPrim<'a> {
    /// Offset of the prim in the text.
    pub(super) at: usize,
    pub(super) attributes: BTreeMap<&'a str, Span>,
    /// The dictionary of labelgs, if the prim has one.
    pub(super) own: BTreeMap<&'a str, Span>,
    /// Its display name.
    pub(super) title: Option<Span>,
    /// The semantic label of the prim or of a prim around it.
    pub(super) semantic: Option<Span>,
    /// Transform from the prim's axes to those of a stage with y up.
    pub(super) matrix: DMat4,
    /// Whether the prim resets the transforms of the prims around it.
    is_free: bool,
}

/// The supported content of a layer.
#[derive(Debug, Default)]
pub(super) struct Layer<'a> {
    pub(super) parts: Vec<SplatPrim<'a>>,
    /// The dictionary of labelgs, if the layer has one.
    pub(super) own: BTreeMap<&'a str, Span>,
    pub(super) notes: BTreeSet<String>,
}

/// A prim whose closing brace has not been read.
#[derive(Default)]
struct OpenPrim<'a> {
    at: usize,
    name: &'a str,
    /// Whether the prim is drawn if it has Gaussians.
    is_defined: bool,
    /// False if the prim and its descendants are switched off.
    is_active: bool,
    kind: &'a str,
    attributes: BTreeMap<&'a str, Span>,
    own: BTreeMap<&'a str, Span>,
    title: Option<Span>,
    parts: Vec<SplatPrim<'a>>,
}

/// Reads a layer.
pub(super) fn read<'a>(scanner: &mut Scanner<'a>) -> Result<Layer<'a>> {
    if !scanner.starts(MAGIC) {
        return Err(scanner.bad(0, format!("does not start with `{MAGIC}`; this is not a USD text layer")));
    }
    scanner.skip(MAGIC.len());
    let mut layer = Layer::default();
    let mut is_z_up = false;
    for (key, value) in metadata(scanner)? {
        is_z_up |= key == "upAxis" && scanner.part(value).contains('Z');
        if key == "customLayerData" {
            layer.own = own(scanner, value)?;
        }
        layer.note_arc(key);
    }
    let root = if is_z_up { DMat4::from_rotation_x(-FRAC_PI_2) } else { DMat4::IDENTITY };
    let mut stack: Vec<OpenPrim> = Vec::new();
    while let Some(byte) = scanner.peek() {
        if byte == b'}' {
            let Some(frame) = stack.pop() else {
                return Err(scanner.bad(scanner.at(), "`}` closes nothing; correct it"));
            };
            scanner.skip(1);
            let parts = layer.close(scanner, frame)?;
            match stack.last_mut() {
                Some(around) => around.parts.extend(parts),
                None => layer.parts.extend(parts),
            }
            continue;
        }
        layer.statement(scanner, &mut stack)?;
    }
    if let Some(frame) = stack.last() {
        let problem = format!("the prim \"{}\" has no end; the file was cut short", frame.name);
        return Err(scanner.bad(frame.at, problem));
    }
    for part in &mut layer.parts {
        part.matrix = root * part.matrix;
    }
    Ok(layer)
}

impl<'a> Layer<'a> {
    fn note_arc(&mut self, key: &str) {
        if ARC_KEYS.contains(&key) {
            self.notes.insert(format!("its {key} were omitted; flatten it first, for example with usdcat"));
        }
    }

    /// Reads an attribute, or the start of a prim up to its attributes.
    fn statement(&mut self, scanner: &mut Scanner<'a>, stack: &mut Vec<OpenPrim<'a>>) -> Result<()> {
        let at = scanner.at();
        match scanner.name("a prim or an attribute")? {
            word @ ("def" | "over" | "class") => {
                if stack.len() >= DEPTH_MAX {
                    return Err(scanner.bad(at, format!("nests prims deeper than {DEPTH_MAX}; export it flat")));
                }
                stack.push(self.open(scanner, at, word)?);
            }
            "variantSet" => {
                scanner.string()?;
                scanner.need(b'=', "a set of variants")?;
                scanner.value()?;
                self.note_arc("variantSets");
            }
            "reorder" => {
                scanner.name("what is ordered")?;
                scanner.need(b'=', "what is ordered")?;
                scanner.value()?;
            }
            word => {
                let found = attribute(scanner, word)?;
                if let (Some((name, value)), Some(frame)) = (found, stack.last_mut()) {
                    frame.attributes.insert(name, value);
                }
            }
        }
        Ok(())
    }

    /// Reads the start of a prim up to its attributes.
    fn open(&mut self, scanner: &mut Scanner<'a>, at: usize, word: &str) -> Result<OpenPrim<'a>> {
        let kind = scanner.word();
        let name = scanner.string()?;
        let mut frame = OpenPrim { at, name, is_defined: word == "def", is_active: true, kind, ..OpenPrim::default() };
        for (key, value) in metadata(scanner)? {
            match key {
                "active" => frame.is_active = is_true(scanner.part(value)),
                "displayName" => frame.title = Some(value),
                "customData" => frame.own = own(scanner, value)?,
                _ => self.note_arc(key),
            }
        }
        scanner.need(b'{', "a prim")?;
        Ok(frame)
    }

    /// Returns the prims with Gaussians in a closed prim, including itself.
    fn close(&mut self, scanner: &Scanner<'a>, frame: OpenPrim<'a>) -> Result<Vec<SplatPrim<'a>>> {
        let OpenPrim { at, is_defined, is_active, kind, attributes, own, title, mut parts, .. } = frame;
        // Classes and overrides are drawn elsewhere.
        if !is_defined || !is_active {
            if !parts.is_empty() || kind == SPLATS_SCHEMA {
                self.notes.insert("its prims that are switched off or not defined here were omitted".into());
            }
            return Ok(Vec::new());
        }
        let semantic = attributes.iter().find(|(name, _)| name.starts_with(SEMANTICS_PREFIX)).map(|(_, &value)| value);
        let (matrix, is_free) = if parts.is_empty() && kind != SPLATS_SCHEMA {
            (DMat4::IDENTITY, false)
        } else {
            xform::local(scanner, at, &attributes)?
        };
        for part in &mut parts {
            part.semantic = part.semantic.or(semantic);
            if !part.is_free {
                (part.matrix, part.is_free) = (matrix * part.matrix, is_free);
            }
        }
        if kind == SPLATS_SCHEMA {
            parts.push(SplatPrim { at, attributes, own, title, semantic, matrix, is_free });
        }
        Ok(parts)
    }
}

/// Returns true for `true` and 1.
pub(super) fn is_true(text: &str) -> bool {
    matches!(text, "true" | "1")
}

/// Reads the attribute that starts with `word`. Returns it if it has a value and may be needed.
fn attribute<'a>(scanner: &mut Scanner<'a>, word: &'a str) -> Result<Option<(&'a str, Span)>> {
    let mut kind = word;
    while ATTRIBUTE_MODIFIERS.contains(&kind) {
        kind = scanner.name("the type of an attribute")?;
    }
    if scanner.take(b'[') {
        scanner.need(b']', "the type of an attribute")?;
    }
    let name = scanner.name("the name of an attribute")?;
    let value = if scanner.take(b'=') { Some(scanner.value()?) } else { None };
    metadata(scanner)?;
    let numbers =
        [POSITIONS_ATTRIBUTE, ORIENTATIONS_ATTRIBUTE, SCALES_ATTRIBUTE, OPACITIES_ATTRIBUTE, HARMONICS_ATTRIBUTE];
    let is_needed = numbers.contains(&name.strip_suffix('h').unwrap_or(name))
        || numbers.contains(&name)
        || [DEGREE_ATTRIBUTE, CONFIDENCE_ATTRIBUTE].contains(&name)
        || name.starts_with(SEMANTICS_PREFIX)
        || name.starts_with(xform::XFORM_PREFIX);
    // The value `None` means no value.
    let value = value.filter(|&value| is_needed && scanner.part(value) != "None");
    Ok(value.map(|value| (name, value)))
}

/// Reads the keys and values in parentheses, if there are any.
fn metadata<'a>(scanner: &mut Scanner<'a>) -> Result<Vec<(&'a str, Span)>> {
    let mut all = Vec::new();
    if !scanner.take(b'(') {
        return Ok(all);
    }
    while !scanner.take(b')') {
        // A lone string is a comment.
        if matches!(scanner.peek(), Some(b'"' | b'\'')) {
            scanner.string()?;
            continue;
        }
        let mut key = scanner.name("a key or `)`")?;
        while ATTRIBUTE_MODIFIERS.contains(&key) || key == "reorder" {
            key = scanner.name("a key")?;
        }
        scanner.need(b'=', key)?;
        all.push((key, scanner.value()?));
    }
    Ok(all)
}

/// Returns the keys and values of the labelgs dictionary within a dictionary, or nothing.
fn own<'a>(scanner: &Scanner<'a>, value: Span) -> Result<BTreeMap<&'a str, Span>> {
    match dictionary(scanner, value)?.iter().rfind(|(key, _)| *key == OWN_DICTIONARY) {
        Some(&(_, own)) => Ok(dictionary(scanner, own)?.into_iter().collect()),
        None => Ok(BTreeMap::new()),
    }
}

/// Returns the keys and values of a dictionary.
fn dictionary<'a>(scanner: &Scanner<'a>, value: Span) -> Result<Vec<(&'a str, Span)>> {
    let (mut inside, mut all) = (scanner.within(value), Vec::new());
    inside.need(b'{', "a dictionary's name")?;
    while !inside.take(b'}') {
        inside.name("a type or `}`")?;
        if inside.take(b'[') {
            inside.need(b']', "a type")?;
        }
        let is_quoted = matches!(inside.peek(), Some(b'"' | b'\''));
        let key = if is_quoted { inside.string()? } else { inside.name("a key")? };
        inside.need(b'=', key)?;
        all.push((key, inside.value()?));
        inside.take(b',');
    }
    Ok(all)
}
