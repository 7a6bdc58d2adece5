//! Extensions: which are read, and what to say of the others.

use serde_json::Value;

/// Extensions that are read. A file may require them.
const READ: [&str; 11] = [
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// An extension that is not read.
struct Other {
    name: &'static str,
    /// What is not as it should be without it.
    missing: &'static str,
    /// How a file that requires it is made one that does not.
    cure: &'static str,
}

const fn other(name: &'static str, missing: &'static str, cure: &'static str) -> Other {
    Other { name, missing, cure }
}

const PICTURES: &str = "save its textures as PNG, JPEG or WebP (gltfpack without -tc)";
const PLAIN: &str = "export it without: in Blender, by a plain Principled material";

const OTHERS: [Other; 21] = [
    other(
        "KHR_draco_mesh_compression",
        "meshes whose data is there in this form only",
        "export it again without Draco compression (in Blender: Data, Compression off), or open it in Blender and \
         export it so",
    ),
    other(
        "EXT_meshopt_compression",
        "meshes whose data is there in this form only",
        "make it again by gltfpack without -c and -cc, or open it in Blender and export it again",
    ),
    other(
        "KHR_meshopt_compression",
        "meshes whose data is there in this form only",
        "make it again by gltfpack without -c and -cc, or open it in Blender and export it again",
    ),
    other("KHR_texture_basisu", "textures that are there as KTX2 only", PICTURES),
    other("MSFT_texture_dds", "textures that are there as DDS only", PICTURES),
    other("EXT_texture_avif", "textures that are there as AVIF only", PICTURES),
    other("KHR_materials_clearcoat", "the clear coat", PLAIN),
    other("KHR_materials_sheen", "the sheen of cloth", PLAIN),
    other(
        "KHR_materials_specular",
        "the strength and colour of the gloss of what is no metal",
        PLAIN,
    ),
    other("KHR_materials_iridescence", "colours of thin films", PLAIN),
    other("KHR_materials_anisotropy", "gloss that is longer one way than the other", PLAIN),
    other("KHR_materials_dispersion", "glass that divides colours", PLAIN),
    other("KHR_materials_diffuse_transmission", "light through leaves and paper", PLAIN),
    other("KHR_materials_volume_scatter", "scattering within bodies", PLAIN),
    other(
        "KHR_materials_variants",
        "other variants than the first",
        "choose a variant in the program that made it, and export that",
    ),
    other(
        "KHR_animation_pointer",
        "animation of what is no node, such as materials, lenses and the strength of lights",
        "export it with animation of nodes only",
    ),
    other(
        "KHR_node_visibility",
        "nodes that are switched off are seen",
        "remove what is switched off, and export it again",
    ),
    other(
        "EXT_lights_image_based",
        "the light of its surroundings: give the picture to a SkyLight",
        "export it without",
    ),
    other("EXT_lights_ies", "measured lamps: give their files to PointLight", "export it without"),
    other("MSFT_lod", "other levels of detail than the finest", "export it without"),
    other("KHR_xmp_json_ld", "nothing that is seen", "export it without metadata"),
];

/// Whether a file requires only what is read.
///
/// # Errors
/// What it requires beside, and the cure.
pub(super) fn check_required(json: &Value) -> Result<(), String> {
    let required = json.get("extensionsRequired").and_then(Value::as_array);
    for name in required.into_iter().flatten().filter_map(Value::as_str) {
        if READ.contains(&name) {
            continue;
        }
        let cure = match OTHERS.iter().find(|other| other.name == name) {
            Some(other) => other.cure,
            None => {
                "export it without, or open it in the program that made it and save it as another format"
            }
        };
        return Err(format!("the file requires the extension {name}, which is not read: {cure}"));
    }
    Ok(())
}

/// What is not as it should be where an extension is used; nothing if it is read.
pub(super) fn missing(name: &str) -> Option<String> {
    if READ.contains(&name) {
        return None;
    }
    let known = OTHERS.iter().find(|other| other.name == name);
    let missing = known.map_or("what it says is left out", |other| other.missing);
    let is_missing = if known.is_some() { "; not shown: " } else { ": " };
    Some(format!("the extension {name} is not read{is_missing}{missing}"))
}

/// How a file is made one that does without an extension.
pub(super) fn cure(name: &str) -> &'static str {
    OTHERS.iter().find(|other| other.name == name).map_or("export it without", |other| other.cure)
}
