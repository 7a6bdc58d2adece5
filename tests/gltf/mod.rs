//! glTF: what a file says is what is there, or is told. Every file here is small and made by its test.

#![allow(
    clippy::disallowed_methods,
    reason = "what is expected may be computed by anybody's tangent"
)]

mod faults;
mod looks;
mod places;

use glam::{DVec3, dvec3 as v};
use serde_json::{Value, json};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::fragment::{Gloss, Optics};
use spandrel_engine::light::list::{LightEntry, MakeLamp};
use spandrel_engine::light::{Lamp, Receiver};
use spandrel_engine::scene::read::{self, ReadOptions, Reading};
use spandrel_engine::scene::{AlphaMode, Material, Scene};
use spandrel_engine::texture::{TextureFilter, Wrap};
use spandrel_tests::data;
use spandrel_tests::lights::close;
use spandrel_tests::program::Scratch;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::mutations::damage::made_glb as glb;
use crate::textures::{above, colors, spans};

/// A file in the making: its document, and the bytes of its only buffer.
pub(crate) struct Made {
    pub(crate) json: Value,
    pub(crate) bytes: Vec<u8>,
}

impl Made {
    /// A triangle of (0, 0, 0), (1, 0, 0), (0, 1, 0): accessors 0 (positions) and 1 (indices).
    pub(crate) fn triangle() -> Made {
        let mut made = Made {
            json: json!({
                "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                "accessors": [], "bufferViews": [], "buffers": [],
            }),
            bytes: Vec::new(),
        };
        made.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        made.add("SCALAR", 5123, 3, &[0, 0, 1, 0, 2, 0]);
        made
    }

    /// Adds an accessor of its own buffer view.
    pub(crate) fn add(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let (at, view) = (self.bytes.len(), self.len("bufferViews"));
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": at, "byteLength": bytes.len()}));
        self.bytes.extend(bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "count": count, "type": kind}),
        )
    }

    pub(crate) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let size = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.add(kind, 5126, values.len() / size, &bytes)
    }

    fn len(&self, list: &str) -> usize {
        self.json[list].as_array().map_or(0, Vec::len)
    }

    pub(crate) fn push(&mut self, list: &str, value: Value) -> usize {
        let at = self.len(list);
        if at == 0 {
            self.json[list] = json!([]);
        }
        self.json[list].as_array_mut().unwrap().push(value);
        at
    }

    /// Puts a value at a place of the document, such as `/nodes/0/mesh`.
    pub(crate) fn set(&mut self, place: &str, value: Value) -> &mut Made {
        match self.json.pointer_mut(place) {
            Some(old) => *old = value,
            None => {
                let (above, name) = place.rsplit_once('/').unwrap();
                self.json.pointer_mut(above).unwrap_or_else(|| panic!("{above}"))[name] = value;
            }
        }
        self
    }

    /// A triangle with something at a place.
    fn with(place: &str, value: Value) -> Made {
        let mut made = Made::triangle();
        made.set(place, value);
        made
    }

    /// A triangle of a material.
    fn of(material: Value) -> Made {
        let mut made = Made::with("/materials", json!([material]));
        made.set("/meshes/0/primitives/0/material", json!(0));
        made
    }

    /// As a GLB, which needs no other file.
    fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if self.len("buffers") == 0 {
            json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        }
        glb(&serde_json::to_vec(&json).unwrap(), &self.bytes)
    }

    fn document(&self) -> Result<Reading> {
        let folder = folder();
        let path = folder.path().join("made.glb");
        std::fs::write(&path, self.glb()).unwrap();
        read::document(&path, &ReadOptions::default())
    }

    fn scene(&self) -> Scene {
        let folder = folder();
        let path = folder.path().join("made.glb");
        std::fs::write(&path, self.glb()).unwrap();
        read::scene(&path, None, "made", &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
    }

    fn notes(&self) -> String {
        let notes = self.document().unwrap_or_else(|e| panic!("{e}")).notes;
        let of_file = |note: &String| note.split_once("made.glb: ").expect("a file").1.to_owned();
        notes.iter().map(of_file).collect::<Vec<_>>().join("\n")
    }

    fn error(&self) -> String {
        let error = self.document().err().unwrap_or_else(|| panic!("it is read: {}", self.json));
        let error = error.to_string();
        assert!(error.contains("made.glb"), "no file: {error}");
        error
    }

    /// The material of its only triangle.
    fn material(&self) -> Material {
        let scene = self.scene();
        let instance = &scene.instances[0];
        let front = instance.geometry.mesh().sides(0).front.expect("a material");
        scene.materials[instance.palette[front as usize] as usize].clone()
    }

    /// Its points in the world, instance by instance.
    fn points(&self) -> Vec<Vec<DVec3>> {
        let scene = self.scene();
        let one = |i: &spandrel_engine::scene::Instance| {
            let points = i.geometry.mesh().points.iter();
            points.map(|p| i.world_from_object.transform_point3(*p)).collect()
        };
        scene.instances.iter().map(one).collect()
    }
}

/// A folder of its own for a file.
pub(crate) fn folder() -> Scratch {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    Scratch::new(&format!("gltf-{}", COUNT.fetch_add(1, Ordering::Relaxed)))
}

pub(crate) fn same(points: &[DVec3], expected: &[DVec3]) {
    assert_eq!(points.len(), expected.len(), "{points:?}");
    for (a, b) in points.iter().zip(expected) {
        assert!((*a - *b).length() < 1e-6, "{points:?} for {expected:?}");
    }
}

pub(crate) const TRIANGLE: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];
