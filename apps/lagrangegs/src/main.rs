//! The `lagrangegs` program.

fn main() -> std::process::ExitCode {
    lagrangegs::cli::main()
}
