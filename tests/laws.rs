//! Laws: sentences of the design that hold for every input.

use proptest::prelude::*;
use spandrel_engine::raster::{LinePlan, Phase};
use spandrel_engine::span::SpanImage;
use spandrel_engine::visible;
use spandrel_tests::scenes;

fn plan(per_row: u32) -> LinePlan {
    LinePlan::new(per_row, Phase::Centre).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Tiles and plain merging line by line find the same spans, bit for bit.
    #[test]
    fn both_ways_to_solve_visibility_agree(seed in 0u64..1 << 40, count in 1usize..60) {
        let view = scenes::front_view(61, 23);
        let scene = scenes::scene("a", scenes::random_faces(seed, count));
        let fast = visible::render(&[scene.clone().into()], &view, plan(3), 0..23).unwrap();
        let slow = visible::render_by_merging(&[scene.into()], &view, plan(3), 0..23).unwrap();
        prop_assert_eq!(fast.lines(), slow.lines());
    }

    /// Rendering clusters apart and merging them is rendering them together, bit for bit.
    #[test]
    fn clusters_merge_to_what_they_are_together(seed in 0u64..1 << 40, count in 1usize..30) {
        let view = scenes::front_view(53, 17);
        let clusters: Vec<_> = (0..4)
            .map(|i| scenes::scene(&format!("cluster {i}"), scenes::random_faces(seed + i, count)))
            .collect();
        let together: Vec<visible::Cluster> = clusters.iter().cloned().map(Into::into).collect();
        let together = visible::render(&together, &view, plan(2), 0..17).unwrap();
        let apart: Vec<SpanImage> = clusters
            .iter()
            .rev()
            .map(|scene| visible::render(&[scene.clone().into()], &view, plan(2), 0..17).unwrap())
            .collect();
        let merged = SpanImage::merge(&apart).unwrap();
        prop_assert!(merged == together);
    }
}
