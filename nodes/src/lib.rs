//! The library of nodes: one file each, grouped by what they make. No node knows another.
//!
//! To add one, write its file and name it in [`register`].

#![allow(clippy::doc_markdown, reason = "a node's documentation is its manual, not Rust")]

/// Pictures.
pub mod image {
    mod read;
    mod resolve;
    pub use read::Read;
    pub use resolve::Resolve;
}

/// Light sources.
pub mod light {
    mod ambient_light;
    mod area_light;
    mod linear_light;
    mod parallel_light;
    mod point_light;
    mod polyhedral_light;
    mod scene_lights;
    mod sky_light;
    mod spot_light;
    mod sun_light;
    pub use ambient_light::AmbientLight;
    pub use area_light::AreaLight;
    pub use linear_light::LinearLight;
    pub use parallel_light::ParallelLight;
    pub use point_light::PointLight;
    pub use polyhedral_light::PolyhedralLight;
    pub use scene_lights::SceneLights;
    pub use sky_light::SkyLight;
    pub use spot_light::SpotLight;
    pub use sun_light::SunLight;
}

/// What leaves the graph.
pub mod output {
    mod write;
    mod write_spans;
    pub use write::Write;
    pub use write_spans::WriteSpans;
}

/// Renderers: scenes to spans.
pub mod render {
    mod scanline;
    pub use scanline::Scanline;
}

/// Shaders: what surfaces of spans look like.
pub mod shade {
    mod fog;
    mod illuminate;
    mod recolor;
    mod recolor_from;
    pub use fog::Fog;
    pub use illuminate::Illuminate;
    pub use recolor::Recolor;
    pub use recolor_from::RecolorFrom;
}

/// Scenes and cameras.
pub mod source {
    mod camera;
    mod light_faces;
    mod read_scene;
    mod read_spans;
    mod scene_camera;
    pub use camera::Camera;
    pub use light_faces::LightFaces;
    pub use read_scene::ReadScene;
    pub use read_spans::ReadSpans;
    pub use scene_camera::SceneCamera;
}

/// Operations on spans.
pub mod span {
    mod crop;
    mod depth_merge;
    mod depth_scale;
    mod depth_slice;
    mod holdout;
    mod transform;
    pub use crop::Crop;
    pub use depth_merge::DepthMerge;
    pub use depth_scale::DepthScale;
    pub use depth_slice::DepthSlice;
    pub use holdout::Holdout;
    pub use transform::Transform;
}

use spandrel_engine::graph::Registry;

/// Adds all kinds of node of this library.
pub fn register(registry: &mut Registry) {
    registry
        .register::<image::Read>()
        .register::<image::Resolve>()
        .register::<light::AmbientLight>()
        .register::<light::AreaLight>()
        .register::<light::LinearLight>()
        .register::<light::ParallelLight>()
        .register::<light::PointLight>()
        .register::<light::PolyhedralLight>()
        .register::<light::SkyLight>()
        .register::<light::SpotLight>()
        .register::<light::SunLight>()
        .register::<light::SceneLights>()
        .register::<output::Write>()
        .register::<output::WriteSpans>()
        .register::<render::Scanline>()
        .register::<shade::Fog>()
        .register::<shade::Illuminate>()
        .register::<shade::Recolor>()
        .register::<shade::RecolorFrom>()
        .register::<source::Camera>()
        .register::<source::LightFaces>()
        .register::<source::ReadScene>()
        .register::<source::ReadSpans>()
        .register::<source::SceneCamera>()
        .register::<span::Crop>()
        .register::<span::DepthMerge>()
        .register::<span::DepthScale>()
        .register::<span::DepthSlice>()
        .register::<span::Holdout>()
        .register::<span::Transform>();
}
