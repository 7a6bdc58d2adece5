//! The library of nodes: one file for each node, grouped by what they make. The lights of a scene's
//! list share one file. No node knows another.
//!
//! To add a node, write its file and name it in [`register`].

#![allow(clippy::doc_markdown, reason = "a node's documentation is its manual, not Rust")]

/// Pictures.
pub mod image {
    mod blur;
    mod grade;
    mod lookup;
    mod matte;
    mod over;
    mod panorama;
    mod quantize;
    mod read;
    mod refine;
    mod reformat;
    mod resolve;
    mod segment;
    pub use blur::Blur;
    pub use grade::Grade;
    pub use lookup::Lookup;
    pub use matte::Matte;
    pub use over::Over;
    pub use panorama::Panorama;
    pub use quantize::Quantize;
    pub use read::Read;
    pub use refine::Refine;
    pub use reformat::Reformat;
    pub use resolve::Resolve;
    pub use segment::Segment;
}

/// Light sources.
pub mod light {
    mod listed;
    mod panorama_light;
    mod scene_lights;
    pub use listed::{Listed, ListedLight};
    pub use panorama_light::PanoramaLight;
    pub use scene_lights::SceneLights;
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
    mod background;
    mod billboards;
    mod bsp_tree;
    mod list_priority;
    mod ray_tracing;
    mod scanline;
    pub use background::Background;
    pub use billboards::{Area, Billboards, Row};
    pub use bsp_tree::BspTree;
    pub use list_priority::ListPriority;
    pub use ray_tracing::RayTracing;
    pub use scanline::Scanline;
}

/// Shaders: what surfaces of spans look like.
pub mod shade {
    mod display;
    mod fog;
    mod illuminate;
    mod recolor;
    mod recolor_from;
    mod stream;
    mod trace;
    pub use display::Display;
    pub use fog::Fog;
    pub use illuminate::Illuminate;
    pub use recolor::Recolor;
    pub use recolor_from::RecolorFrom;
    pub use stream::Stream;
    pub use trace::Trace;
}

/// Scenes, volumes and cameras.
pub mod source {
    mod camera;
    mod isosurface;
    mod light_faces;
    mod read_scene;
    mod read_spans;
    mod read_volume;
    mod scene_camera;
    mod wireframe;
    pub use camera::Camera;
    pub use isosurface::{IsoBox, IsoCut, IsoLevel, Isosurface};
    pub use light_faces::LightFaces;
    pub use read_scene::ReadScene;
    pub use read_spans::ReadSpans;
    pub use read_volume::ReadVolume;
    pub use scene_camera::SceneCamera;
    pub use wireframe::Wireframe;
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
use spandrel_engine::light::list;

/// Adds all kinds of node of this library.
pub fn register(registry: &mut Registry) {
    registry
        .register::<image::Blur>()
        .register::<image::Grade>()
        .register::<image::Lookup>()
        .register::<image::Matte>()
        .register::<image::Over>()
        .register::<image::Panorama>()
        .register::<image::Quantize>()
        .register::<image::Read>()
        .register::<image::Refine>()
        .register::<image::Reformat>()
        .register::<image::Resolve>()
        .register::<image::Segment>()
        .register::<light::Listed<list::AmbientLight>>()
        .register::<light::Listed<list::AreaLight>>()
        .register::<light::Listed<list::LinearLight>>()
        .register::<light::Listed<list::ParallelLight>>()
        .register::<light::Listed<list::PointLight>>()
        .register::<light::Listed<list::PolyhedralLight>>()
        .register::<light::Listed<list::SkyLight>>()
        .register::<light::Listed<list::SpotLight>>()
        .register::<light::Listed<list::SunLight>>()
        .register::<light::PanoramaLight>()
        .register::<light::SceneLights>()
        .register::<output::Write>()
        .register::<output::WriteSpans>()
        .register::<render::Background>()
        .register::<render::Billboards>()
        .register::<render::BspTree>()
        .register::<render::ListPriority>()
        .register::<render::RayTracing>()
        .register::<render::Scanline>()
        .register::<shade::Display>()
        .register::<shade::Fog>()
        .register::<shade::Illuminate>()
        .register::<shade::Recolor>()
        .register::<shade::RecolorFrom>()
        .register::<shade::Stream>()
        .register::<shade::Trace>()
        .register::<source::Camera>()
        .register::<source::Isosurface>()
        .register::<source::LightFaces>()
        .register::<source::ReadScene>()
        .register::<source::ReadSpans>()
        .register::<source::ReadVolume>()
        .register::<source::SceneCamera>()
        .register::<source::Wireframe>()
        .register::<span::Crop>()
        .register::<span::DepthMerge>()
        .register::<span::DepthScale>()
        .register::<span::DepthSlice>()
        .register::<span::Holdout>()
        .register::<span::Transform>();
}
