//! CityGML 1.0 to 3.0, turned into the CityJSON that says the same.
//!
//! Of each object the surfaces of the highest level of detail are read: those that it is bounded by, which have kinds
//! (wall, roof, window), and others; surfaces that are named by reference are read once. Parts are its children.
//! Pictures lie by the coordinates of rings (`ParameterizedTexture`). Positions in degrees are laid on the plane that
//! touches the ellipsoid at the origin.

use glam::{DMat3, DVec3};
use roxmltree::{Document as Tree, Node, NodeId};
use serde_json::{Map, Value, json};
use std::collections::{HashMap, HashSet};

use super::super::document::Document;
use super::cityjson::{self, Appearance, City, CityMaterial, CityTexture};
use super::{ReadOptions, Reader};
use crate::error::{Error, Result};
use crate::math;

/// Reference systems in degrees of latitude and longitude, by EPSG number: the world's, Europe's, Japan's, America's,
/// Australia's and China's.
const DEGREES: [u32; 13] =
    [4326, 4979, 4258, 4937, 6697, 6668, 6667, 4612, 4269, 6318, 4283, 7844, 4490];

/// How deep elements lie in each other, at most.
const DEEPEST: u32 = 100;

/// Reads a file. If its positions are in degrees, the origin of the options is one too, and is taken out of them.
pub(super) fn read(
    reader: &mut Reader,
    bytes: &[u8],
    options: &mut ReadOptions,
) -> Result<Document> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        reader.fault(format!("not UTF-8 at byte {}: save it as UTF-8", e.valid_up_to()))
    })?;
    let tree = Tree::parse(text).map_err(|e| {
        let at = e.pos();
        let (line, column) = (at.row as usize, at.col as usize);
        Error::at_line(&reader.path, line, column, format!("not CityGML: {e}"))
    })?;
    let root = tree.root_element();
    if name(root) != "CityModel" {
        let kind = name(root);
        return Err(
            reader.fault(format!("an XML file of \"{kind}\": expected CityGML's CityModel"))
        );
    }
    let mut converter = Converter::new(reader, root);
    converter.appearance()?;
    for member in root.children().filter(|node| name(*node) == "cityObjectMember") {
        for object in member.children().filter(Node::is_element) {
            converter.object(object, None, 0)?;
        }
    }
    let Converter { objects, vertices, materials, textures, places, empty, dead, .. } = converter;
    let left_out =
        [(empty, "surfaces without corners are left out"), (dead, "references lead to nothing")];
    for (LeftOut { count, first }, what) in left_out.into_iter().filter(|(some, _)| some.count > 0)
    {
        reader.note(format!("{count} {what}; the first: {first}"));
    }
    let vertices = match in_degrees(root) {
        true => flat(reader, &vertices, options)?,
        false => vertices,
    };
    let appearance = Appearance { materials, textures, places };
    let (kind, version) = ("CityJSON".to_owned(), "2.0".to_owned());
    let city =
        City { kind, version, objects, vertices, transform: None, appearance, templates: None };
    cityjson::build(reader, &city)
}

/// How many objects a surface belongs to, at most, in the mean of a file.
const MOST_USES: usize = 16;

/// Whether an element is a surface with rings.
fn is_polygon(node: Node<'_, '_>) -> bool {
    matches!(name(node), "Polygon" | "PolygonPatch" | "Triangle" | "Rectangle")
}

/// The text of an element, whatever comments stand in it.
fn text_of(node: Node<'_, '_>) -> String {
    node.children().filter(Node::is_text).filter_map(|text| text.text()).collect()
}

/// The name of an element without its namespace.
fn name<'x>(node: Node<'x, '_>) -> &'x str {
    node.tag_name().name()
}

/// An attribute, whatever its namespace.
fn attribute<'x>(node: Node<'x, '_>, name: &str) -> Option<&'x str> {
    node.attributes().find(|attribute| attribute.name() == name).map(|found| found.value())
}

/// What a reference within the file points to.
fn target(reference: &str) -> &str {
    reference.trim().trim_start_matches('#')
}

/// Whether positions are degrees, as the first reference system says.
fn in_degrees(root: Node<'_, '_>) -> bool {
    let system = root.descendants().find_map(|node| attribute(node, "srsName")).unwrap_or("");
    let mut numbers = system.split(|c: char| !c.is_ascii_digit()).map(str::parse);
    numbers.any(|number| number.is_ok_and(|number: u32| DEGREES.contains(&number)))
}

/// Takes latitudes, longitudes and heights to metres east, north and up.
fn flat(
    reader: &mut Reader,
    positions: &[[f64; 3]],
    options: &mut ReadOptions,
) -> Result<Vec<[f64; 3]>> {
    // Across the meridian of 180 degrees they go on.
    let is_across = positions.iter().any(|p| p[1] > 90.0) && positions.iter().any(|p| p[1] < -90.0);
    let shift =
        |p: &[f64; 3]| if is_across && p[1] < 0.0 { [p[0], p[1] + 360.0, p[2]] } else { *p };
    let positions: Vec<[f64; 3]> = positions.iter().map(shift).collect();
    let bound = |axis: usize| {
        let values = positions.iter().map(|position| position[axis]);
        let low = values.clone().fold(f64::INFINITY, f64::min);
        (low, values.fold(f64::NEG_INFINITY, f64::max))
    };
    let bounds = [bound(0), bound(1)];
    if positions.is_empty() {
        return Ok(Vec::new());
    }
    for ((low, high), most) in bounds.into_iter().zip([90.0, if is_across { 360.0 } else { 180.0 }])
    {
        if low < -most || high > most {
            return Err(reader.fault(format!(
                "its reference system is in degrees, and positions go from {low} to {high}"
            )));
        }
    }
    let origin = options.origin.take().unwrap_or_else(|| {
        let [latitude, longitude] =
            bounds.map(|(low, high)| ((low + high) / 2.0 * 1e4).round() / 1e4);
        reader.note(format!(
            "its positions are in degrees; its origin is at latitude {latitude}, longitude {longitude}: \
             `origin: ({latitude}, {longitude}, 0)` puts other files beside it"
        ));
        [latitude, longitude, 0.0]
    });
    let axes = {
        let (north, east) = (turn(origin[0]), turn(origin[1]));
        DMat3::from_cols(
            DVec3::new(-east.0, east.1, 0.0),
            DVec3::new(-north.0 * east.1, -north.0 * east.0, north.1),
            DVec3::new(north.1 * east.1, north.1 * east.0, north.0),
        )
    };
    let middle = on_ellipsoid(origin[0], origin[1]);
    let place = |[latitude, longitude, height]: &[f64; 3]| {
        let off = axes.transpose() * (on_ellipsoid(*latitude, *longitude) - middle);
        [off.x, off.y, height - origin[2]]
    };
    Ok(positions.iter().map(place).collect())
}

/// Sine and cosine of an angle in degrees.
fn turn(degrees: f64) -> (f64, f64) {
    let angle = degrees.to_radians();
    (math::sin(angle), math::cos(angle))
}

/// A place on the ellipsoid of GRS 80 and WGS 84, in metres from the earth's middle.
fn on_ellipsoid(latitude: f64, longitude: f64) -> DVec3 {
    const EQUATOR: f64 = 6_378_137.0;
    const FLATTENING: f64 = 1.0 / 298.257_222_101;
    let square = FLATTENING * (2.0 - FLATTENING);
    let ((sin_n, cos_n), (sin_e, cos_e)) = (turn(latitude), turn(longitude));
    let radius = EQUATOR / (1.0 - square * sin_n * sin_n).sqrt();
    DVec3::new(radius * cos_n * cos_e, radius * cos_n * sin_e, radius * (1.0 - square) * sin_n)
}

/// A surface of an object.
struct Surface<'x> {
    lod: u32,
    /// What it is, such as a wall.
    kind: Option<&'x str>,
    polygon: Node<'x, 'x>,
    is_turned: bool,
}

/// The surfaces of an object, each once.
#[derive(Default)]
struct Found<'x> {
    list: Vec<Surface<'x>>,
    known: HashMap<(u32, NodeId), usize>,
}

impl<'x> Found<'x> {
    /// Adds a surface, or its kind if it is known.
    fn add(&mut self, surface: Surface<'x>) {
        let next = self.list.len();
        let at = *self.known.entry((surface.lod, surface.polygon.id())).or_insert(next);
        match self.list.get_mut(at) {
            Some(known) => known.kind = known.kind.or(surface.kind),
            None => self.list.push(surface),
        }
    }
}

/// What is said of an object: its surfaces, parts and attributes.
type Said<'a, 'x> = (&'a mut Found<'x>, &'a mut Vec<Node<'x, 'x>>, &'a mut Map<String, Value>);

/// Something that was left out: how many, and the first.
#[derive(Default)]
struct LeftOut {
    count: usize,
    first: String,
}

impl LeftOut {
    fn add(&mut self, which: impl FnOnce() -> String) {
        if self.count == 0 {
            self.first = which();
        }
        self.count += 1;
    }
}

/// Where surfaces are looked for.
#[derive(Clone, Copy)]
struct Looking<'x> {
    lod: u32,
    kind: Option<&'x str>,
    is_turned: bool,
    depth: u32,
}

struct Converter<'x, 'r> {
    reader: &'r mut Reader,
    root: Node<'x, 'x>,
    ids: HashMap<&'x str, Node<'x, 'x>>,
    objects: Map<String, Value>,
    vertices: Vec<[f64; 3]>,
    known: HashMap<[u64; 3], usize>,
    materials: Vec<CityMaterial>,
    textures: Vec<CityTexture>,
    places: Vec<[f32; 2]>,
    /// Surfaces without corners, and references to nothing.
    empty: LeftOut,
    dead: LeftOut,
    /// How many more surfaces there may be.
    room: usize,
    /// By surface, the number of its material.
    painted: HashMap<&'x str, usize>,
    /// By ring, the number of its picture, and where its corners' places in it begin.
    mapped: HashMap<&'x str, (usize, usize, usize)>,
}

impl<'x, 'r> Converter<'x, 'r> {
    fn new(reader: &'r mut Reader, root: Node<'x, 'x>) -> Converter<'x, 'r> {
        let ids = root.descendants().filter_map(|node| Some((attribute(node, "id")?, node)));
        let polygons = root.descendants().filter(|node| is_polygon(*node)).count();
        Converter {
            ids: ids.collect(),
            empty: LeftOut::default(),
            dead: LeftOut::default(),
            room: MOST_USES * polygons,
            reader,
            root,
            objects: Map::new(),
            vertices: Vec::new(),
            known: HashMap::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            places: Vec::new(),
            painted: HashMap::new(),
            mapped: HashMap::new(),
        }
    }

    fn fault(&self, node: Node<'_, '_>, message: impl Into<String>) -> Error {
        let at = node.document().text_pos_at(node.range().start);
        Error::at_line(&self.reader.path, at.row as usize, at.col as usize, message)
    }

    /// The numbers that an element's text is.
    fn numbers(&self, node: Node<'_, '_>) -> Result<Vec<f64>> {
        let text = text_of(node);
        let words = text.split_ascii_whitespace();
        let number = |word: &str| match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.fault(node, format!("\"{word}\" in {} is no number", name(node)))),
        };
        words.map(number).collect()
    }

    /// Reads all materials and pictures. Of several on one surface the first is taken.
    fn appearance(&mut self) -> Result<()> {
        for node in self.root.descendants().filter(Node::is_element) {
            match name(node) {
                "X3DMaterial" => self.material(node)?,
                "ParameterizedTexture" => self.texture(node)?,
                "GeoreferencedTexture" => {
                    self.reader.note("pictures that lie by position on the ground are not shown");
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn material(&mut self, node: Node<'x, 'x>) -> Result<()> {
        let number = self.materials.len();
        let mut material = CityMaterial { name: None, diffuse: None, transparency: None };
        for child in node.children().filter(Node::is_element) {
            match name(child) {
                "diffuseColor" => match *self.numbers(child)? {
                    [r, g, b] => material.diffuse = Some([r as f32, g as f32, b as f32]),
                    _ => return Err(self.fault(child, "a colour has three numbers")),
                },
                "transparency" => {
                    material.transparency = self.numbers(child)?.first().map(|v| *v as f32);
                }
                "target" => {
                    let surface = target(child.text().unwrap_or(""));
                    self.painted.entry(surface).or_insert(number);
                }
                _ => {}
            }
        }
        self.materials.push(material);
        Ok(())
    }

    fn texture(&mut self, node: Node<'x, 'x>) -> Result<()> {
        let text = |wanted: &str| {
            let child = node.children().find(|child| name(*child) == wanted);
            child.map(|child| text_of(child).trim().to_owned())
        };
        let Some(image) = text("imageURI") else { return Ok(()) };
        let number = self.textures.len();
        self.textures.push(CityTexture { image, wrap: text("wrapMode") });
        for list in node.descendants().filter(Node::is_element) {
            if name(list) == "TexCoordGen" {
                self.reader.note("pictures that lie by a matrix of the world are not shown");
            }
            if name(list) != "textureCoordinates" {
                continue;
            }
            // Since 3.0 the ring is an element of its own.
            let after = || list.next_sibling_element().filter(|next| name(*next) == "ring");
            let ring = attribute(list, "ring").or_else(|| after()?.text());
            let places = self.numbers(list)?;
            let ring = ring.map(target).ok_or_else(|| {
                self.fault(list, "textureCoordinates without the ring that they belong to")
            })?;
            let first = self.places.len();
            self.places.extend(places.chunks_exact(2).map(|p| [p[0] as f32, p[1] as f32]));
            self.mapped.entry(ring).or_insert((number, first, self.places.len()));
        }
        Ok(())
    }

    /// Reads an object and those that are parts of it.
    fn object(&mut self, node: Node<'x, 'x>, parent: Option<&str>, depth: u32) -> Result<()> {
        if depth > DEEPEST {
            return Err(self.fault(node, "objects within objects without an end"));
        }
        let id = self.next_id(node);
        if self.objects.contains_key(&id) {
            self.reader.note(format!("several objects are called \"{id}\": the first is taken"));
            return Ok(());
        }
        let mut found = Found::default();
        let mut parts = Vec::new();
        let mut attributes = Map::new();
        self.properties(node, None, (&mut found, &mut parts, &mut attributes), depth)?;
        // Windows and doors may be finer than the walls around them.
        let is_opening = |surface: &Surface<'_>| matches!(surface.kind, Some("Window" | "Door"));
        let finest = |openings: bool| {
            let lods = found.list.iter().filter(|surface| is_opening(surface) == openings);
            lods.map(|surface| surface.lod).max()
        };
        let finest = [finest(false), finest(true)];
        found.list.retain(|surface| Some(surface.lod) == finest[usize::from(is_opening(surface))]);
        let most = finest.into_iter().flatten().max().unwrap_or(0);
        self.room = self.room.checked_sub(found.list.len()).ok_or_else(|| {
            self.fault(node, "objects refer to each other's surfaces without an end")
        })?;
        let object = json!({
            "type": name(node),
            "attributes": attributes,
            "geometry": self.geometry(most, &found.list)?,
            "parents": parent.into_iter().collect::<Vec<_>>(),
        });
        self.objects.insert(id.clone(), object);
        let mut children = Vec::with_capacity(parts.len());
        for part in parts {
            children.push(Value::from(self.next_id(part)));
            self.object(part, Some(&id), depth + 1)?;
        }
        self.objects[&id]["children"] = Value::Array(children);
        Ok(())
    }

    /// The name that an object has when it is read next.
    fn next_id(&self, node: Node<'_, '_>) -> String {
        if let Some(id) = attribute(node, "id") {
            return id.to_owned();
        }
        let numbered = |number: usize| format!("{} {number}", name(node));
        let is_free = |id: &String| !self.ids.contains_key(id.as_str());
        (self.objects.len()..).map(numbered).find(is_free).unwrap_or_default()
    }

    /// Reads what an object, or a surface that bounds it, says of itself.
    fn properties(
        &mut self,
        node: Node<'x, 'x>,
        kind: Option<&'x str>,
        (found, parts, attributes): Said<'_, 'x>,
        depth: u32,
    ) -> Result<()> {
        if depth > DEEPEST {
            return Err(self.fault(node, "surfaces within surfaces without an end"));
        }
        let of = |lod: u32| Looking { lod, kind, is_turned: false, depth: 0 };
        for property in node.children().filter(Node::is_element) {
            let what = name(property);
            let lod = what.strip_prefix("lod").and_then(|rest| rest.chars().next()?.to_digit(10));
            let inside = || property.children().filter(Node::is_element);
            match (what, lod) {
                (what, Some(_)) if what.contains("Implicit") => {
                    self.reader.note("objects that are placed copies of others are left out");
                }
                (_, Some(lod)) => self.surfaces(property, of(lod), found, &mut HashSet::new())?,
                ("tin" | "multiSurface", None) => {
                    let own = node.children().find(|child| name(*child) == "lod");
                    let lod = own.and_then(|lod| lod.text()?.trim().parse().ok()).unwrap_or(0);
                    self.surfaces(property, of(lod), found, &mut HashSet::new())?;
                }
                ("boundedBy" | "boundary" | "opening" | "fillingSurface", None) => {
                    let named = |node: &Node<'_, '_>| {
                        !matches!(name(*node), "Envelope" | "Null" | "ClosureSurface")
                    };
                    for surface in inside().filter(named) {
                        let kind = match name(surface) {
                            kind if kind.starts_with("Window") => "Window",
                            kind if kind.starts_with("Door") => "Door",
                            kind => kind,
                        };
                        let said = (&mut *found, &mut Vec::new(), &mut Map::new());
                        self.properties(surface, Some(kind), said, depth + 1)?;
                    }
                }
                _ => {
                    let is_part = |node: &Node<'_, '_>| {
                        let is_named = name(*node).starts_with(char::is_uppercase);
                        is_named && node.descendants().any(is_polygon)
                    };
                    parts.extend(inside().filter(is_part));
                    let value = inside().find(|child| name(*child) == "value");
                    let said = match (attribute(property, "name"), value) {
                        (Some(key), Some(value)) => Some((key, text_of(value))),
                        _ if inside().next().is_none() => Some((what, text_of(property))),
                        _ => None,
                    };
                    if let Some((key, text)) = said {
                        attributes.insert(key.to_owned(), text.trim().into());
                    }
                }
            }
        }
        Ok(())
    }

    /// Finds the polygons below an element, also those that it refers to: each is one surface of the object.
    fn surfaces(
        &mut self,
        node: Node<'x, 'x>,
        looking: Looking<'x>,
        found: &mut Found<'x>,
        followed: &mut HashSet<NodeId>,
    ) -> Result<()> {
        let Looking { lod, kind, mut is_turned, depth } = looking;
        if depth > DEEPEST {
            return Err(self.fault(node, "surfaces within surfaces without an end"));
        }
        let deeper = |is_turned| Looking { is_turned, depth: depth + 1, ..looking };
        if let Some(reference) = attribute(node, "href") {
            match self.ids.get(target(reference)).copied() {
                Some(there) if followed.insert(there.id()) => {
                    return self.surfaces(there, deeper(is_turned), found, followed);
                }
                Some(_) => {}
                None => self.dead.add(|| format!("\"{reference}\"")),
            }
            return Ok(());
        }
        if is_polygon(node) {
            found.add(Surface { lod, kind, polygon: node, is_turned });
            return Ok(());
        }
        if name(node) == "OrientableSurface" && attribute(node, "orientation") == Some("-") {
            is_turned = !is_turned;
        }
        for child in node.children().filter(Node::is_element) {
            self.surfaces(child, deeper(is_turned), found, followed)?;
        }
        Ok(())
    }

    /// Surfaces as a geometry of CityJSON.
    fn geometry(&mut self, lod: u32, surfaces: &[Surface<'x>]) -> Result<Vec<Value>> {
        let mut kinds: Vec<Value> = Vec::new();
        let [mut boundaries, mut values, mut looks, mut pictures] = [const { Vec::new() }; 4];
        for surface in surfaces {
            let rings = surface.polygon.descendants().filter(|node| name(*node) == "LinearRing");
            let (mut outlines, mut places) = (Vec::new(), Vec::new());
            for ring in rings {
                let (outline, place) = self.ring(ring, surface.is_turned)?;
                outlines.push(outline);
                places.push(place);
            }
            if outlines.first().is_none_or(|outline| outline.len() < 3) {
                let start = surface.polygon.range().start;
                let place =
                    || format!("line {}", surface.polygon.document().text_pos_at(start).row);
                self.empty.add(place);
                continue;
            }
            // So are holes.
            let is_hole: Vec<bool> = outlines.iter().map(|outline| outline.len() >= 3).collect();
            let mut known = is_hole.iter();
            outlines.retain(|_| known.next() == Some(&true));
            let mut known = is_hole.iter();
            places.retain(|_| known.next() == Some(&true));
            boundaries.push(json!(outlines));
            values.push(json!(surface.kind.map(|_| kinds.len())));
            kinds.extend(surface.kind.map(|kind| json!({ "type": kind })));
            let mut above = surface.polygon.ancestors().filter_map(|node| attribute(node, "id"));
            looks.push(json!(above.find_map(|id| self.painted.get(id))));
            pictures.push(json!(places));
        }
        if boundaries.is_empty() {
            return Ok(Vec::new());
        }
        Ok(vec![json!({
            "type": "MultiSurface",
            "lod": lod,
            "boundaries": boundaries,
            "semantics": { "surfaces": kinds, "values": values },
            "material": { "": { "values": looks } },
            "texture": { "": { "values": pictures } },
        })])
    }

    /// The corners of a ring, and its picture with the place of each in it.
    fn ring(
        &mut self,
        ring: Node<'x, 'x>,
        is_turned: bool,
    ) -> Result<(Vec<usize>, Vec<Option<usize>>)> {
        let mut outline = Vec::new();
        for list in ring.children().filter(Node::is_element) {
            let numbers = match name(list) {
                "posList" | "pos" => self.numbers(list)?,
                _ => continue,
            };
            let size = list.ancestors().find_map(|node| attribute(node, "srsDimension"));
            let size = if size == Some("2") { 2 } else { 3 };
            if !numbers.len().is_multiple_of(size) {
                let count = numbers.len();
                return Err(self.fault(list, format!("{count} numbers are no list of positions")));
            }
            for position in numbers.chunks_exact(size) {
                let position = [position[0], position[1], position.get(2).copied().unwrap_or(0.0)];
                let next = self.vertices.len();
                let vertex = *self.known.entry(position.map(f64::to_bits)).or_insert(next);
                if vertex == next {
                    self.vertices.push(position);
                }
                outline.push(vertex);
            }
        }
        if outline.len() > 1 && outline.first() == outline.last() {
            outline.pop();
        }
        let mapped = attribute(ring, "id").and_then(|id| self.mapped.get(id)).copied();
        let fits = mapped.filter(|(_, first, end)| end - first >= outline.len());
        if mapped.is_some() && fits.is_none() {
            self.reader.note("rings with fewer places in their picture than corners show none");
        }
        let mut places: Vec<Option<usize>> = fits
            .map_or(Vec::new(), |(_, first, _)| (first..first + outline.len()).map(Some).collect());
        if is_turned {
            outline.reverse();
            places.reverse();
        }
        places.insert(0, fits.map(|(picture, ..)| picture));
        Ok((outline, places))
    }
}
