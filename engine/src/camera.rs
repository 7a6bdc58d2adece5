//! Cameras, and the projection that they make of a raster.
//!
//! The world is right-handed, y up, in metres. A camera looks down its own -z: the *eye space* has x
//! to the right, y up and z towards the viewer. The *distance* d of a point is measured along the
//! view axis, d = -z. Its *depth* is rho = 1/d for a perspective camera and rho = -d for a parallel
//! one: affine in screen x and y on every plane, and larger where nearer, as \[N] asks of "perspective
//! depth".

use glam::{DAffine3, DMat3, DMat4, DVec2, DVec3, DVec4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::math;
use crate::raster::Raster;

/// A camera, perspective or parallel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// Where the eye is, in metres.
    #[schemars(with = "[f64; 3]")]
    pub position: DVec3,
    /// The point in the middle of the picture (before `shift`), in metres.
    #[schemars(with = "[f64; 3]")]
    pub look_at: DVec3,
    /// The direction that is up in the picture. A camera that looks along it takes -z instead, so
    /// that plans come out with north at the top.
    #[schemars(with = "[f64; 3]")]
    pub up: DVec3,
    /// Turns the camera about its view axis, in degrees, counter-clockwise as the camera sees it: the
    /// picture turns clockwise.
    pub roll: f64,
    /// Angle between the top and the bottom of the picture, in degrees, above 0 and below 180.
    #[schemars(range(min = 1e-6, max = 179.999999))]
    pub field_of_view: f64,
    /// Height of the picture in metres. Given, the projection is parallel, and `field_of_view` does
    /// nothing.
    pub parallel_height: Option<f64>,
    /// Lens shift to the right and up, in widths and heights of the picture: (0, 0.5) shows what was
    /// above the upper half without tilting the camera, so that verticals stay vertical.
    #[schemars(with = "[f64; 2]")]
    pub shift: DVec2,
    /// Distance of the front plane in metres: nothing nearer is seen. 0, the default, is the eye
    /// itself (a parallel camera then sees what is behind it only with a negative distance).
    pub front: f64,
    /// Distance of the back plane in metres: nothing beyond it is seen. Absent, there is none.
    pub back: Option<f64>,
    /// The part of the raster that shows the scene: left, bottom, right, top in [0, 1], y up, as in
    /// \[D]'s normalised projection coordinates. Outside there is background.
    pub viewport: [f64; 4],
}

impl Default for Camera {
    fn default() -> Camera {
        Camera {
            position: DVec3::new(0.0, 0.0, 10.0),
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            roll: 0.0,
            field_of_view: 40.0,
            parallel_height: None,
            shift: DVec2::ZERO,
            front: 0.0,
            back: None,
            viewport: [0.0, 0.0, 1.0, 1.0],
        }
    }
}

impl Camera {
    /// The fields in which two cameras differ, as each has them.
    pub fn differences(&self, other: &Camera) -> [String; 2] {
        let fields = |camera: &Camera| serde_json::to_value(camera).unwrap_or_default();
        let (a, b) = (fields(self), fields(other));
        let names = a.as_object().into_iter().flat_map(|fields| fields.keys());
        let differing: Vec<&String> = names.filter(|name| a[*name] != b[*name]).collect();
        [a.clone(), b.clone()].map(|fields| {
            let parts = differing.iter().map(|name| format!("{name} {}", fields[*name]));
            parts.collect::<Vec<_>>().join(", ")
        })
    }

    /// The rotation from world axes to eye axes.
    fn rotation(&self) -> Result<DMat3> {
        let forward = (self.look_at - self.position).try_normalize().ok_or_else(|| {
            Error::invalid(
                "the camera's `look_at` and `position` are the same point: move one of them",
            )
        })?;
        // Of -z and y at least one is not along the view.
        let right = [self.up, DVec3::NEG_Z, DVec3::Y]
            .into_iter()
            .filter_map(DVec3::try_normalize)
            .map(|up| forward.cross(up))
            .find(|right| right.length() > 1e-9)
            .unwrap_or(DVec3::X)
            .normalize();
        let up = right.cross(forward);
        let (sin, cos) = (math::sin(self.roll.to_radians()), math::cos(self.roll.to_radians()));
        let (right, up) = (right * cos + up * sin, up * cos - right * sin);
        Ok(DMat3::from_cols(right, up, -forward).transpose())
    }

    fn check(&self) -> Result<()> {
        let numbers = [
            &self.position.to_array()[..],
            &self.look_at.to_array(),
            &self.up.to_array(),
            &self.shift.to_array(),
            &self.viewport,
            &[self.roll, self.field_of_view, self.front],
            &[self.back.unwrap_or(0.0), self.parallel_height.unwrap_or(1.0)],
        ];
        if !numbers.iter().all(|part| part.iter().all(|v| v.is_finite())) {
            return Err(Error::invalid("the camera has a number that is not finite"));
        }
        let places = [self.position, self.look_at];
        let lengths = [self.front, self.back.unwrap_or(0.0), self.parallel_height.unwrap_or(1.0)];
        if !places.iter().all(|place| math::is_within_reach(*place))
            || !lengths.iter().all(|length| length.abs() <= math::REACH)
        {
            return Err(Error::invalid(format!(
                "the camera has a place or a length beyond {:e} m: make the world smaller",
                math::REACH
            )));
        }
        let ends = 0.0..180.0;
        if self.parallel_height.is_none()
            && (self.field_of_view <= 0.0 || !ends.contains(&self.field_of_view))
        {
            let angle = self.field_of_view;
            return Err(Error::invalid(format!(
                "the camera's field_of_view is {angle} degrees: must be above 0 and below 180"
            )));
        }
        if self.parallel_height.is_some_and(|height| height <= 0.0) {
            return Err(Error::invalid("the camera's parallel_height must be above 0"));
        }
        if self.parallel_height.is_none() && self.front < 0.0 {
            return Err(Error::invalid(
                "a perspective camera's front plane cannot lie behind the eye",
            ));
        }
        if self.back.is_some_and(|back| back <= self.front) {
            return Err(Error::invalid("the camera's back plane must lie beyond its front plane"));
        }
        let [left, bottom, right, top] = self.viewport;
        if !(0.0 <= left
            && left < right
            && right <= 1.0
            && 0.0 <= bottom
            && bottom < top
            && top <= 1.0)
        {
            return Err(Error::invalid(
                "the camera's viewport is (left, bottom, right, top) within [0, 1], not empty",
            ));
        }
        Ok(())
    }
}

/// A camera at a raster: the projection from the world to the screen.
///
/// Screen coordinates are pixels, (0, 0) top left. A view is equal to another exactly if both project
/// every point alike; images can be merged only if their views are equal.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    camera: Camera,
    raster: Raster,
    rotation: DMat3,
    /// Pixels per unit of tangent (perspective) or per metre (parallel).
    scale: f64,
    /// Where the view axis meets the screen, in pixels.
    centre: DVec2,
    /// The viewport in pixels: left, top, right, bottom.
    window: [f64; 4],
}

/// A point in homogeneous screen coordinates: it is seen at (x/w, y/w) pixels with depth r/w, if
/// w is above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homogeneous {
    /// w times screen x.
    pub x: f64,
    /// w times screen y.
    pub y: f64,
    /// w times depth.
    pub r: f64,
    /// The distance (perspective) or 1 (parallel).
    pub w: f64,
}

/// The depth of a plane over the screen: rho = a x + b y + c, x and y in pixels.
///
/// This is all that is known of a face's depth: \[N]'s stored depth and slope at each intersection are
/// this function and its `a`, exact and without drift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Depth slope per pixel to the right.
    pub a: f64,
    /// Depth slope per pixel downwards.
    pub b: f64,
    /// Depth at the raster's top left corner.
    pub c: f64,
}

impl Plane {
    /// The depth at a point in pixels.
    #[inline(always)]
    pub fn depth(&self, x: f64, y: f64) -> f64 {
        self.a * x + self.b * y + self.c
    }

    /// The least and the greatest depth over a rectangle, given by its sides and its ends in pixels.
    pub fn range(&self, x: [f64; 2], y: [f64; 2]) -> (f64, f64) {
        let corners = x.into_iter().flat_map(|x| y.map(|y| self.depth(x, y)));
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        corners.fold(ends, |(least, most), depth| (least.min(depth), most.max(depth)))
    }

    /// A plane that faces the viewer at one depth everywhere.
    pub fn constant(depth: f64) -> Plane {
        Plane { a: 0.0, b: 0.0, c: depth }
    }
}

impl View {
    /// A camera at a raster. Pixels are square: the raster's shape decides the picture's width.
    ///
    /// # Errors
    /// If the camera contradicts itself or has a number that is not finite.
    pub fn new(camera: &Camera, raster: Raster) -> Result<View> {
        camera.check()?;
        let rotation = camera.rotation()?;
        let (width, height) = (f64::from(raster.width), f64::from(raster.height));
        let [left, bottom, right, top] = camera.viewport;
        let window = [left * width, (1.0 - top) * height, right * width, (1.0 - bottom) * height];
        let (shown_width, shown_height) = (window[2] - window[0], window[3] - window[1]);
        let extent = match camera.parallel_height {
            Some(metres) => metres,
            None => 2.0 * math::tan(camera.field_of_view.to_radians() / 2.0),
        };
        let centre = DVec2::new(
            // The picture moves against the lens.
            (window[0] + window[2]) / 2.0 - camera.shift.x * shown_width,
            (window[1] + window[3]) / 2.0 + camera.shift.y * shown_height,
        );
        let scale = shown_height / extent;
        Ok(View { camera: camera.clone(), raster, rotation, scale, centre, window })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The raster.
    pub fn raster(&self) -> Raster {
        self.raster
    }

    /// The viewport in pixels: left, top, right, bottom.
    pub fn window(&self) -> [f64; 4] {
        self.window
    }

    /// Whether the projection is parallel.
    pub fn is_parallel(&self) -> bool {
        self.camera.parallel_height.is_some()
    }

    /// The transform from an object's space to the eye's.
    pub fn eye_from_object(&self, world_from_object: &DAffine3) -> DAffine3 {
        DAffine3 {
            matrix3: self.rotation * world_from_object.matrix3,
            // The subtraction comes first: far from the origin it cancels what rotation would round.
            translation: self.rotation * (world_from_object.translation - self.camera.position),
        }
    }

    /// From the world to the screen in homogeneous coordinates, for columns: x and y in pixels from the top left, depth,
    /// and what all are divided by.
    pub fn screen_from_world(&self) -> DMat4 {
        let place = |eye: DVec3| {
            let Homogeneous { x, y, r, w } = self.project(eye);
            DVec4::new(x, y, r, w)
        };
        // The projection is affine: a column is what a step along an axis adds.
        let start = place(DVec3::ZERO);
        let [x, y, z] = DVec3::AXES.map(|axis| place(axis) - start);
        DMat4::from_cols(x, y, z, start) * DMat4::from(self.eye_from_object(&DAffine3::IDENTITY))
    }

    /// The screen place of a point in eye space.
    #[inline(always)]
    pub fn project(&self, eye: DVec3) -> Homogeneous {
        let (w, r) = if self.is_parallel() { (1.0, eye.z) } else { (-eye.z, 1.0) };
        Homogeneous {
            x: self.centre.x * w + self.scale * eye.x,
            y: self.centre.y * w - self.scale * eye.y,
            r,
            w,
        }
    }

    /// The depth of the plane through `point` with normal `normal`, both in eye space. Its
    /// coefficients are infinite or NaN where the plane is seen exactly edge-on.
    pub fn plane(&self, normal: DVec3, point: DVec3) -> Plane {
        let offset = normal.dot(point);
        let (nx, ny) = (normal.x / self.scale, normal.y / self.scale);
        let across = nx * self.centre.x - ny * self.centre.y;
        if self.is_parallel() {
            let k = 1.0 / normal.z;
            Plane { a: -nx * k, b: ny * k, c: (offset + across) * k }
        } else {
            // The eye is the origin: a plane through it has the offset 0, and no finite depth.
            let k = 1.0 / offset;
            Plane { a: nx * k, b: -ny * k, c: (-normal.z - across) * k }
        }
    }

    /// Whether a plane's normal points to the viewer's side.
    pub fn faces_viewer(&self, normal: DVec3, point: DVec3) -> bool {
        // In perspective it depends on the place: the way to the point runs against the normal.
        if self.is_parallel() { normal.z > 0.0 } else { normal.dot(point) < 0.0 }
    }

    /// The point in eye space that is seen at (x, y) pixels with depth `rho`.
    #[inline(always)]
    pub fn eye_point(&self, x: f64, y: f64, rho: f64) -> DVec3 {
        let (sx, sy) = ((x - self.centre.x) / self.scale, (y - self.centre.y) / self.scale);
        if self.is_parallel() {
            DVec3::new(sx, -sy, rho)
        } else {
            DVec3::new(sx / rho, -sy / rho, -1.0 / rho)
        }
    }

    /// The point of the world that is seen at (x, y) pixels with depth `rho`, in metres.
    #[inline(always)]
    pub fn world_point(&self, x: f64, y: f64, rho: f64) -> DVec3 {
        self.world_direction(self.eye_point(x, y, rho)) + self.camera.position
    }

    /// A direction of eye space in world axes.
    #[inline(always)]
    pub fn world_direction(&self, eye: DVec3) -> DVec3 {
        self.rotation.transpose() * eye
    }

    /// On which side of a plane of the world, through `point` with normal `normal`, lies what is seen of a
    /// face with the depth `plane`: a function of x and y on the screen that has the sign of the distance,
    /// affine like depth itself. (It is the distance times rho or, under parallel cameras, the distance.)
    pub fn side_of(&self, normal: DVec3, point: DVec3, plane: &Plane) -> Plane {
        let n = self.rotation * normal;
        // The eye's own distance from the plane: the difference first, for worlds far from the
        // origin.
        let eye = normal.dot(self.camera.position - point);
        let (nx, ny) = (n.x / self.scale, n.y / self.scale);
        let across = ny * self.centre.y - nx * self.centre.x;
        let (by_depth, constant) =
            if self.is_parallel() { (n.z, eye + across) } else { (eye, across - n.z) };
        Plane {
            a: nx + by_depth * plane.a,
            b: -ny + by_depth * plane.b,
            c: constant + by_depth * plane.c,
        }
    }

    /// The plane of the world that has a depth: its unit normal to the viewer's side, and a point on it.
    /// `None` if it has no normal: it passes through the eye.
    pub fn world_plane(&self, plane: &Plane) -> Option<(DVec3, DVec3)> {
        let (right, down) = (plane.a * self.scale, plane.b * self.scale);
        let middle = plane.depth(self.centre.x, self.centre.y);
        // In eye space, perspective: right x - down y - middle z = 1; parallel: z = middle + right x - down y.
        let (normal, point) = if self.is_parallel() {
            (DVec3::new(-right, down, 1.0), DVec3::new(0.0, 0.0, middle))
        } else {
            let normal = DVec3::new(right, -down, -middle);
            // Its foot from the eye, n / |n|^2; the viewer is on the side away from it.
            let foot = normal / normal.length_squared();
            (-normal, foot)
        };
        let normal = normal.try_normalize()?;
        point.is_finite().then(|| {
            (self.world_direction(normal), self.world_direction(point) + self.camera.position)
        })
    }

    /// The distance d in metres that belongs to a depth.
    #[inline(always)]
    pub fn distance(&self, rho: f64) -> f64 {
        if self.is_parallel() { -rho } else { 1.0 / rho }
    }

    /// The depth that belongs to a distance in metres.
    pub fn depth(&self, distance: f64) -> f64 {
        if self.is_parallel() { -distance } else { 1.0 / distance }
    }

    /// The width of a pixel at a distance in metres, seen straight on, and by how much it grows per metre.
    pub fn pixel_width(&self, distance: f64) -> (f64, f64) {
        let width = 1.0 / self.scale;
        if self.is_parallel() { (width, 0.0) } else { (width * distance, width) }
    }

    /// The greatest and the least depth that is seen: the front and the back plane.
    pub fn depth_range(&self) -> (f64, f64) {
        let unbounded = if self.is_parallel() { f64::NEG_INFINITY } else { 0.0 };
        let nearest = if self.is_parallel() || self.camera.front > 0.0 {
            self.depth(self.camera.front)
        } else {
            f64::INFINITY
        };
        (nearest, self.camera.back.map_or(unbounded, |back| self.depth(back)))
    }

    /// \[D]'s normalised projection coordinates of a point of the world: x and y in [0, 1] over the
    /// whole raster, y up; z is 1 on the front plane and 0 on the back plane (at infinity, if there is
    /// none), affine in depth. `None` for a point that is not in front of the eye, or if the camera's
    /// planes leave z undefined (a front plane at the eye itself).
    pub fn normalised(&self, world: DVec3) -> Option<DVec3> {
        let p = self.project(self.rotation * (world - self.camera.position));
        let (front, back) = self.depth_range();
        if p.w <= 0.0 || !front.is_finite() || !back.is_finite() {
            return None;
        }
        let (width, height) = (f64::from(self.raster.width), f64::from(self.raster.height));
        let z = (p.r / p.w - back) / (front - back);
        Some(DVec3::new(p.x / p.w / width, 1.0 - p.y / p.w / height, z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raster() -> Raster {
        Raster::new(200, 100).unwrap()
    }

    fn cameras() -> Vec<Camera> {
        let skew = Camera {
            position: DVec3::new(3.0, 4.0, 5.0),
            look_at: DVec3::new(-1.0, 0.5, 2.0),
            roll: 20.0,
            shift: DVec2::new(0.1, -0.2),
            front: 0.5,
            back: Some(90.0),
            viewport: [0.1, 0.2, 0.7, 0.9],
            ..Camera::default()
        };
        vec![skew.clone(), Camera { parallel_height: Some(8.0), ..skew }]
    }

    #[test]
    fn what_is_looked_at_is_in_the_middle() {
        let view = View::new(&Camera::default(), raster()).unwrap();
        let eye = view.eye_from_object(&DAffine3::IDENTITY).transform_point3(DVec3::ZERO);
        let p = view.project(eye);
        assert_eq!((p.x / p.w, p.y / p.w, p.w), (100.0, 50.0, 10.0));
    }

    #[test]
    fn y_grows_downwards_and_the_field_of_view_is_the_height() {
        let camera = Camera { field_of_view: 90.0, ..Camera::default() };
        let view = View::new(&camera, raster()).unwrap();
        let p = view.project(DVec3::new(0.0, 10.0, -10.0));
        assert!((p.y / p.w).abs() < 1e-12);
    }

    #[test]
    fn points_return_from_the_screen() {
        for camera in cameras() {
            let view = View::new(&camera, raster()).unwrap();
            let world = DVec3::new(-0.5, 1.0, 1.5);
            let p = view.project(view.eye_from_object(&DAffine3::IDENTITY).transform_point3(world));
            let back = view.world_point(p.x / p.w, p.y / p.w, p.r / p.w);
            assert!((back - world).length() < 1e-12, "{back} {world}");
        }
    }

    #[test]
    fn a_planes_depth_is_affine_on_the_screen() {
        for camera in cameras() {
            let view = View::new(&camera, raster()).unwrap();
            let eye = view.eye_from_object(&DAffine3::IDENTITY);
            let (origin, u, v) =
                (DVec3::new(0.0, 0.0, 0.5), DVec3::new(1.0, 0.2, 0.0), DVec3::new(0.1, 0.9, 0.4));
            let plane = view.plane(eye.transform_vector3(u.cross(v)), eye.transform_point3(origin));
            for (s, t) in [(0.0, 0.0), (1.0, 0.0), (0.3, -0.8), (-2.0, 1.5)] {
                let p = view.project(eye.transform_point3(origin + u * s + v * t));
                let depth = plane.depth(p.x / p.w, p.y / p.w);
                assert!((depth - p.r / p.w).abs() < 1e-12 * depth.abs().max(1.0));
            }
        }
    }

    #[test]
    fn sides_and_planes_of_the_world_are_seen_through_depth() {
        for camera in cameras() {
            let view = View::new(&camera, raster()).unwrap();
            let eye = view.eye_from_object(&DAffine3::IDENTITY);
            let (origin, u, v) =
                (DVec3::new(0.0, 0.0, 0.5), DVec3::new(1.0, 0.2, 0.0), DVec3::new(0.1, 0.9, 0.4));
            let plane = view.plane(eye.transform_vector3(u.cross(v)), eye.transform_point3(origin));
            let (normal, point) = view.world_plane(&plane).unwrap();
            assert!((point - origin).dot(u.cross(v)).abs() < 1e-12);
            assert!(normal.cross(u.cross(v)).length() < 1e-12);
            let to_viewer = camera.position - camera.look_at;
            assert!(normal.dot(to_viewer) > 0.0);
            let (m, q) = (DVec3::new(0.3, -0.5, 0.2), DVec3::new(0.2, 0.1, -0.3));
            let side = view.side_of(m, q, &plane);
            for (s, t) in [(0.0, 0.0), (1.0, 0.0), (0.3, -0.8), (-2.0, 1.5)] {
                let world = origin + u * s + v * t;
                let p = view.project(eye.transform_point3(world));
                let factor = if view.is_parallel() { 1.0 } else { p.r / p.w };
                let expected = m.dot(world - q) * factor;
                assert!((side.depth(p.x / p.w, p.y / p.w) - expected).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn normalised_coordinates_fill_the_unit_cube() {
        let camera = Camera { front: 2.0, back: Some(50.0), ..Camera::default() };
        let view = View::new(&camera, raster()).unwrap();
        let at = |z: f64| view.normalised(DVec3::new(0.0, 0.0, 10.0 - z)).unwrap();
        assert!((at(2.0) - DVec3::new(0.5, 0.5, 1.0)).length() < 1e-12);
        assert!((at(50.0) - DVec3::new(0.5, 0.5, 0.0)).length() < 1e-12);
        assert_eq!(view.normalised(DVec3::new(0.0, 0.0, 11.0)), None);
    }

    #[test]
    fn contradictory_cameras_are_refused() {
        let bad = [
            Camera { look_at: DVec3::new(0.0, 0.0, 10.0), ..Camera::default() },
            Camera { field_of_view: 180.0, ..Camera::default() },
            Camera { field_of_view: f64::NAN, ..Camera::default() },
            Camera { parallel_height: Some(0.0), ..Camera::default() },
            Camera { front: 5.0, back: Some(4.0), ..Camera::default() },
            Camera { viewport: [0.5, 0.0, 0.5, 1.0], ..Camera::default() },
        ];
        for camera in bad {
            assert!(View::new(&camera, raster()).is_err(), "{camera:?}");
        }
    }

    #[test]
    fn looking_straight_down_has_north_at_the_top() {
        let camera = Camera {
            position: DVec3::new(0.0, 10.0, 0.0),
            look_at: DVec3::ZERO,
            ..Camera::default()
        };
        let view = View::new(&camera, raster()).unwrap();
        let p =
            view.project(view.eye_from_object(&DAffine3::IDENTITY).transform_point3(DVec3::NEG_Z));
        assert!(p.y / p.w < 50.0);
    }
}
