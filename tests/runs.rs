//! Runs let go: of values that nobody uses any more, of more than the limit, and of work that is to stop.

use spandrel_engine::Error;
use spandrel_engine::cache::Cache;
use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::report::{NodeReport, Outcome, Progress};
use spandrel_engine::graph::value::Demand;
use spandrel_engine::graph::{Graph, Inputs, Link, Node, Run, Schedule, Upstream, Value};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::key::Key;
use spandrel_engine::values::{Override, PictureDemand};
use spandrel_engine::watch::Watch;
use spandrel_tests::program::Scratch;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A scene of many faces, and a graph of pictures of it.
fn graph(name: &str, nodes: &str) -> (Scratch, Graph) {
    let scratch = Scratch::new(name);
    let scene = "Scene(plans: [(name: \"p\", root: (shape: Terrain(size: (9, 9), height: 2, levels: 6, seed: 1)))])";
    std::fs::write(scratch.path().join("land.ron"), scene).unwrap();
    let document = Document::parse(&format!("Graph(nodes: {{{nodes}}})")).unwrap();
    let graph = Graph::check(&document, &spandrel::library(), scratch.path());
    (scratch, graph.unwrap_or_else(|faults| panic!("{faults:?}")))
}

fn plan(graph: &Graph, node: &str) -> Schedule {
    let channels = BTreeSet::from([Channel::Color]);
    let mut wishes = Wishes::new();
    wishes.want::<Image>(node, PictureDemand { channels, changed: Override::default() });
    Schedule::new(graph, &wishes).unwrap()
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

/// Numbers that serve only who asks for them.
struct Number(u32);

#[derive(Clone, Debug, PartialEq, serde::Serialize)]
struct Which(u32);

impl Demand for Which {
    fn cover(&mut self, other: &Which) -> bool {
        self == other
    }
}

impl Value for Number {
    type Demand = Which;
    const NAME: &'static str = "Number";

    fn bytes(&self) -> usize {
        4
    }
}

/// Gives the number that is asked for.
#[derive(Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default)]
struct Counter {}

impl Node for Counter {
    type Output = Number;
    const KIND: &'static str = "Counter";
    const GROUP: &'static str = "test";

    fn demand(&self, _: &Which, _: &mut Upstream<'_>) -> Result<(), Error> {
        Ok(())
    }

    fn evaluate(&self, wanted: &Which, _: &Inputs<'_>) -> Result<Number, Error> {
        Ok(Number(wanted.0))
    }
}

/// Asks two links for numbers, one of them several times; writes them one after the other.
#[derive(Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default)]
struct Digits {
    first: Link<Number>,
    rest: Link<Number>,
}

impl Node for Digits {
    type Output = Number;
    const KIND: &'static str = "Digits";
    const GROUP: &'static str = "test";

    fn demand(&self, _: &Which, upstream: &mut Upstream<'_>) -> Result<(), Error> {
        upstream.ask(&self.first, Which(7));
        [3, 1, 3, 2].into_iter().for_each(|number| upstream.ask(&self.rest, Which(number)));
        Ok(())
    }

    fn evaluate(&self, _: &Which, inputs: &Inputs<'_>) -> Result<Number, Error> {
        let rest = inputs.each(&self.rest);
        Ok(Number(rest.fold(inputs.get(&self.first).0, |all, digit| 10 * all + digit.0)))
    }
}

#[test]
fn a_link_gives_what_it_was_asked_for_whoever_else_asks_the_same_node() {
    let mut registry = spandrel::library();
    registry.register::<Counter>().register::<Digits>();
    for other in ["a", "b"] {
        let text = format!(
            "Graph(nodes: {{\"a\": Counter(), \"b\": Counter(), \"it\": Digits(first: \"a\", rest: \"{other}\")}})"
        );
        let document = Document::parse(&text).unwrap();
        let graph = Graph::check(&document, &registry, Path::new("")).ok().unwrap();
        let mut wishes = Wishes::new();
        wishes.want::<Number>("it", Which(0));
        let plan = Schedule::new(&graph, &wishes).unwrap();
        let made = Run::new().evaluate(&graph, &plan, &()).unwrap();
        assert_eq!(made.value::<Number>(0).0, 73132, "{other}");
    }
}

/// Waits, and gives a number that is known by its contents.
#[derive(Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default)]
struct Waits {
    milliseconds: u64,
}

/// A number that is known by its contents.
struct Content;

impl Value for Content {
    type Demand = ();
    const NAME: &'static str = "Content";

    fn key(&self) -> Option<Key> {
        Some(Key::of("content"))
    }

    fn bytes(&self) -> usize {
        0
    }
}

impl Node for Waits {
    type Output = Content;
    const KIND: &'static str = "Waits";
    const GROUP: &'static str = "test";

    fn demand(&self, (): &(), _: &mut Upstream<'_>) -> Result<(), Error> {
        Ok(())
    }

    fn evaluate(&self, (): &(), _: &Inputs<'_>) -> Result<Content, Error> {
        std::thread::sleep(Duration::from_millis(self.milliseconds));
        Ok(Content)
    }
}

/// Takes a value.
#[derive(Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default)]
struct Takes {
    from: Link<Content>,
}

impl Node for Takes {
    type Output = Number;
    const KIND: &'static str = "Takes";
    const GROUP: &'static str = "test";

    fn demand(&self, _: &Which, upstream: &mut Upstream<'_>) -> Result<(), Error> {
        upstream.ask(&self.from, ());
        Ok(())
    }

    fn evaluate(&self, wanted: &Which, _: &Inputs<'_>) -> Result<Number, Error> {
        Ok(Number(wanted.0))
    }
}

/// Takes its time to tell that a node has ended.
struct Slow;

impl Progress for Slow {
    fn finished(&self, report: &NodeReport) {
        if report.node == "first" {
            std::thread::sleep(Duration::from_millis(300));
        }
    }
}

#[test]
fn an_equal_node_that_comes_while_the_first_ends_finds_its_value() {
    let mut registry = spandrel::library();
    registry.register::<Waits>().register::<Takes>();
    // The inputs are alike; the second is there while the end of "first" is being told.
    let text = "Graph(nodes: {\"soon\": Waits(), \"late\": Waits(milliseconds: 100),
        \"first\": Takes(from: \"soon\"), \"second\": Takes(from: \"late\")})";
    let document = Document::parse(text).unwrap();
    let graph = Graph::check(&document, &registry, Path::new("")).ok().unwrap();
    let mut wishes = Wishes::new();
    wishes.want::<Number>("first", Which(5)).want::<Number>("second", Which(5));
    let plan = Schedule::new(&graph, &wishes).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let made = pool.install(|| Run::new().evaluate(&graph, &plan, &Slow)).unwrap();
    assert_eq!([0, 1].map(|wish| made.value::<Number>(wish).0), [5, 5]);
    let evaluated = made.reports.iter().filter(|report| report.outcome == Outcome::Evaluated);
    assert_eq!(evaluated.count(), 3, "two that wait, and one that takes");
}
