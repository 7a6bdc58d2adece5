//! The `spandrel` program.

fn main() -> std::process::ExitCode {
    spandrel::run(spandrel::library())
}
