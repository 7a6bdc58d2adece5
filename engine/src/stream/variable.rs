//! What a program reads of fragments.

/// What a program reads of fragments, in places.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Variable {
    /// The place in the world, in metres: x, y, z.
    World(u32),
    /// The place in the object's own space.
    Object(u32),
    /// The unit normal on the side that is seen.
    Normal(u32),
    /// The unit vector to where it is seen from.
    Eye(u32),
    /// Texture coordinates: u, v.
    Texture(u32),
    /// The place in the picture, in shares of its width and height from the top left.
    Screen(u32),
    /// The colour: red, green, blue.
    Color(u32),
    /// How much of what lies behind is hidden.
    Alpha,
    /// The distance along the view axis, in metres.
    Depth,
    /// What a pixel covers in the world, in metres.
    Width,
    /// What a pixel covers in the object's space (0), in texture coordinates (1), and in the picture (2).
    WidthOf(u32),
    /// The share of its pixel that the fragment covers, 0 to 1.
    Coverage,
    /// The face, by its number.
    Face,
    /// 1 on the front of a face, 0 on its back.
    Front,
    /// The object, by a number below 2^24 that belongs to its name.
    ObjectNumber,
    /// The material, by a number below 2^24 that belongs to its name.
    MaterialNumber,
    /// Whether the object's name fits one of the program's patterns, by its number.
    ObjectFits(u32),
    /// Whether the material's name fits one of the program's patterns, by its number.
    MaterialFits(u32),
    /// A part of one of the channels that the program was told of, by its number.
    Channel(u32, u32),
}

impl Variable {
    /// The names of variables.
    pub(super) const NAMES: [&'static str; 19] = [
        "P", "Po", "N", "I", "u", "v", "x", "y", "color", "Cs", "alpha", "normal", "depth",
        "width", "coverage", "face", "front", "object", "material",
    ];

    /// A variable by its name: its parts, and what a pixel covers of it.
    pub(super) fn named(name: &str) -> Option<(Vec<Variable>, Option<Variable>)> {
        use Variable as V;
        let three = |of: fn(u32) -> Variable| (0..3).map(of).collect::<Vec<_>>();
        Some(match name {
            "P" => (three(V::World), Some(V::Width)),
            "Po" => (three(V::Object), Some(V::WidthOf(0))),
            "N" | "normal" => (three(V::Normal), None),
            "I" => (three(V::Eye), None),
            "u" => (vec![V::Texture(0)], Some(V::WidthOf(1))),
            "v" => (vec![V::Texture(1)], Some(V::WidthOf(1))),
            "x" => (vec![V::Screen(0)], Some(V::WidthOf(2))),
            "y" => (vec![V::Screen(1)], Some(V::WidthOf(2))),
            "color" | "Cs" => (three(V::Color), None),
            "alpha" => (vec![V::Alpha], None),
            "depth" => (vec![V::Depth], None),
            "width" => (vec![V::Width], None),
            "coverage" => (vec![V::Coverage], None),
            "face" => (vec![V::Face], None),
            "front" => (vec![V::Front], None),
            "object" => (vec![V::ObjectNumber], None),
            "material" => (vec![V::MaterialNumber], None),
            _ => return None,
        })
    }
}
