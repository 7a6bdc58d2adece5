//! Pictures on the faces of a scene: in sets, and as domains (\[D], "Attribute mapping").

use super::{MaterialLook, SceneSurfaces};
use crate::fragment::{Fragments, PictureSet, PictureShare, Pictured};
use crate::scene::maps::Sizes;
use crate::texture::{self, Opened};

impl Pictured for SceneSurfaces {
    fn picture_sets(&self) -> Vec<PictureSet> {
        let make = || {
            let mut sizes = Sizes::new(&*self.scene.reader);
            let sets = (0..self.maps.len() as u32).map(|number| PictureSet {
                number,
                pictures: self.pictures_of(number, &mut sizes),
            });
            // What is divided is divided where its pictures are read.
            sets.filter(|set| {
                !set.pictures.is_empty() || self.domains[set.number as usize].is_some()
            })
            .collect()
        };
        self.picture_sets.get_or_init(make).clone()
    }

    fn picture_set(&self, ordinal: u32, sees_front: bool) -> Option<u32> {
        let number = self.material_of(ordinal, sees_front)?;
        let at = number as usize;
        (self.maps[at].is_some() || self.domains[at].is_some()).then_some(number)
    }

    fn divide(&self, fragments: &Fragments<'_>) -> Vec<PictureShare> {
        if self.domains.iter().all(Option::is_none) {
            return Vec::new();
        }
        let mut parts = Vec::new();
        let mut is_divided = false;
        let mut opened: Vec<(u32, Vec<Opened<'_>>)> = Vec::new();
        let mut last: Option<(u32, MaterialLook<'_>)> = None;
        for i in 0..fragments.len() {
            let (ordinal, sees_front) = (fragments.ordinal[i], fragments.sees_front[i]);
            let (_, (domains, look)) = match last.take().filter(|(known, _)| *known == ordinal) {
                Some(known) => last.insert(known),
                None => {
                    let look = self.look((ordinal, sees_front), None, false);
                    last.insert((ordinal, (self.domains_of(ordinal, sees_front), look)))
                }
            };
            let Some((number, ready)) = domains else {
                parts.push((i, None, 1.0));
                continue;
            };
            is_divided = true;
            let known = opened.iter().position(|(known, _)| known == number);
            let at = known.unwrap_or_else(|| {
                opened.push((*number, ready.open()));
                opened.len() - 1
            });
            let world = fragments.point(i);
            let steps = fragments.footprint(i, world, look.normal);
            let footprint = ready.domains.mapping.footprint(&texture::SurfacePoint {
                point: look.place.0.transform_point3(world),
                steps: steps.map(|step| look.place.0.matrix3 * step),
                normal: look.front,
                uv: &|point| look.uv(point),
            });
            let shares = ready.shares(&opened[at].1, &footprint, fragments.textures);
            parts.extend(shares.into_iter().map(|(bundle, share)| (i, Some(bundle), share)));
        }
        if is_divided { parts } else { Vec::new() }
    }
}
