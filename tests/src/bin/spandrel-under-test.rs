//! The command line as a program, so that tests can run it.

fn main() -> std::process::ExitCode {
    spandrel::run(spandrel::library())
}
