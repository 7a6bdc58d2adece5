//! Which faces of a table stand in another too.

use super::face::{Face, FaceTable, Role};

/// By place in a table, the place of the same face in another: with the same shape on the screen, at the same depth, in
/// the same order among those that both have. Faces are looked for under their ordinals; where whole objects came or
/// went, those after the last difference are found from the end.
pub(crate) fn matched(now: &FaceTable, was: &FaceTable) -> Vec<Option<u32>> {
    let (faces, old) = (now.faces(), was.faces());
    let mut found: Vec<Option<u32>> = vec![None; faces.len()];
    // From the end, as far as they are the same.
    let shift = old.len() as i64 - faces.len() as i64;
    let tail = faces.iter().rev().zip(old.iter().rev());
    let is_same = |(a, b): &(&Face, &Face)| is_alike((now, a), (was, b), shift);
    let tail = tail.take_while(is_same).count();
    let (ends, old_end) = (faces.len() - tail, old.len() - tail);
    for (slot, was) in found[ends..].iter_mut().zip(old_end as u32..) {
        *slot = Some(was);
    }
    let mut from = 0;
    for (at, face) in faces[..ends].iter().enumerate() {
        from += old[from..old_end].partition_point(|face_was| face_was.ordinal < face.ordinal);
        let Some(known) = old[..old_end].get(from).filter(|f| f.ordinal == face.ordinal) else {
            continue;
        };
        if is_alike((now, face), (was, known), from as i64 - at as i64) {
            found[at] = Some(from as u32);
        }
    }
    // A seal ends where its face does.
    for at in 0..faces.len() {
        if let Role::Seal(parent) = faces[at].role
            && found[parent as usize].is_none()
        {
            found[at] = None;
        }
    }
    found
}

fn is_alike((now, a): (&FaceTable, &Face), (was, b): (&FaceTable, &Face), shift: i64) -> bool {
    let roles = match (a.role, b.role) {
        (Role::Seal(a), Role::Seal(b)) => i64::from(a) + shift == i64::from(b),
        (a, b) => a == b,
    };
    roles
        && a.plane == b.plane
        && a.rank == b.rank
        && a.sees_front == b.sees_front
        && a.is_translucent == b.is_translucent
        && now.corner_count(a) == was.corner_count(b)
        && now.corners(a).zip(was.corners(b)).all(|((p, p_ends), (q, q_ends))| {
            p_ends == q_ends && now.points()[p as usize] == was.points()[q as usize]
        })
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::matched;
    use crate::camera::Plane;
    use crate::span::{FaceHead, FaceTable, FaceTableBuilder, Role};

    /// Squares at some places, under the ordinals 0, 1 and so on; a seal on the first.
    fn table(places: &[f64]) -> FaceTable {
        let mut builder = FaceTableBuilder::new();
        for (at, x) in places.iter().enumerate() {
            let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
            let points = corners.map(|(right, down)| DVec2::new(x + right, down));
            let first = builder.points(points).unwrap();
            let role = if at == 1 { Role::Seal(0) } else { Role::Face };
            let head = FaceHead {
                ordinal: at as u32,
                plane: Plane::constant(1.0),
                rank: u32::from(at == 1),
                role,
                sees_front: true,
                is_translucent: false,
            };
            let ring: Vec<u32> = (first..first + 4).collect();
            builder.face(head, [&*ring]).unwrap();
        }
        builder.finish()
    }

    #[test]
    fn faces_are_found_under_their_numbers_and_from_the_end() {
        let was = table(&[0.0, 0.2, 3.0, 4.0, 5.0, 6.0]);
        let same = (0..6).map(Some).collect::<Vec<_>>();
        assert_eq!(matched(&was, &was), same);
        let moved = table(&[0.0, 0.2, 3.5, 4.0, 5.0, 6.0]);
        assert_eq!(matched(&moved, &was), [Some(0), Some(1), None, Some(3), Some(4), Some(5)]);
        // One is gone: those before it and after it are there.
        let fewer = table(&[0.0, 0.2, 3.0, 5.0, 6.0]);
        assert_eq!(matched(&fewer, &was), [Some(0), Some(1), Some(2), Some(4), Some(5)]);
        assert_eq!(matched(&was, &fewer), [Some(0), Some(1), Some(2), None, Some(3), Some(4)]);
        // What a seal lies on has moved: it ends elsewhere.
        let under = table(&[0.1, 0.2, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(matched(&under, &was)[..3], [None, None, Some(2)]);
    }
}
