//! CityGML 1.0 to 3.0, turned into the CityJSON that says the same.
//!
//! Of each object the surfaces of every level of detail become a geometry: those that it is bounded by, which have
//! kinds (wall, roof, window), and others; surfaces that are named by reference are read once. Those of solids keep
//! their shells. Parts are its children. Pictures lie by the coordinates of rings (`ParameterizedTexture`). Positions in degrees are laid on the plane that
//! touches the ellipsoid at the origin.

pub(super) mod degrees;
mod geometry;
mod prefixes;

use roxmltree::{Document as Tree, Node, NodeId};
use serde_json::{Map, Value, json};
use std::collections::{HashMap, HashSet};

use super::super::document::Document;
use super::cityjson::{self, Appearance, City, CityMaterial, CityTexture};
use super::reader::{LeftOut, Reader};
use crate::error::{Error, Result};
use crate::scene::library::ReadOptions;
use degrees::{flat, is_degrees};
use prefixes::{Added, declared, not_city_gml};

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
    let (text, added) = declared(reader, text)?;
    let tree = Tree::parse(&text).map_err(|e| not_city_gml(reader, &e, &added))?;
    let root = tree.root_element();
    if name(root) != "CityModel" {
        let kind = name(root);
        return Err(
            reader.fault(format!("an XML file of \"{kind}\": expected CityGML's CityModel"))
        );
    }
    let mut converter = Converter::new(reader, root, added);
    converter.appearance()?;
    for member in root.children().filter(|node| is_member(*node)) {
        for object in member.children().filter(Node::is_element) {
            converter.object(object, None, 0)?;
        }
    }
    let Converter { objects, vertices, materials, textures, places, empty, holes, dead, .. } =
        converter;
    empty.tell(reader, "surfaces with fewer than three corners are left out");
    holes.tell(reader, "holes with fewer than three corners are left out");
    dead.tell(reader, "references lead to nothing");
    let vertices = match in_degrees(root) {
        true => flat(reader, &vertices, options)?,
        false => vertices,
    };
    let appearance = Appearance { materials, textures, places };
    let city = City::new(objects.into_iter().collect(), vertices, appearance);
    cityjson::build(reader, &[city], options.lod)
}

/// Whether an element of the model holds city objects.
fn is_member(node: Node<'_, '_>) -> bool {
    matches!(name(node), "cityObjectMember" | "featureMember" | "featureMembers")
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
    let system = root.descendants().find_map(|node| attribute(node, "srsName"));
    system.is_some_and(is_degrees)
}

/// A surface of an object.
struct Surface<'x> {
    lod: u32,
    /// What it is, such as a wall.
    kind: Option<&'x str>,
    polygon: Node<'x, 'x>,
    is_turned: bool,
    /// Of which solid and which of its shells it is.
    shell: Option<(u32, u32)>,
}

/// The surfaces of an object, each once.
#[derive(Default)]
struct Found<'x> {
    list: Vec<Surface<'x>>,
    known: HashMap<(u32, NodeId), usize>,
}

impl<'x> Found<'x> {
    /// Adds a surface, or its kind and shell if it is known.
    fn add(&mut self, surface: Surface<'x>) {
        let next = self.list.len();
        let at = *self.known.entry((surface.lod, surface.polygon.id())).or_insert(next);
        match self.list.get_mut(at) {
            Some(known) => {
                // A solid refers to the walls that `boundedBy` tells the kind of, in either order.
                known.kind = known.kind.or(surface.kind);
                known.shell = known.shell.or(surface.shell);
            }
            None => self.list.push(surface),
        }
    }
}

/// What is said of an object: its surfaces, parts and attributes.
type Said<'a, 'x> = (&'a mut Found<'x>, &'a mut Vec<Node<'x, 'x>>, &'a mut Map<String, Value>);

/// Where surfaces are looked for.
#[derive(Clone, Copy)]
struct Looking<'x> {
    lod: u32,
    kind: Option<&'x str>,
    is_turned: bool,
    shell: Option<(u32, u32)>,
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
    /// Surfaces and holes without corners, and references to nothing.
    empty: LeftOut,
    holes: LeftOut,
    dead: LeftOut,
    /// How many more surfaces there may be.
    room: usize,
    /// The number of solids so far.
    solids: u32,
    added: Added,
    /// By surface, the number of its material.
    painted: HashMap<&'x str, usize>,
    /// By ring, the number of its picture, and where its corners' places in it begin.
    mapped: HashMap<&'x str, (usize, usize, usize)>,
}

impl<'x, 'r> Converter<'x, 'r> {
    fn new(reader: &'r mut Reader, root: Node<'x, 'x>, added: Added) -> Converter<'x, 'r> {
        let ids = root.descendants().filter_map(|node| Some((attribute(node, "id")?, node)));
        let polygons = root.descendants().filter(|node| is_polygon(*node)).count();
        Converter {
            ids: ids.collect(),
            empty: LeftOut::default(),
            holes: LeftOut::default(),
            dead: LeftOut::default(),
            room: MOST_USES * polygons,
            solids: 0,
            added,
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
        let (line, column) = self.added.in_file(at);
        Error::at_line(&self.reader.path, line, column, message)
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
        // References let a small file name its surfaces again and again.
        self.room = self.room.checked_sub(found.list.len()).ok_or_else(|| {
            self.fault(node, "objects refer to each other's surfaces without an end")
        })?;
        let object = json!({
            "type": name(node),
            "attributes": attributes,
            "geometry": self.geometries(&found.list)?,
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
        let of = |lod: u32| Looking { lod, kind, is_turned: false, shell: None, depth: 0 };
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
        let Looking { lod, kind, mut is_turned, mut shell, depth } = looking;
        if depth > DEEPEST {
            return Err(self.fault(node, "surfaces within surfaces without an end"));
        }
        let deeper = |is_turned, shell| Looking { is_turned, shell, depth: depth + 1, ..looking };
        if let Some(reference) = attribute(node, "href") {
            match self.ids.get(target(reference)).copied() {
                // Once for a property: references may lead in a circle.
                Some(there) if followed.insert(there.id()) => {
                    return self.surfaces(there, deeper(is_turned, shell), found, followed);
                }
                Some(_) => {}
                None => self.dead.add(|| format!("\"{reference}\"")),
            }
            return Ok(());
        }
        if is_polygon(node) {
            found.add(Surface { lod, kind, polygon: node, is_turned, shell });
            return Ok(());
        }
        // Two of them within each other turn it back.
        if name(node) == "OrientableSurface" && attribute(node, "orientation") == Some("-") {
            is_turned = !is_turned;
        }
        let is_solid = name(node) == "Solid";
        if is_solid {
            self.solids += 1;
            shell = Some((self.solids, 0));
        }
        for child in node.children().filter(Node::is_element) {
            // Polygons have an `interior` too, which is a hole.
            if let Some((solid, inner)) = shell.filter(|_| is_solid && name(child) == "interior") {
                shell = Some((solid, inner + 1));
            }
            self.surfaces(child, deeper(is_turned, shell), found, followed)?;
        }
        Ok(())
    }
}
