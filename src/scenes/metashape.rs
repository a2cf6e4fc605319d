//! Agisoft Metashape cameras, as written by "Export Cameras": XML with sensors, components and cameras.
//!
//! A camera's `transform` is camera-to-component with axes x right, y down, z forward; the transform of its component,
//! or of the chunk, leads to the world. Lenses follow appendix D of Metashape's manual: the focal length is in px, the
//! principal point is relative to the photo's centre, and p1 and p2 are swapped relative to OpenCV. In a rig, slaves
//! have only the transform of their sensor in the master's frame.

use super::lens::{Fisheye, Lens, Polynomial};
use super::listed_path::SceneFolder;
use super::listing::{
    ListedPhoto, Listing, check_camera, invert_pose, require_some, rotation_of, side, with_extension,
};
use super::pose_convention::Native;
use glam::{DAffine3, DMat3, DVec3};
use labelgs_files::read;
use labelgs_scene::{Camera, Error, Result};
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use std::path::Path;

/// Most elements and texts of a file; a photo has a dozen.
const NODES_MAX: u32 = 1 << 24;
/// Deepest nesting of elements. The parser recurses for each level; Metashape uses seven.
const DEPTH_MAX: usize = 64;

/// Reads the scene if its folder contains one Metashape XML file.
pub fn list(scene: &SceneFolder) -> Result<Option<Listing>> {
    let is_xml = |path: &std::path::PathBuf| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("xml"));
    let mut found: Vec<_> = read::folder(scene.root)?.into_iter().filter(is_xml).collect();
    found.sort();
    match found.as_slice() {
        [] => Ok(None),
        [path] => list_file(scene, path).map(Some),
        [first, second, ..] => {
            let problem = format!("is not the only such file, see {}; name the one with the cameras", second.display());
            Err(Error::data(first, "", problem))
        }
    }
}

pub fn list_file(scene: &SceneFolder, path: &Path) -> Result<Listing> {
    let text = read::text(path)?;
    if let Some(line) = too_deep(&text) {
        let problem = format!("elements are nested deeper than {DEPTH_MAX}; expected Metashape cameras in XML");
        return Err(Error::data(path, format!("line {line}"), problem));
    }
    let options = ParsingOptions { nodes_limit: NODES_MAX, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&text, options).map_err(|error| {
        Error::data(path, format!("line {}", error.pos().row), format!("{error}; expected Metashape cameras in XML"))
    })?;
    let file = XmlFile { path, document: &document };
    let mut chunks = document.root_element().descendants().filter(|node| node.has_tag_name("chunk"));
    let Some(chunk) = chunks.next() else {
        return Err(Error::data(path, "", "has no `chunk`; expected the XML of Metashape's \"Export Cameras\""));
    };
    let mut listing = Listing::new(path, Native::CAMERA_TO_WORLD);
    if chunks.next().is_some() {
        listing.notes.push(format!("only the first chunk of {} is used", path.display()));
    }
    let chunk = Chunk::new(&file, chunk)?;
    let mut reader = Reader { scene, chunk: &chunk, listing, names: BTreeSet::new(), counts: Counts::default() };
    for camera in chunk.node.descendants().filter(|node| node.has_tag_name("camera") && node.has_attribute("label")) {
        reader.read(camera)?;
    }
    let Reader { mut listing, counts, .. } = reader;
    require_some(listing.views.len(), &mut listing.bad)?;
    let counts = [
        (counts.disabled, "disabled in Metashape and omitted"),
        (counts.lost, "without a pose and omitted: not aligned, or exported without it"),
        (
            counts.slaves,
            "posed as slaves of a rig: by the master's pose, then the sensor's rotation and location. If they are \
             displaced, export the cameras without the rig",
        ),
    ];
    listing.note_counts(path, "camera", &counts);
    Ok(listing)
}

/// Numbers of cameras for notes.
#[derive(Default)]
struct Counts {
    disabled: usize,
    /// Without a pose.
    lost: usize,
    /// Posed by the master of their rig.
    slaves: usize,
}

/// The cameras of a chunk while they are being read.
struct Reader<'a> {
    scene: &'a SceneFolder<'a>,
    chunk: &'a Chunk<'a>,
    listing: Listing,
    names: BTreeSet<String>,
    counts: Counts,
}

impl<'a> Reader<'a> {
    /// Adds a camera to the listing. One that cannot be used only costs its photo.
    fn read(&mut self, camera: Node<'a, 'a>) -> Result<()> {
        if matches!(camera.attribute("enabled"), Some("0" | "false")) {
            self.counts.disabled += 1;
            return Ok(());
        }
        let posed = self.chunk.pose(camera).and_then(|pose| {
            let pose = pose.map(|pose| Ok((self.chunk.view(camera, pose.to_world)?, pose.is_slave)));
            pose.transpose()
        });
        let ((own, lens), is_slave) = match posed {
            Ok(Some(view)) => view,
            Ok(None) => {
                self.counts.lost += 1;
                return Ok(());
            }
            Err(error) => {
                self.listing.bad.push(error);
                return Ok(());
            }
        };
        self.counts.slaves += usize::from(is_slave);
        let label = camera.attribute("label").unwrap_or_default();
        let resolved = self.scene.resolve(self.chunk.file.path, label)?;
        let photo = self.scene.photos.find(&["images", "."], &resolved.path);
        let name = with_extension(resolved.name, photo.as_deref());
        if !self.names.insert(name.clone()) {
            return Err(self.chunk.refusal(camera, "another camera has the same label; rename one of the photos"));
        }
        self.listing.views.push(ListedPhoto { name, photo, camera: own, lens, test: None });
        Ok(())
    }
}

/// Returns the line at which elements are nested deeper than [`DEPTH_MAX`]. Malformed markup may count more, but the
/// parser refuses it.
fn too_deep(text: &str) -> Option<usize> {
    let (mut rest, mut depth) = (text, 0_usize);
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        let skipped =
            [("!--", "-->"), ("![CDATA[", "]]>"), ("?", "?>")].iter().find(|(start, _)| rest.starts_with(start));
        if let Some((_, end)) = skipped {
            rest = rest.find(end).map_or("", |at| &rest[at..]);
        } else if rest.starts_with('/') {
            depth = depth.saturating_sub(1);
        } else {
            // The end of the tag, outside quotes.
            let mut quote = None;
            let end = rest.bytes().position(|byte| match (byte, quote) {
                (b'"' | b'\'', None) => {
                    quote = Some(byte);
                    false
                }
                (byte, Some(open)) => {
                    quote = Some(open).filter(|_| byte != open);
                    false
                }
                (byte, None) => byte == b'>',
            });
            let tag = &rest[..end.unwrap_or(rest.len())];
            depth += usize::from(!tag.ends_with('/'));
            rest = &rest[tag.len()..];
        }
        if depth > DEPTH_MAX {
            return Some(text[..text.len() - rest.len()].matches('\n').count() + 1);
        }
    }
    None
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn child_with_text<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    child(node, name).filter(|node| node.text().is_some_and(|text| !text.trim().is_empty()))
}

/// Finds all elements with a name below a node, by their ids.
fn by_id<'a>(chunk: Node<'a, 'a>, name: &str) -> BTreeMap<&'a str, Node<'a, 'a>> {
    let nodes = chunk.descendants().filter(|node| node.has_tag_name(name));
    nodes.filter_map(|node| Some((node.attribute("id")?, node))).collect()
}

/// A chunk: everything that its cameras refer to by id.
struct Chunk<'a> {
    file: &'a XmlFile<'a>,
    node: Node<'a, 'a>,
    sensors: BTreeMap<&'a str, Node<'a, 'a>>,
    components: BTreeMap<&'a str, Node<'a, 'a>>,
    cameras: BTreeMap<&'a str, Node<'a, 'a>>,
    to_world: Option<DAffine3>,
}

/// The pose of a camera in the world, with axes x right, y down, z forward.
struct Pose {
    to_world: DAffine3,
    /// Whether the pose is derived from another camera of the rig.
    is_slave: bool,
}

impl<'a> Chunk<'a> {
    fn new(file: &'a XmlFile<'a>, node: Node<'a, 'a>) -> Result<Self> {
        let [sensors, components, cameras] = ["sensor", "component", "camera"].map(|name| by_id(node, name));
        Ok(Self { file, node, sensors, components, cameras, to_world: file.similarity(node)? })
    }

    fn place(&self, camera: Node) -> String {
        format!("{}, camera `{}`", self.file.line(camera), camera.attribute("label").unwrap_or_default())
    }

    fn refusal(&self, camera: Node, problem: &str) -> Error {
        Error::data(self.file.path, self.place(camera), problem)
    }

    /// Returns the pose of a camera; `None` if it is not aligned. A rig slave without its own pose gets its sensor's in
    /// the master's frame.
    fn pose(&self, camera: Node<'a, 'a>) -> Result<Option<Pose>> {
        if let Some(transform) = child(camera, "transform") {
            let to_world = self.to_world(camera)? * self.file.matrix(transform)?;
            return Ok(Some(Pose { to_world, is_slave: false }));
        }
        let master = camera.attribute("master_id").and_then(|id| self.cameras.get(id));
        let Some((&master, transform)) = master.and_then(|master| Some((master, child(*master, "transform")?))) else {
            return Ok(None);
        };
        let of_master = self.to_world(master)? * self.file.matrix(transform)?;
        let in_master = self.file.mounting(self.sensor(camera)?)?.ok_or_else(|| {
            let problem = "is a slave of a rig, but its sensor has no `rotation` and `location`; export the cameras \
                           without the rig";
            self.refusal(camera, problem)
        })?;
        Ok(Some(Pose { to_world: of_master * in_master, is_slave: true }))
    }

    /// Returns the posed camera and its lens.
    fn view(&self, camera: Node<'a, 'a>, to_world: DAffine3) -> Result<(Camera, Lens)> {
        let (intrinsics, lens) = self.file.sensor(self.sensor(camera)?)?;
        let problem = "the transform is not a rotation with a scale; export the cameras again";
        let rotation = rotation_of(to_world.matrix3).ok_or_else(|| self.refusal(camera, problem))?;
        let (rotation, translation) = invert_pose(rotation, to_world.translation);
        let own = Camera { rotation, translation, ..intrinsics };
        check_camera(self.file.path, &self.place(camera), &own, &lens)?;
        Ok((own, lens))
    }

    fn sensor(&self, camera: Node) -> Result<Node<'a, 'a>> {
        let sensor = camera.attribute("sensor_id").and_then(|id| self.sensors.get(id)).copied();
        sensor.ok_or_else(|| self.refusal(camera, "names no sensor of the chunk; export the cameras again"))
    }

    /// Returns the transform of a camera's component, which overrides the chunk's. A file may have no components.
    fn to_world(&self, camera: Node) -> Result<DAffine3> {
        let own = match camera.attribute("component_id") {
            Some(id) if !self.components.is_empty() => match self.components.get(id) {
                Some(&component) => self.file.similarity(component)?,
                None => return Err(self.refusal(camera, "names no component of the chunk; export the cameras again")),
            },
            _ => None,
        };
        Ok(own.or(self.to_world).unwrap_or(DAffine3::IDENTITY))
    }
}

/// A parsed file, for messages.
struct XmlFile<'a> {
    path: &'a Path,
    document: &'a Document<'a>,
}

impl<'a> XmlFile<'a> {
    fn line(&self, node: Node) -> String {
        format!("line {}", self.document.text_pos_at(node.range().start).row)
    }

    fn refuse<T>(&self, node: Node, problem: impl Into<String>) -> Result<T> {
        Err(Error::data(self.path, self.line(node), problem))
    }

    fn numbers<const N: usize>(&self, node: Node) -> Result<[f64; N]> {
        let words: Vec<&str> = node.text().unwrap_or_default().split_whitespace().collect();
        let numbers: Option<Vec<f64>> =
            words.iter().map(|word| word.parse().ok().filter(|value: &f64| value.is_finite())).collect();
        match numbers.and_then(|numbers| numbers.try_into().ok()) {
            Some(numbers) => Ok(numbers),
            None => self.refuse(node, format!("`{}` does not hold {N} finite numbers", node.tag_name().name())),
        }
    }

    /// Reads the number in a child; 0 if it is missing.
    fn number(&self, node: Node<'a, 'a>, name: &str) -> Result<f64> {
        child(node, name).map_or(Ok(0.0), |child| self.numbers::<1>(child).map(|[value]| value))
    }

    /// Reads a 4 x 4 matrix, row-major.
    fn matrix(&self, node: Node) -> Result<DAffine3> {
        let m: [f64; 16] = self.numbers(node)?;
        let column = |index: usize| DVec3::new(m[index], m[4 + index], m[8 + index]);
        let matrix3 = DMat3::from_cols(column(0), column(1), column(2));
        Ok(DAffine3 { matrix3, translation: column(3) })
    }

    /// Reads the `transform` of a chunk or a component: rotation (row-major), translation and scale.
    fn similarity(&self, node: Node<'a, 'a>) -> Result<Option<DAffine3>> {
        let Some(transform) = child(node, "transform") else { return Ok(None) };
        let motion = self.motion(transform, "translation")?;
        let scale = child(transform, "scale").map_or(Ok([1.0]), |node| self.numbers::<1>(node))?;
        Ok(Some(DAffine3 { matrix3: motion.matrix3 * scale[0], ..motion }))
    }

    /// Reads how a sensor is mounted in a rig: the transform from its axes to the master's, with its centre in chunk
    /// units. `None` if the sensor does not specify it.
    fn mounting(&self, sensor: Node<'a, 'a>) -> Result<Option<DAffine3>> {
        let says = ["rotation", "location"].into_iter().any(|name| child_with_text(sensor, name).is_some());
        says.then(|| self.motion(sensor, "location")).transpose()
    }

    /// Reads the child `rotation`, row-major, and the child called `place`; missing ones are the identity.
    fn motion(&self, node: Node<'a, 'a>, place: &str) -> Result<DAffine3> {
        let rotation = child_with_text(node, "rotation").map(|node| self.numbers::<9>(node)).transpose()?;
        let matrix3 = rotation.map_or(DMat3::IDENTITY, |rows| DMat3::from_cols_array(&rows).transpose());
        let place = child_with_text(node, place).map(|node| self.numbers::<3>(node)).transpose()?;
        Ok(DAffine3 { matrix3, translation: place.map_or(DVec3::ZERO, DVec3::from_array) })
    }

    /// Reads a sensor: intrinsics at an identity pose, and the lens.
    fn sensor(&self, sensor: Node<'a, 'a>) -> Result<(Camera, Lens)> {
        let place = format!("{}, sensor {}", self.line(sensor), sensor.attribute("id").unwrap_or_default());
        let mut calibrations = sensor.children().filter(|child| child.has_tag_name("calibration"));
        let first = calibrations.clone().next();
        let calibration = calibrations.find(|child| child.attribute("class") == Some("adjusted")).or(first);
        let resolution = calibration.and_then(|node| child(node, "resolution")).or(child(sensor, "resolution"));
        let Some(resolution) = resolution else {
            return self.refuse(sensor, "the sensor has no `resolution`; export the cameras of aligned photos");
        };
        let pixels = |name: &str| {
            let value = resolution.attribute(name).and_then(|text| text.parse().ok()).unwrap_or(f64::NAN);
            side(self.path, &place, value)
        };
        let size = (pixels("width")?, pixels("height")?);
        let (w, h) = (f64::from(size.0), f64::from(size.1));
        let kind = sensor.attribute("type").unwrap_or("frame");
        if kind == "spherical" {
            // Pixels are square: what is missing at the top and bottom was cropped.
            let f = w / (2.0 * PI);
            return Ok((Camera::at_origin([f, f, w / 2.0, h / 2.0], size), Lens::Equirectangular));
        }
        let Some(calibration) = calibration else {
            return self.refuse(sensor, "the sensor has no `calibration`; export the cameras of aligned photos");
        };
        if let Some(other) = calibration.attribute("type").filter(|&other| other != kind) {
            let problem =
                format!("the sensor is of type {kind}, but its calibration of type {other}; export the cameras again");
            return Err(Error::data(self.path, place, problem));
        }
        let value = |name: &str| self.number(calibration, name);
        if let Some(name) = ["p3", "p4"].into_iter().find(|name| value(name).is_ok_and(|value| value != 0.0)) {
            let problem =
                format!("the calibration has {name}, which is not supported; optimize the cameras without it");
            return Err(Error::data(self.path, place, problem));
        }
        let f = value("f")?;
        let (fx, cx, cy) = (f + value("b1")?, w / 2.0 + value("cx")?, h / 2.0 + value("cy")?);
        let radial = [value("k1")?, value("k2")?, value("k3")?, value("k4")?];
        let (tangential, skew) = ([value("p2")?, value("p1")?], value("b2")? / fx);
        let lens = match kind {
            "frame" => Polynomial { numerator: radial, tangential, skew, ..Polynomial::default() }.into(),
            "fisheye" => Lens::Fisheye(Fisheye { radial, tangential, skew, ..Fisheye::default() }),
            other => {
                let problem =
                    format!("a sensor of type {other} is not supported; expected frame, fisheye or spherical");
                return Err(Error::data(self.path, place, problem));
            }
        };
        Ok((Camera::at_origin([fx, f, cx, cy], size), lens))
    }
}
