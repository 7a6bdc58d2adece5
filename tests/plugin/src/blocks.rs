//! A reader of scenes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::plugin::*;
use std::path::Path;

/// Reads a town of blocks: a text of lines `x z width height`, in metres.
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct ReadBlocks {
    /// The file.
    pub file: InFile,
    /// The colour of all blocks.
    pub color: Color,
}

impl Node for ReadBlocks {
    type Output = Scene;
    const KIND: &'static str = "ReadBlocks";
    const GROUP: &'static str = "studio";

    fn demand(&self, (): &(), _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Scene> {
        let path = self.file.under(inputs.directory());
        let bytes = read_bytes(&path)?;
        let text = read_text(&path, &bytes)?.text;
        let mut root = Object::new("", Shape::Group);
        for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            root.children.push(block(&path, number + 1, line)?);
        }
        let mut document = Document::with_plan(Plan { root, ..Plan::default() });
        let material = Material { color: self.color, ..Material::default() };
        document.materials.insert("block".to_owned(), material);
        Scene::new(&document, None, &self.file.0, Key::of(&document), inputs.directory())
    }
}

/// The block of a line.
fn block(path: &Path, number: usize, line: &str) -> Result<Object> {
    let words: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [x, z, width, height] = words[..] else {
        let message = "a block is four numbers: x, z, width and height in metres";
        return Err(Error::at_line(path, number, 1, message));
    };
    let mut block =
        Object::new(format!("block {number}"), Shape::Box { size: [width, height, width] });
    block.transform = Transform(vec![Step::Move(x, 0.0, z)]);
    block.material = Some("block".to_owned());
    Ok(block)
}
