//! A studio's own command line: Spandrel with the studio's kinds of node.

fn main() -> std::process::ExitCode {
    let mut registry = spandrel::library();
    spandrel_plugin_example::register(&mut registry);
    spandrel::run(registry)
}
