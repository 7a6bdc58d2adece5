//! Materials and textures.
//!
//! | of the file | absent | here |
//! |---|---|---|
//! | a primitive's `material` | white metal, wholly rough, seen from its front only | the same, as a material called `default` |
//! | `baseColorFactor` | (1, 1, 1, 1) | `color` (linear) and `alpha` |
//! | `metallicFactor`, `roughnessFactor` | 1 and 1 | `Microfacets`, its `reflectance` .04 |
//! | `emissiveFactor` | (0, 0, 0) | `glow`, times `KHR_materials_emissive_strength`, in cd/m2 |
//! | `alphaMode`, `alphaCutoff` | `OPAQUE` and .5 | `alpha_mode` |
//! | `doubleSided` | false | `one_sided` |
//! | `wrapS`, `wrapT`, or a texture's `sampler` | `REPEAT` | the mapping's `wrap` |
//! | `scale` of normals, `strength` of occlusion | 1 | the map's `strength` |
//! | `texCoord` | 0 | which coordinates the mesh keeps; all pictures of a material lie by the same |
//! | `KHR_materials_pbrSpecularGlossiness` | all of it 1 | instead of the three above: `reflectance` is the grey of what is mirrored; without a diffuse colour, a metal |
//! | `KHR_materials_ior` | 1.5 | `reflectance`, and the `index` of optics |
//! | `KHR_materials_transmission` | 0 | `optics`: what is let through, tinted by the colour, instead of being sent back |
//! | `KHR_materials_volume` | no thickness: a thin pane | a body: its optics bend light by the index, and absorb |

use ::gltf::json::Root;
use ::gltf::json::material::AlphaMode as Mode;
use ::gltf::json::texture::WrappingMode;
use ::gltf::json::validation::Checked;
use serde_json::Value;
use std::collections::BTreeMap;
use std::f64::consts::LN_2;

use super::super::super::material::{AlphaMode, Map, Material, Picture};
use super::super::reader::Reader;
use super::buffers::decoded;
use super::parse::File;
use super::placing;
use crate::color::Color;
use crate::fragment::{Finish, Gloss, Optics};
use crate::texture::Wrap;

/// The reflectance of what is no metal: that of an index of refraction of 1.5.
const REFLECTANCE: f32 = 0.04;

/// The material of a primitive that names none.
pub(super) fn default() -> Material {
    Material {
        color: Color::WHITE,
        finish: Finish {
            gloss: Gloss::Microfacets { reflectance: REFLECTANCE, roughness: 1.0, metal: 1.0 },
            ..Finish::default()
        },
        one_sided: true,
        ..Material::default()
    }
}

/// A material, and what meshes must know of it.
pub(super) struct Made {
    pub(super) material: Material,
    /// The texture coordinates that its pictures lie by, if it has any.
    pub(super) uv_set: Option<u32>,
}

/// Makes a material.
pub(super) fn make(reader: &mut Reader, file: &File, index: usize) -> Made {
    let mut maker = Maker { reader, file, index, maps: BTreeMap::new(), uv_set: None };
    let material = maker.make();
    Made { material, uv_set: maker.uv_set }
}

struct Maker<'a> {
    reader: &'a mut Reader,
    file: &'a File,
    index: usize,
    maps: BTreeMap<String, Map>,
    uv_set: Option<u32>,
}

/// What a material's surface is made of.
struct Base {
    color: [f32; 4],
    reflectance: f32,
    roughness: f32,
    metal: f32,
}

impl Maker<'_> {
    fn make(&mut self) -> Material {
        let Some(json) = self.file.root.materials.get(self.index) else { return default() };
        let own = &self.file.json["materials"][self.index];
        let info = |path: &str| own.pointer(path).cloned();
        let is_unlit = self.extension("KHR_materials_unlit").is_some();
        let base = match self.extension("KHR_materials_pbrSpecularGlossiness") {
            Some(gloss) => self.specular_glossiness(&gloss),
            None => {
                let pbr = &json.pbr_metallic_roughness;
                self.map("color", info("/pbrMetallicRoughness/baseColorTexture"));
                self.map(
                    "metallic_roughness",
                    info("/pbrMetallicRoughness/metallicRoughnessTexture"),
                );
                let index = self.number("KHR_materials_ior", "ior").unwrap_or(1.5);
                Base {
                    color: pbr.base_color_factor.0,
                    reflectance: reflectance(index),
                    roughness: pbr.roughness_factor.0.clamp(0.0, 1.0),
                    metal: pbr.metallic_factor.0.clamp(0.0, 1.0),
                }
            }
        };
        // The colour comes first: the first picture decides which coordinates the mesh keeps.
        self.map("emission", info("/emissiveTexture"));
        self.map("normal", info("/normalTexture"));
        self.map("occlusion", info("/occlusionTexture"));
        let strength = self.number("KHR_materials_emissive_strength", "emissiveStrength");
        let [glow_r, glow_g, glow_b] = json.emissive_factor.0;
        let mut glow = Color::new(glow_r, glow_g, glow_b) * strength.unwrap_or(1.0).max(0.0) as f32;
        if !glow.is_finite() {
            self.note("glows more than can be shown: it does not");
            glow = Color::BLACK;
        }
        let [r, g, b, alpha] = base.color;
        let mut material = Material {
            color: Color::new(r, g, b),
            alpha,
            alpha_mode: match json.alpha_mode {
                Checked::Valid(Mode::Mask) => {
                    AlphaMode::Mask(json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0))
                }
                Checked::Valid(Mode::Blend) => AlphaMode::Blend,
                Checked::Valid(Mode::Opaque) | Checked::Invalid => AlphaMode::Opaque,
            },
            unlit: is_unlit,
            finish: Finish {
                gloss: Gloss::Microfacets {
                    reflectance: base.reflectance,
                    roughness: base.roughness,
                    metal: base.metal,
                },
                glow,
                ..Finish::default()
            },
            one_sided: !json.double_sided,
            ..Material::default()
        };
        if !is_unlit {
            self.let_through(&mut material, &base);
        }
        material.maps = std::mem::take(&mut self.maps);
        material
    }

    fn extension(&self, name: &str) -> Option<Value> {
        self.file.extension("materials", self.index, name).cloned()
    }

    fn number(&self, extension: &str, field: &str) -> Option<f64> {
        self.file.extension("materials", self.index, extension)?.get(field)?.as_f64()
    }

    fn note(&mut self, what: &str) {
        let name = self.file.root.materials.get(self.index).and_then(|m| m.name.as_deref());
        let name = name.map_or_else(|| self.index.to_string(), |name| format!("\"{name}\""));
        self.reader.note(format!("material {name} {what}"));
    }

    /// The older way to say what a surface is: a diffuse colour, a colour of what is mirrored, and gloss.
    fn specular_glossiness(&mut self, gloss: &Value) -> Base {
        let numbers = |field: &str, count: usize| -> Vec<f32> {
            let given = gloss.get(field).and_then(Value::as_array);
            let given = given.map(|list| list.iter().filter_map(Value::as_f64));
            let given: Vec<f32> = given.into_iter().flatten().map(|v| v as f32).collect();
            if given.len() == count { given } else { vec![1.0; count] }
        };
        let diffuse = numbers("diffuseFactor", 4);
        let specular = numbers("specularFactor", 3);
        let glossiness = gloss.get("glossinessFactor").and_then(Value::as_f64).unwrap_or(1.0);
        let roughness = (1.0 - glossiness as f32).clamp(0.0, 1.0);
        self.map("color", gloss.get("diffuseTexture").cloned());
        let color = [diffuse[0], diffuse[1], diffuse[2], diffuse[3]];
        if gloss.get("specularGlossinessTexture").is_some() {
            self.note(
                "has a specularGlossinessTexture, which is not shown: its gloss is the same everywhere, \
                 half as much as its glossinessFactor",
            );
            let roughness = 1.0 - (1.0 - roughness) / 2.0;
            return Base { color, reflectance: REFLECTANCE, roughness, metal: 0.0 };
        }
        let most = specular.iter().copied().fold(0.0, f32::max).clamp(0.0, 1.0);
        let least = specular.iter().copied().fold(1.0, f32::min);
        let is_black = diffuse[..3].iter().all(|v| *v <= 0.0);
        if is_black && most > 0.0 {
            // A metal's colour is that of what it mirrors.
            let color = [specular[0], specular[1], specular[2], diffuse[3]];
            return Base { color, reflectance: REFLECTANCE, roughness, metal: 1.0 };
        }
        if most - least > 0.02 {
            self.note("mirrors in a colour of its own beside its diffuse one: it is taken as grey");
        }
        // What is mirrored is not sent to all sides, there as here.
        Base { color, reflectance: most, roughness, metal: 0.0 }
    }

    /// What a surface lets through, as optics.
    fn let_through(&mut self, material: &mut Material, base: &Base) {
        let share = self.number("KHR_materials_transmission", "transmissionFactor").unwrap_or(0.0);
        // Metals let nothing through.
        let share = share.clamp(0.0, 1.0) as f32 * (1.0 - base.metal);
        if share <= 0.0 {
            return;
        }
        if self
            .extension("KHR_materials_transmission")
            .is_some_and(|t| t.get("transmissionTexture").is_some())
        {
            self.note(
                "has a transmissionTexture, which is not shown: as much is let through everywhere",
            );
        }
        if base.roughness > 0.1 {
            self.note("is rough glass: what is behind it is seen sharp");
        }
        let index = self.number("KHR_materials_ior", "ior").unwrap_or(1.5);
        let volume = self.extension("KHR_materials_volume");
        let of_volume = |field: &str| volume.as_ref().and_then(|volume| volume.get(field));
        let thickness = of_volume("thicknessFactor").and_then(Value::as_f64).unwrap_or(0.0);
        let tint = clamped(material.color * share);
        let optics = if thickness > 0.0 {
            let distance = of_volume("attenuationDistance").and_then(Value::as_f64);
            let color = of_volume("attenuationColor").and_then(Value::as_array);
            let left = |k: usize| {
                let left = color.and_then(|color| color.get(k)).and_then(Value::as_f64);
                // Of black nothing is left: as good as nothing.
                left.unwrap_or(1.0).clamp(1e-6, 1.0)
            };
            let absorb = |k: usize| match distance {
                Some(distance) if distance > 0.0 => {
                    // Beer's law: after the distance this share is left.
                    (-crate::math::log2(left(k)) * LN_2 / distance) as f32
                }
                _ => 0.0,
            };
            // From within, its back is seen.
            material.one_sided = false;
            Optics {
                refract: tint,
                index: index.clamp(1.0, 10.0) as f32,
                absorb: Color::new(absorb(0), absorb(1), absorb(2)),
                ..Optics::default()
            }
        } else {
            // A pane so thin that what is seen through it does not move.
            let mirrored = base.reflectance.clamp(0.0, 1.0);
            Optics {
                reflect: Color::grey(mirrored),
                refract: tint * (1.0 - mirrored),
                index: 1.0,
                fresnel: false,
                absorb: Color::BLACK,
            }
        };
        material.finish.optics = Some(optics);
        // What is let through is not sent back as well.
        material.color = material.color * (1.0 - share);
        // The specification tints what is let through by the base colour, of which a picture is a
        // part.
        if let Some(color) = self.maps.get("color").cloned() {
            self.maps.insert("refract".to_owned(), color);
        }
    }

    /// Adds a picture; `info` is what the file says of it.
    fn map(&mut self, what: &str, info: Option<Value>) {
        let Some(info) = info else { return };
        let whole = |field: &str| info.get(field).and_then(Value::as_u64);
        let Some(texture) = whole("index").map(|index| index as usize) else { return };
        let number = |field: &str| info.get(field).and_then(Value::as_f64).unwrap_or(1.0) as f32;
        let strength = match what {
            "normal" => number("scale"),
            "occlusion" => number("strength"),
            _ => 1.0,
        };
        // The format allows textures without a picture.
        let Some(image) = image(self.file, texture) else { return };
        let of_uv = whole("texCoord").and_then(|set| u32::try_from(set).ok()).unwrap_or(0);
        let placed = info.pointer("/extensions/KHR_texture_transform");
        let (mapping, of_uv, fault) = placing::place(placed, of_uv, wrap(&self.file.root, texture));
        fault.into_iter().for_each(|what| self.reader.note(what));
        let taken = *self.uv_set.get_or_insert(of_uv);
        if of_uv != taken {
            self.reader.note(format!(
                "the {what} of a material lies by texture coordinates {of_uv}: it is taken by {taken}, as its \
                 other pictures are"
            ));
        }
        let uri = self.file.root.images.get(image).and_then(|image| image.uri.as_deref());
        let picture = match uri.filter(|uri| !uri.starts_with("data:")) {
            // Raw, as the specification wants colour profiles and EXIF of pictures ignored.
            Some(uri) => Picture::Raw(decoded(uri)),
            None => {
                let name = self.reader.path.file_name().unwrap_or_default();
                Picture::Embedded(name.to_string_lossy().into_owned(), image as u32)
            }
        };
        self.maps.insert(what.to_owned(), Map { picture, strength, mapping });
    }
}

/// The reflectance, straight on, of what has an index of refraction; an index of 0 means that all is mirrored.
fn reflectance(index: f64) -> f32 {
    let root = (index - 1.0) / (index + 1.0);
    (root * root).clamp(0.0, 1.0) as f32
}

fn clamped(color: Color) -> Color {
    let [r, g, b] = color.to_array().map(|v| v.clamp(0.0, 1.0));
    Color::new(r, g, b)
}

/// The picture of a texture.
fn image(file: &File, texture: usize) -> Option<usize> {
    let webp = file.extension("textures", texture, "EXT_texture_webp");
    let webp = webp.and_then(|webp| webp.get("source")).and_then(Value::as_u64);
    let plain = || file.root.textures.get(texture).map(|texture| texture.source.value());
    let image = webp.map(|source| source as usize).or_else(plain);
    image.filter(|image| *image < file.root.images.len())
}

/// What is beside the picture of a texture, if its sampler is sound; else the picture again.
fn wrap(root: &Root, texture: usize) -> [Wrap; 2] {
    let sampler = root.textures.get(texture).and_then(|texture| texture.sampler);
    let Some(sampler) = sampler.and_then(|index| root.samplers.get(index.value())) else {
        return [Wrap::Repeat; 2];
    };
    [sampler.wrap_s, sampler.wrap_t].map(|mode| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    })
}
