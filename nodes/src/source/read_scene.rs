//! The node `ReadScene`: reads a scene file, with options (\[D], "Geometry data structure").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::InFile;
use spandrel_engine::graph::{Inputs, Node, Upstream};
use spandrel_engine::scene::Scene;
use spandrel_engine::scene::read::{self, Axis, ReadOptions};
use spandrel_engine::text::AnyValue;
use std::collections::BTreeMap;
use std::path::Path;

/// Reads a scene: glTF, OBJ, PLY, STL, CityJSON, CityGML, or Spandrel's own text and binary
/// formats.
///
/// A link to a scene may name the file directly. This node is for files that need options.
///
/// Example: `ReadScene(file: "city.city.json", lod: 2, pictures: false)`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct ReadScene {
    /// The file.
    pub file: InFile,
    /// The plan to read. If absent, the file's default plan, or its only one.
    pub plan: Option<String>,
    /// Metres per unit of the file. If absent, what the format says.
    pub unit: Option<f64>,
    /// The axis that points up in the file. If absent, what the format says.
    pub up: Option<Axis>,
    /// A point in the file's coordinates that becomes the origin. Use it for maps, whose
    /// coordinates are far from it.
    pub origin: Option<[f64; 3]>,
    /// Gives smooth shading to meshes without normals, where faces meet at less than this angle, in
    /// degrees.
    #[schemars(range(min = 0.0, max = 180.0))]
    pub crease: Option<f64>,
    /// Whether surfaces show their pictures. Use `false` when the pictures are not at hand. A
    /// missing material library is then no error either.
    pub pictures: Option<bool>,
    /// The level of detail of a city's buildings, such as 1 or 2.2. A building and its parts are
    /// shown in one level: this one, or the nearest coarser level that they have. A whole number
    /// includes its finest refinement (2.2 for 2). If absent, each building's finest level.
    #[schemars(range(min = 0.0, max = 9.0))]
    pub lod: Option<f64>,
    /// The animation of a glTF file that is played, by its name. If absent, the file's first.
    pub animation: Option<String>,
    /// The objects to take, by patterns of their paths such as `house/*`; the name of a group takes all
    /// that is in it. Others are not there: they cast no shadow either. If absent, all.
    pub objects: Vec<String>,
    /// Values for the parameters of a scene in RON, by name, such as `{"autumn": Ref("autumn")}` for
    /// the graph's own. If absent, as the file has them.
    pub parameters: BTreeMap<String, AnyValue>,
    /// The scene's name in messages and object names. If absent, the file's path.
    pub name: Option<String>,
}

impl Node for ReadScene {
    type Output = Scene;
    const KIND: &'static str = "ReadScene";
    const GROUP: &'static str = "source";
    const ALIASES: &'static [&'static str] = &["ReadGeo", "SceneReader", "Import", "Geometry"];

    fn moves(&self, directory: &Path) -> bool {
        // A file that cannot be read is told where it is needed.
        read::moves(&self.file.under(directory)).unwrap_or(false)
    }

    fn demand(&self, (): &(), _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Scene> {
        let moment = inputs.moment();
        let ReadScene { file, plan, unit, up, origin, crease, pictures, .. } = self;
        let ReadScene { lod, animation, objects, parameters, name, .. } = self;
        let (unit, up, origin, crease, pictures) = (*unit, *up, *origin, *crease, *pictures);
        let (lod, animation) = (*lod, animation.clone());
        let (objects, parameters) = (objects.clone(), parameters.clone());
        let options = ReadOptions {
            unit,
            up,
            origin,
            crease,
            pictures,
            lod,
            moment,
            animation,
            objects,
            parameters,
        };
        let label = name.as_deref().unwrap_or(&file.0);
        let scene = read::scene(&file.under(inputs.directory()), plan.as_deref(), label, &options)?;
        scene.notes.iter().for_each(|note| inputs.warn(note));
        scene.missing_pictures().iter().for_each(|missing| inputs.warn(missing));
        let without_area: usize = scene.faults().map(|(_, faults)| faults.without_area).sum();
        if without_area > 0 {
            let file = &file.0;
            inputs.warn(&format!(
                "{without_area} of its faces have no area and are left out: see `spandrel info {file}`"
            ));
        }
        Ok(scene)
    }
}
