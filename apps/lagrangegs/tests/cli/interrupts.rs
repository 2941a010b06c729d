//! Ctrl-C and its like leave nothing half-written, and what was finished is kept.
#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::{call, falling_alone, files, folder, tiny_dataset};

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

/// Whether some frame of a folder is finished, and not all.
fn has_finished_some(out: &Path) -> bool {
    let names = if out.is_dir() { litter(out) } else { Vec::new() };
    let is_finished = |entry: std::fs::DirEntry| !entry.file_name().to_string_lossy().starts_with('.');
    let entries = |name: &String| std::fs::read_dir(out.join(name)).into_iter().flatten().flatten();
    names.iter().flat_map(entries).any(is_finished)
}

/// Starts a program, sends it a signal as soon as that is due, and returns its exit code and what it said.
fn signalled(command: &mut Command, signal: &str, is_due: impl Fn() -> bool) -> (Option<i32>, String) {
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let begun = Instant::now();
    while !is_due() && begun.elapsed() < Duration::from_secs(60) {
        if child.try_wait().expect("a state").is_some() {
            break;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(20));
    Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
    let done = child.wait_with_output().expect("the program ends");
    (done.status.code(), String::from_utf8_lossy(&done.stderr).into_owned())
}

/// The signal of Ctrl-C with the exit code that it leads to; another one where the tests themselves were
/// started to ignore it, as in the background of a script.
fn ctrl_c() -> (&'static str, i32) {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or_default();
    if ignored & 0b10 == 0 { ("-INT", 130) } else { ("-TERM", 143) }
}

fn program(line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lagrangegs"));
    command.args(line.split_whitespace());
    command
}

#[test]
fn nothing_unfinished_is_left() {
    let dir = folder();
    let work = dir.path().join("work");
    std::fs::create_dir(&work).expect("a folder");
    let data = tiny_dataset(dir.path());
    let (signal, expected) = ctrl_c();
    let (data, set, copy) = (data.display(), work.join("set"), work.join("copy"));
    for line in [
        format!("synth fan --size 400 --out {}", set.display()),
        format!("import {data} {} --size 1500", copy.display()),
    ] {
        let (code, said) = signalled(&mut program(&line), signal, || !litter(&work).is_empty());
        assert_eq!(code, Some(expected), "{line}: {said}");
        assert!(
            said.lines().any(|line| line == "interrupted; nothing half-written is left"),
            "{line}: {said}"
        );
        assert_eq!(files(&work), Vec::<String>::new(), "{line}");
    }
}

#[test]
fn frames_that_were_finished_are_kept_apart_from_older_ones() {
    let (dir, run) = falling_alone();
    let [out, splats] = ["out", "splats"].map(|name| dir.path().join(name));
    call("render {run} --times 0,1 --size 16 --out {out}", &[("run", &run), ("out", &out)]).ok();
    let before: Vec<_> =
        files(&out).iter().map(|name| std::fs::read(out.join(name)).expect("a file")).collect();
    let run = run.display();
    for (line, place, (signal, expected)) in [
        (format!("render {run} --times 0:2:0.0002 --out {}", out.display()), &out, ctrl_c()),
        (format!("export {run} --times 0:2:0.0002 --out {}", splats.display()), &splats, ("-TERM", 143)),
    ] {
        let (code, said) = signalled(&mut program(&line), signal, || has_finished_some(place));
        assert_eq!(code, Some(expected), "{line}: {said}");
        let kept = place.join("unfinished");
        let names = files(&kept);
        let count = if names.len() == 1 {
            "1 finished file is".into()
        } else {
            format!("{} finished files are", names.len())
        };
        let ending = format!("interrupted; {count} kept in {}", kept.display());
        assert!(!names.is_empty() && said.lines().any(|line| line == ending), "{line}: {said}");
        assert_eq!(litter(place), Vec::<String>::new(), "{line}");
        for name in names.iter().filter(|name| name.ends_with(".png")) {
            image::open(kept.join(name)).expect("all of an image");
        }
    }
    assert_eq!(files(&splats), ["unfinished"]);
    let names = files(&out);
    assert_eq!(names.len(), before.len() + 1);
    let after: Vec<_> = names.iter().filter_map(|name| std::fs::read(out.join(name)).ok()).collect();
    assert!(after == before, "frames of the earlier call stay");
}

#[test]
fn frames_that_cannot_arrive_are_kept_and_the_error_says_where() {
    let (dir, run) = falling_alone();
    let out = dir.path().join("out");
    let taken = out.join("sheet.png");
    std::fs::create_dir_all(&taken).expect("a folder");
    let kept = format!("4 finished files are kept in {}", out.join("unfinished").display());
    call("render {run} --times 0,1 --size 16 --out {out}", &[("run", &run), ("out", &out)])
        .fails(&taken, &[&kept, "there is a folder of that name"]);
    assert_eq!(files(&out), ["sheet.png", "unfinished"]);
}

#[test]
fn a_hang_up_that_is_ignored_ends_nothing() {
    let (dir, run) = falling_alone();
    let out = dir.path().join("out");
    let mut command = Command::new("nohup");
    let line = format!("render {} --times 0:2:0.02 --size 64 --out {}", run.display(), out.display());
    command.arg(env!("CARGO_BIN_EXE_lagrangegs")).args(line.split_whitespace()).stdin(Stdio::null());
    let (code, said) = signalled(&mut command, "-HUP", || has_finished_some(&out));
    assert_eq!(code, Some(0), "{said}");
    assert!(out.join("frames.json").exists() && !out.join("unfinished").exists());
}
