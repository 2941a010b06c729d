//! A run that is looked at while it is trained.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use lgs_view::{Exhibit, StepSheet};

use crate::common::{Running, request, subject};

fn step(step: usize) -> StepSheet {
    StepSheet { stage: "source", step, steps: 100, loss: 0.5, psnr: Some(20.0), gaussians: 30 }
}

fn is_soon(mut condition: impl FnMut() -> bool) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(20) {
        if condition() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    false
}

#[test]
fn snapshots_are_wanted_while_somebody_looks_and_pictures_show_the_newest() {
    let exhibit = Arc::new(Exhibit::of_training(subject()));
    let server = Running::of(Arc::clone(&exhibit), 2, None);
    assert!(!exhibit.wants(), "nobody looks");
    let mut page = server.page();
    assert_eq!(page.hello["training"], true);
    let (_, before) = page.picture(&request(1, 0.0));
    exhibit.report(step(0));
    exhibit.report(step(10));
    page.send(r#"{"kind":"training"}"#);
    let sheet = page.answer();
    assert_eq!((&sheet["kind"], &sheet["step"]["step"]), (&"training".into(), &10.into()));
    assert!(sheet["eta_secs"].as_f64().unwrap() >= 0.0 && sheet["share"].as_f64().unwrap() <= 1.0);
    assert_eq!(sheet["curve"].as_array().unwrap().len(), 2);
    assert!(exhibit.wants(), "a page looks");
    let mut newer = subject();
    newer.scene.background = [0.0; 3];
    exhibit.show(newer, Instant::now());
    assert!(!exhibit.wants(), "the last snapshot is new");
    assert!(page.picture(&request(2, 0.0)).1 != before, "pictures show the newest subject");
    page.send(r#"{"kind":"training"}"#);
    assert_eq!(page.answer()["subject"], 1);
    page.send(r#"{"kind":"hello"}"#);
    assert_eq!(page.answer()["background"][0], 0.0);
}

#[test]
fn a_page_pauses_training_which_goes_on_when_the_page_has_left() {
    let exhibit = Arc::new(Exhibit::of_training(subject()));
    let server = Running::of(Arc::clone(&exhibit), 2, None);
    let mut page = server.page();
    let stop = AtomicBool::new(false);
    exhibit.wait_while_paused(&stop);
    let paused = |page: &mut crate::common::Page| {
        page.send(r#"{"kind":"training"}"#);
        page.answer()["paused"] == true
    };
    page.send(r#"{"kind":"pause","paused":true}"#);
    assert!(paused(&mut page));
    std::thread::scope(|scope| {
        let waits = scope.spawn(|| exhibit.wait_while_paused(&stop));
        std::thread::sleep(Duration::from_millis(50));
        assert!(!waits.is_finished());
        drop(page);
        assert!(is_soon(|| waits.is_finished()), "training goes on");
    });
    let mut page = server.page();
    page.send(r#"{"kind":"pause","paused":true}"#);
    assert!(paused(&mut page));
    stop.store(true, Ordering::Relaxed);
    exhibit.wait_while_paused(&stop);
}
