//! Ctrl-C leaves nothing half-written.
#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::{call, falling_run, files, folder, tiny_dataset};

/// Names of temporary files and folders below a folder.
fn litter(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for name in files(folder) {
        let path = folder.join(&name);
        if name.starts_with(".partial-") {
            found.push(name);
        } else if path.is_dir() {
            found.extend(litter(&path));
        }
    }
    found
}

/// Starts the program, sends it Ctrl-C once something is half-written below a folder, and returns its exit
/// code and what it said.
fn interrupted(line: &str, folder: &Path) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lagrangegs"));
    let command = command.args(line.split_whitespace()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the program starts");
    let begun = Instant::now();
    while litter(folder).is_empty() && begun.elapsed() < Duration::from_secs(60) {
        if child.try_wait().expect("a state").is_some() {
            break;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(20));
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    let done = child.wait_with_output().expect("the program ends");
    (done.status.code(), String::from_utf8_lossy(&done.stderr).into_owned())
}

#[test]
fn nothing_unfinished_is_left() {
    let dir = folder();
    let work = dir.path().join("work");
    std::fs::create_dir(&work).expect("a folder");
    let (data, run) = (tiny_dataset(dir.path()), falling_run(dir.path(), dir.path()));
    let [out, splats, set, copy] = ["out", "splats", "set", "copy"].map(|name| work.join(name));
    call("render {run} --times 0,1 --size 16 --out {out}", &[("run", &run), ("out", &out)]).ok();
    let before = files(&out);
    let (run, data) = (run.display(), data.display());
    for (line, place) in [
        (format!("render {run} --times 0:2:0.0002 --out {}", out.display()), &out),
        (format!("export {run} --times 0:2:0.0002 --out {}", splats.display()), &splats),
        (format!("synth fan --size 400 --out {}", set.display()), &set),
        (format!("import {data} {} --size 1500", copy.display()), &copy),
    ] {
        let (code, said) = interrupted(&line, &work);
        assert_eq!(code, Some(130), "{line}: {said}");
        assert!(said.lines().any(|line| line.starts_with("interrupted")), "{line}: {said}");
        assert_eq!(litter(&work), Vec::<String>::new(), "{line}");
        let left = if place.is_dir() { files(place) } else { Vec::new() };
        assert!(left.is_empty() || left == before, "{line}: {left:?}");
    }
    assert_eq!(files(&out), before, "frames of the earlier call stay");
}
