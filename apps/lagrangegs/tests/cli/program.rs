//! Running the binary, and a run folder made by hand.

use std::path::{Path, PathBuf};
use std::process::Command;

use lagrangegs::lgs_core::GaussianCloud;
use lagrangegs::lgs_dynamics::Supports;
use lagrangegs::lgs_dynamics::testing::quadratic;
use lagrangegs::lgs_model::testing::particles;
use lagrangegs::lgs_model::{LagrangianScene, save_scene};
use lagrangegs::lgs_train::{Preset, TrainConfig};

/// Exit code and output of a call.
pub(crate) struct Done {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Runs the program.
pub(crate) fn lagrangegs<S: AsRef<std::ffi::OsStr>>(args: &[S]) -> Done {
    // Weights that a user has imported would only slow tests down.
    lagrangegs_with_weights(args, Path::new("no-weights"))
}

/// Runs the program with a folder of weights.
pub(crate) fn lagrangegs_with_weights<S: AsRef<std::ffi::OsStr>>(args: &[S], weights: &Path) -> Done {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lagrangegs"));
    let out = command
        .args(args)
        .env_remove("RUST_LOG")
        .env("LAGRANGEGS_WEIGHTS", weights)
        .output()
        .expect("the program starts");
    Done {
        code: out.status.code().expect("an exit code"),
        stdout: String::from_utf8(out.stdout).expect("stdout is text"),
        stderr: String::from_utf8(out.stderr).expect("stderr is text"),
    }
}

/// Runs the program with a command line split at spaces; `{name}` stands for a path.
pub(crate) fn call(line: &str, paths: &[(&str, &Path)]) -> Done {
    let words: Vec<String> = line
        .split_whitespace()
        .map(|word| {
            paths.iter().fold(word.to_owned(), |w, (name, path)| {
                w.replace(&format!("{{{name}}}"), &path.display().to_string())
            })
        })
        .collect();
    lagrangegs(&words)
}

impl Done {
    /// Asserts that the call did what it should and returns its stdout.
    #[track_caller]
    pub(crate) fn ok(self) -> String {
        assert_eq!(self.code, 0, "stderr: {}", self.stderr);
        self.stdout
    }

    /// Asserts that the call did what it should and returns the one JSON document of its stdout.
    #[track_caller]
    pub(crate) fn json(self) -> serde_json::Value {
        serde_json::from_str(&self.ok()).expect("one JSON document")
    }

    /// Asserts that the call failed with exit code 1, said so in one line that ends with `path` and holds all
    /// of `words`.
    #[track_caller]
    pub(crate) fn fails(&self, path: &Path, words: &[&str]) {
        assert_eq!(self.code, 1, "stderr: {}", self.stderr);
        let errors: Vec<&str> = self.stderr.lines().filter(|line| line.starts_with("error: ")).collect();
        let [error] = errors[..] else { panic!("expected one line of error in: {}", self.stderr) };
        assert!(error.ends_with(&path.display().to_string()), "should end with {}: {error}", path.display());
        for word in words {
            assert!(error.contains(word), "should contain {word}: {error}");
        }
        assert_eq!(self.stdout, "", "an error leaves stdout empty");
    }

    /// Asserts bad usage: exit code 2, a message on stderr that holds all of `words`.
    #[track_caller]
    pub(crate) fn is_bad_usage(&self, words: &[&str]) {
        assert_eq!(self.code, 2, "stderr: {}", self.stderr);
        for word in words {
            assert!(self.stderr.contains(word), "should contain {word}: {}", self.stderr);
        }
        assert_eq!(self.stdout, "");
    }
}

/// Starts the program and sends it Ctrl-C once the run of a folder has taken its first steps; returns its
/// exit code: 0 on a machine so fast that the work was over before the signal.
#[cfg(unix)]
pub(crate) fn interrupted(words: &[&str], run: &Path) -> Option<i32> {
    use std::process::Stdio;
    use std::time::{Duration, Instant};
    let mut command = Command::new(env!("CARGO_BIN_EXE_lagrangegs"));
    let command = command.args(words).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().expect("the program starts");
    let (begun, events) = (Instant::now(), run.join("events.jsonl"));
    let is_training = || std::fs::metadata(&events).is_ok_and(|file| file.len() > 0);
    while begun.elapsed() < Duration::from_secs(60) && !is_training() {
        std::thread::sleep(Duration::from_millis(5));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    child.wait().expect("the program ends").code()
}

/// The JSON document in a file.
pub(crate) fn json_file(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).expect("a file")).expect("JSON")
}

/// Changes the contents of a JSON file.
pub(crate) fn edit_json(path: &Path, edit: impl FnOnce(&mut serde_json::Value)) {
    let mut json = json_file(path);
    edit(&mut json);
    std::fs::write(path, json.to_string()).expect("written");
}

/// A temporary folder.
pub(crate) fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// A path that nothing can be written to, also by root: below a regular file.
pub(crate) fn unwritable(folder: &Path) -> PathBuf {
    let file = folder.join("file");
    std::fs::write(&file, "not a folder").expect("a file");
    file.join("out")
}

/// A small synthetic dataset.
pub(crate) fn tiny_dataset(folder: &Path) -> PathBuf {
    let data = folder.join("data");
    call("synth falling-ball --out {data} --size 24 --views 3 --train-fps 6", &[("data", &data)]).ok();
    data
}

/// A run folder with a block of Gaussians in free fall, without any training.
pub(crate) fn falling_run(folder: &Path, dataset: &Path) -> PathBuf {
    let run = folder.join("run");
    std::fs::create_dir(&run).expect("run folder");
    let config = TrainConfig::preset(Preset::Quick).to_toml().expect("toml");
    std::fs::write(
        run.join("config.toml"),
        format!("{config}\n[dataset]\npath = '{}'\nfingerprint = '0'\n", dataset.display()),
    )
    .expect("config");
    save_scene(&falling_scene(), &run.join("lagrangian.safetensors")).expect("scene");
    run
}

/// A folder that holds a small dataset and a run of it, with the paths of both.
pub(crate) fn falling() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let dir = folder();
    let data = tiny_dataset(dir.path());
    let run = falling_run(dir.path(), &data);
    (dir, data, run)
}

/// A folder that holds a run alone, with its path.
pub(crate) fn falling_alone() -> (tempfile::TempDir, PathBuf) {
    let dir = folder();
    let run = falling_run(dir.path(), dir.path());
    (dir, run)
}

fn falling_scene() -> LagrangianScene {
    let system = quadratic([0.0, 0.0, 2.0], [0.0; 6]);
    let means: Vec<[f32; 3]> = (0..64).map(|i| [i % 4, i / 4 % 4, i / 16].map(|c| 0.1 * c as f32)).collect();
    let (supports, velocities) = (Some(Supports::nearest(&means, 8)), vec![[0.0; 3]; means.len()]);
    let dynamic_gaussians = GaussianCloud::isotropic(means, 0.05, [0.9, 0.3, 0.1], 0.9);
    LagrangianScene {
        static_gaussians: GaussianCloud::isotropic(vec![[0.0, 0.0, -1.0]; 3], 0.1, [0.2, 0.5, 0.2], 0.9),
        ..particles(dynamic_gaussians, velocities, system, supports)
    }
}

/// Names of the files in a folder, sorted.
pub(crate) fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
