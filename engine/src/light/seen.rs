//! A sky as it is seen: by cameras and in mirrors.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

use super::Lamp;
use crate::color::Color;
use crate::math;

/// A sky, and the discs of suns before it, at an exposure.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SeenSky {
    /// The sky.
    pub sky: Lamp,
    /// Lamps whose [disc](super::Light::disc) is seen.
    pub suns: Vec<Lamp>,
    /// The illuminance in lux under which a white surface shows 1.
    pub white: f32,
}

impl SeenSky {
    /// What is seen in a direction, a unit vector; through a pixel, which `pixel` gives as the steps of the direction
    /// to the next on the right and below, the mean of the discs over it.
    pub fn color(&self, direction: DVec3, pixel: Option<[DVec3; 2]>) -> Color {
        let luminance = self.sky.light.luminance(direction).unwrap_or(Color::BLACK);
        let mut sum = luminance * self.sky.strength;
        for sun in &self.suns {
            let Some((toward, radius)) = sun.light.disc() else { continue };
            // The ground hides what has set of it.
            if direction.y < 0.0 && toward.y >= 0.0 {
                continue;
            }
            let share = share(direction, pixel.unwrap_or_default(), toward, radius);
            let sine = math::sin(radius);
            sum = sum + sun.strength * (share / (PI * sine * sine)) as f32;
        }
        sum * (PI as f32 / self.white)
    }
}

/// How much of a pixel a disc covers, both in the plane that the disc lies in.
fn share(direction: DVec3, [right, down]: [DVec3; 2], toward: DVec3, radius: f64) -> f64 {
    let reach = (right.length() + down.length()) / 2.0;
    // An arc cosine loses half of the digits of small angles, and the disc may be tiny.
    let from = math::atan2(direction.cross(toward).length(), direction.dot(toward));
    if from >= radius + 2.0 * reach {
        return 0.0;
    }
    // Clearly inside or outside: most pixels of a sky.
    if from <= radius - 2.0 * reach || reach == 0.0 {
        return if from <= radius { 1.0 } else { 0.0 };
    }
    let (u, v) = toward.any_orthonormal_pair();
    let corner = |(x, y): (f64, f64)| {
        let way = direction + right * x + down * y;
        let along = way.dot(toward);
        // In the tangent plane the disc is a circle of radius tan, and pixels are polygons.
        (along > 0.0).then(|| DVec2::new(way.dot(u), way.dot(v)) / along)
    };
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(corner);
    let [Some(a), Some(b), Some(c), Some(d)] = corners else { return 0.0 };
    // Green: the area that a polygon and a circle share is a sum over the polygon's edges.
    let edges = [(a, b), (b, c), (c, d), (d, a)];
    let area: f64 = edges.iter().map(|(a, b)| a.perp_dot(*b) / 2.0).sum();
    let radius = math::tan(radius);
    let covered: f64 = edges.iter().map(|(a, b)| within_circle(*a, *b, radius)).sum();
    if area == 0.0 { 0.0 } else { (covered / area).clamp(0.0, 1.0) }
}

/// The signed area of the triangle of the origin and two points that lies in a circle around the origin.
fn within_circle(a: DVec2, b: DVec2, radius: f64) -> f64 {
    let sector = |a: DVec2, b: DVec2| radius * radius / 2.0 * math::atan2(a.perp_dot(b), a.dot(b));
    let way = b - a;
    // Where the edge meets the circle: the roots of a square.
    let (square, half, rest) = (way.dot(way), a.dot(way), a.dot(a) - radius * radius);
    let root = half * half - square * rest;
    if root <= 0.0 || square == 0.0 {
        return sector(a, b);
    }
    // Outside of the circle an edge counts as an arc, inside as itself.
    let [enters, leaves] = [-root.sqrt(), root.sqrt()].map(|root| (root - half) / square);
    if enters >= 1.0 || leaves <= 0.0 {
        return sector(a, b);
    }
    let (p, q) = (a + way * enters.max(0.0), a + way * leaves.min(1.0));
    sector(a, p) + p.perp_dot(q) / 2.0 + sector(q, b)
}
