//! Surfaces as geometries of CityJSON.

use roxmltree::Node;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

use super::{Converter, Surface, attribute, name};
use crate::error::Result;
use crate::watch::Watch;

/// The corners of a ring, by number.
type Ring = Vec<usize>;

/// The picture of a ring, and the places of its corners in it.
type Places = Vec<Option<usize>>;

impl<'x> Converter<'x, '_> {
    /// Surfaces as geometries of CityJSON, by level of detail.
    pub(super) fn geometries(&mut self, surfaces: &[Surface<'x>]) -> Result<Vec<Value>> {
        // Windows and doors may be finer than the walls around them.
        let is_opening = |surface: &Surface<'_>| matches!(surface.kind, Some("Window" | "Door"));
        let lods = |openings: bool| -> BTreeSet<u32> {
            let of = surfaces.iter().filter(|surface| is_opening(surface) == openings);
            of.map(|surface| surface.lod).collect()
        };
        let [walls, openings] = [lods(false), lods(true)];
        let levels = if walls.is_empty() { &openings } else { &walls };
        let mut geometries = Vec::new();
        for level in levels {
            let is_finest = levels.last() == Some(level);
            let of_openings = if is_finest { openings.last() } else { Some(level) };
            let shown = surfaces.iter().filter(|surface| {
                Some(&surface.lod) == if is_opening(surface) { of_openings } else { Some(level) }
            });
            // By solid and shell; what is in none comes first.
            let mut shells: BTreeMap<Option<(u32, u32)>, Vec<&Surface<'x>>> = BTreeMap::new();
            shown.for_each(|surface| shells.entry(surface.shell).or_default().push(surface));
            if let Some(loose) = shells.remove(&None) {
                geometries.extend(self.geometry(*level, "MultiSurface", &[loose])?);
            }
            let mut solids: BTreeMap<u32, Vec<Vec<&Surface<'x>>>> = BTreeMap::new();
            for (shell, surfaces) in shells {
                let solid = shell.map_or(0, |(solid, _)| solid);
                solids.entry(solid).or_default().push(surfaces);
            }
            for shells in solids.values() {
                geometries.extend(self.geometry(*level, "Solid", shells)?);
            }
        }
        Ok(geometries)
    }

    /// Surfaces, by shell, as a geometry of CityJSON; `None` if none has corners.
    fn geometry(
        &mut self,
        lod: u32,
        kind: &str,
        shells: &[Vec<&Surface<'x>>],
    ) -> Result<Option<Value>> {
        let mut kinds: Vec<Value> = Vec::new();
        let [mut boundaries, mut values, mut looks, mut pictures] = [const { Vec::new() }; 4];
        let watch = Watch::current();
        for surfaces in shells {
            let [mut shell, mut kinds_here, mut looks_here, mut pictures_here] =
                [const { Vec::new() }; 4];
            for surface in surfaces {
                watch.check()?;
                let Some((outlines, places)) = self.rings(surface)? else { continue };
                shell.push(json!(outlines));
                kinds_here.push(json!(surface.kind.map(|_| kinds.len())));
                kinds.extend(surface.kind.map(|kind| json!({ "type": kind })));
                // The nearest that is painted: the polygon itself, or the surface around it.
                let mut above =
                    surface.polygon.ancestors().filter_map(|node| attribute(node, "id"));
                looks_here.push(json!(above.find_map(|id| self.painted.get(id))));
                pictures_here.push(json!(places));
            }
            boundaries.push(shell);
            values.push(kinds_here);
            looks.push(looks_here);
            pictures.push(pictures_here);
        }
        if boundaries.iter().all(Vec::is_empty) {
            return Ok(None);
        }
        // Surfaces of no solid are one list, those of a solid a list of shells.
        let nested = |lists: Vec<Vec<Value>>| match kind {
            "Solid" => json!(lists),
            _ => Value::Array(lists.into_iter().flatten().collect()),
        };
        Ok(Some(json!({
            "type": kind,
            "lod": lod,
            "boundaries": nested(boundaries),
            "semantics": { "surfaces": kinds, "values": nested(values) },
            "material": { "": { "values": nested(looks) } },
            "texture": { "": { "values": nested(pictures) } },
        })))
    }

    /// The rings of a surface that have corners, and the places of these in its picture; `None` if the outline has
    /// fewer than three.
    fn rings(&mut self, surface: &Surface<'x>) -> Result<Option<(Vec<Ring>, Vec<Places>)>> {
        let rings = surface.polygon.descendants().filter(|node| name(*node) == "LinearRing");
        let (mut outlines, mut places) = (Vec::new(), Vec::new());
        for ring in rings {
            let (outline, place) = self.ring(ring, surface.is_turned)?;
            if outline.len() >= 3 {
                outlines.push(outline);
                places.push(place);
                continue;
            }
            let line = surface.polygon.document().text_pos_at(ring.range().start).row;
            if outlines.is_empty() {
                self.empty.add(|| format!("line {line}"));
                return Ok(None);
            }
            self.holes.add(|| format!("line {line}"));
        }
        if outlines.is_empty() {
            let start = surface.polygon.range().start;
            let line = surface.polygon.document().text_pos_at(start).row;
            self.empty.add(|| format!("line {line}"));
            return Ok(None);
        }
        Ok(Some((outlines, places)))
    }

    /// The corners of a ring, and its picture with the place of each in it.
    fn ring(&mut self, ring: Node<'x, 'x>, is_turned: bool) -> Result<(Ring, Places)> {
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
        // GML closes rings by their first position.
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
        // As CityJSON has it: the picture's number before the places.
        places.insert(0, fits.map(|(picture, ..)| picture));
        Ok((outline, places))
    }
}
