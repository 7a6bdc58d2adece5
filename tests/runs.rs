//! Runs let go: of values that nobody uses any more, of more than the limit, and of work that is to stop.

use spandrel_engine::Error;
use spandrel_engine::cache::Cache;
use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::evaluate::{Outcome, Progress};
use spandrel_engine::graph::{Graph, Plan, Run};
use spandrel_engine::image::Image;
use spandrel_engine::resolve::Channel;
use spandrel_engine::values::{Override, Picture};
use spandrel_engine::watch::Watch;
use spandrel_tests::program::Scratch;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

/// A scene of many faces, and a graph of pictures of it.
fn graph(name: &str, nodes: &str) -> (Scratch, Graph) {
    let scratch = Scratch::new(name);
    let scene = "Scene(plans: [(name: \"p\", root: (shape: Terrain(size: (9, 9), height: 2, levels: 6, seed: 1)))])";
    std::fs::write(scratch.path().join("land.ron"), scene).unwrap();
    let document = Document::parse(&format!("Graph(nodes: {{{nodes}}})")).unwrap();
    let graph = Graph::check(&document, &spandrel::library(), scratch.path());
    (scratch, graph.unwrap_or_else(|faults| panic!("{faults:?}")))
}

fn plan(graph: &Graph, node: &str) -> Plan {
    let channels = BTreeSet::from([Channel::Color]);
    let mut wishes = Wishes::new();
    wishes.want::<Image>(node, Picture { channels, changed: Override::default() });
    Plan::new(graph, &wishes).unwrap()
}

/// Pictures from many sides, laid over each other one by one.
fn many(count: usize) -> String {
    let mut nodes =
        String::from("\"land\": ReadScene(file: \"land.ron\"), \"sun\": ParallelLight(), ");
    for i in 0..count {
        nodes += &format!(
            "\"eye{i}\": Camera(position: ({i}, 4, 12)), \"seen{i}\": Scanline(scene: \"land\", camera: \"eye{i}\"),
             \"lit{i}\": Illuminate(image: \"seen{i}\", lights: [\"sun\"], shadows: Off),
             \"picture{i}\": Resolve(image: \"lit{i}\", size: (160, 100), lines: Sloped(4)), "
        );
    }
    nodes += "\"all0\": Grade(image: \"picture0\", multiply: 0.5), ";
    for i in 1..count {
        nodes += &format!(
            "\"all{i}\": Over(front: \"picture{i}\", back: \"all{}\", operator: Plus), ",
            i - 1
        );
    }
    nodes
}

#[test]
fn values_of_three_times_the_limit_fit_into_it() {
    let (_scratch, graph) = graph("runs-limit", &many(12));
    let plan = plan(&graph, "all11");
    let plenty = Cache::new(usize::MAX);
    let run = Run::with_cache(&plenty);
    let whole = run.evaluate(&graph, &plan, &()).unwrap();
    let bytes: usize = whole.reports.iter().map(|report| report.bytes).sum();
    let limit = bytes / 3;
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let little = Cache::new(limit);
        let run = Run::with_cache(&little);
        let part = pool.install(|| run.evaluate(&graph, &plan, &())).unwrap();
        assert_eq!(part.value::<Image>(0), whole.value::<Image>(0));
        let report = little.report();
        assert!(report.most <= limit, "{threads} threads: {report:?} of {limit}, {bytes} in all");
        let evaluated = part.reports.iter().filter(|report| report.outcome == Outcome::Evaluated);
        assert_eq!(evaluated.count(), part.reports.len(), "each is computed once all the same");
        drop((part, run));
        assert_eq!((little.report().kept, little.report().used), (0, 0), "all is let go");
    }
    // What is kept is found again, as much as there is room for.
    let again = run.evaluate(&graph, &plan, &()).unwrap();
    assert!(again.reports.iter().all(|report| report.outcome == Outcome::Known));
}

/// Stops a run when a node begins, and remembers its watch.
struct Stops<'r> {
    run: &'r Run,
    node: &'r str,
    watch: Mutex<Option<Watch>>,
}

impl Progress for Stops<'_> {
    fn started(&self, node: &str, watch: &Watch) {
        if node == self.node {
            *self.watch.lock().unwrap() = Some(watch.clone());
            self.run.cancel();
        }
    }
}

#[test]
fn work_that_is_to_stop_stops_within() {
    let nodes = "\"land\": ReadScene(file: \"land.ron\"), \"eye\": Camera(position: (0, 4, 12)),
        \"seen\": Scanline(scene: \"land\", camera: \"eye\"), \"sky\": SkyLight(model: Overcast),
        \"lit\": Illuminate(image: \"seen\", lights: [\"sky\"], shadows: Rays(4096)),
        \"picture\": Resolve(image: \"lit\", size: (160, 100), lines: Sloped(4))";
    let (_scratch, graph) = graph("runs-stop", nodes);
    let plan = plan(&graph, "picture");
    for node in ["land", "seen", "lit", "picture"] {
        let cache = Cache::new(usize::MAX);
        let run = Run::with_cache(&cache);
        let stops = Stops { run: &run, node, watch: Mutex::default() };
        let Err(failure) = run.evaluate(&graph, &plan, &stops) else {
            panic!("{node}: it went on")
        };
        assert!(matches!(failure.error, Error::Cancelled), "{node}: {failure}");
        let watch = stops.watch.lock().unwrap().clone().unwrap();
        assert!(watch.is_stopped());
        drop(run);
        assert_eq!(cache.report().used, 0, "{node}");
    }
}

/// Remembers the greatest share of a node that was seen from beside.
#[test]
fn work_tells_how_far_it_is() {
    #[derive(Default)]
    struct Watches(Mutex<Vec<(String, Watch)>>);
    impl Progress for Watches {
        fn started(&self, node: &str, watch: &Watch) {
            self.0.lock().unwrap().push((node.to_owned(), watch.clone()));
        }
    }
    let (_scratch, graph) = graph("runs-share", &many(1));
    let plan = plan(&graph, "picture0");
    let watches = Watches::default();
    let run = Run::with_cache(&Arc::clone(&Cache::new(usize::MAX)));
    run.evaluate(&graph, &plan, &watches).unwrap();
    let shares: Vec<_> =
        watches.0.lock().unwrap().iter().map(|(n, w)| (n.clone(), w.share())).collect();
    for node in ["seen0", "picture0"] {
        let share = shares.iter().find(|(name, _)| name == node).and_then(|(_, share)| *share);
        assert_eq!(share, Some(1.0), "{node}: {shares:?}");
    }
}
