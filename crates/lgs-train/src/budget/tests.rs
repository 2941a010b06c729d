//! Tests of time budgets.

use super::*;

/// Seconds and steps that a schedule of 1000 steps takes with a budget of 300 seconds.
fn used_and_taken(secs_of_step: impl Fn(f64) -> f64) -> (f64, usize) {
    let mut clock = Clock::new(1000);
    let (stage, deadline) = (Stage::Source, 300.0);
    let mut current = Current { stage, begun: 0.0, deadline, since: 0.0, steps: 0, step_secs: None };
    let mut used = 0.0;
    while clock.left() > 0.0 {
        if let Some(pace) = current.due(&clock, used) {
            clock.set_pace(pace);
        }
        clock.advance();
        used += secs_of_step(clock.progress());
    }
    (used, clock.taken())
}

#[test]
fn a_schedule_ends_at_its_deadline_whatever_steps_take() {
    for secs_of_step in [|_: f64| 0.4, |progress: f64| 0.02 + progress, |progress: f64| 1.2 - progress * 0.8]
    {
        let (used, _) = used_and_taken(secs_of_step);
        assert!((used - 300.0).abs() < 6.0, "{used}");
    }
}

#[test]
fn a_schedule_is_not_stretched_beyond_its_own_steps() {
    let (used, taken) = used_and_taken(|_| 0.2);
    assert!((used - 200.0).abs() < 1e-6 && taken == 1000, "{used} {taken}");
}

#[test]
fn time_for_the_choices_of_laws_is_kept_and_what_was_decided_holds() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("schedule.json");
    let with_fit = |secs, fit_secs| {
        let mut budget = Budget::open(secs, &path).expect("open");
        budget.schedule.fit_secs = fit_secs;
        budget
    };
    let deadline = |stage, fit_secs| {
        let mut budget = with_fit(1000.0, fit_secs);
        budget.begin(stage, LastStage::TuneGaussians);
        budget.current.expect("a stage").deadline
    };
    let of_last = |fit_secs| deadline(Stage::TuneGaussians, fit_secs);
    let kept = of_last(0.0) - of_last(400.0);
    assert!((kept - 400.0 * LAST_STAGE_SHARE).abs() < 1.0, "{kept}");
    assert!((of_last(2000.0) - 50.0).abs() < 1.0, "stage 3 runs, however late");
    assert!(deadline(Stage::RetuneGaussians, 2000.0) < 1.0);
    let seeks = |secs| {
        let mut budget = with_fit(secs, 0.0);
        budget.schedule.distill_secs = 400.0;
        budget.has_time_for(Stage::FitDynamics).expect("record")
    };
    assert!(!seeks(800.0) && !seeks(1e6), "twice as long as laws were sought in the tracks");
    let tunes = |secs| with_fit(secs, 400.0).has_time_for(Stage::TuneGaussians).expect("record");
    assert!(!tunes(405.0) && !tunes(1e6), "a few steps are worse than none");
    let has_time = |secs| with_fit(secs, 400.0).has_time_for(Stage::RetuneGaussians).expect("record");
    assert!(!has_time(300.0) && !has_time(1e6), "decided once");
    std::fs::remove_file(&path).expect("remove");
    assert!(has_time(1e6) && has_time(300.0), "decided once");
}

#[test]
fn stage_1_goes_into_another_round_where_that_leaves_time_for_what_follows() {
    let folder = tempfile::tempdir().expect("folder");
    let mut budget = Budget::open(1000.0, &folder.path().join("schedule.json")).expect("open");
    budget.begin(Stage::Distill, LastStage::TuneGaussians);
    assert!(budget.has_time_for_round(2));
    budget.used_before = 100.0;
    assert!(!budget.has_time_for_round(3), "150 seconds of 1000");
    assert!(budget.has_time_for_round(2), "decided once");
    budget.used_before = 1000.0;
    budget.begin(Stage::Distill, LastStage::TuneGaussians);
    assert!(!budget.has_time_for_round(4), "nothing is left");
}

#[test]
fn a_choice_of_laws_goes_on_where_that_leaves_time_for_the_last_one() {
    let folder = tempfile::tempdir().expect("folder");
    let mut budget = Budget::open(1000.0, &folder.path().join("schedule.json")).expect("open");
    budget.begin(Stage::FitDynamics, LastStage::TuneGaussians);
    assert!(budget.has_time_for_search("parts"));
    budget.used_before = 330.0;
    assert!(!budget.has_time_for_search("couples"), "330 seconds twice and 50 of 670");
    assert!(budget.has_time_for_search("parts"), "decided once");
}

#[test]
fn a_recorded_schedule_is_followed_to_its_last_digit_and_damage_is_named() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("schedule.json");
    let pace = |stage: Stage, step, pace| Pace { stage: stage.name().to_owned(), step, pace };
    let paces = vec![pace(Stage::Source, 3, 1.0 / 3.0), pace(Stage::TuneGaussians, 0, 0.1 + 0.2)];
    let mut budget = Budget::open(1e9, &path).expect("none yet");
    budget.schedule.paces = paces.clone();
    budget.save().expect("save");
    assert_eq!(read_schedule(&path).expect("read").paces, paces);
    let mut resumed = Budget::open(1e9, &path).expect("open");
    let mut clock = Clock::new(100);
    resumed.begin(Stage::Source, LastStage::TuneGaussians);
    for expected in [1.0, 1.0, 1.0, 1.0 / 3.0, 1.0 / 3.0] {
        resumed.pace(&mut clock);
        assert_eq!(clock.pace(), expected, "{}", clock.taken());
        clock.advance();
    }
    let mut clock = Clock::new(10);
    resumed.begin(Stage::TuneGaussians, LastStage::TuneGaussians);
    resumed.pace(&mut clock);
    assert_eq!(clock.pace(), 0.1 + 0.2);
    std::fs::write(
        &path,
        "{\"used_secs\": 1.0, \"paces\": [{\"stage\": \"source\", \"step\": 1, \"pace\": 0}]}",
    )
    .expect("write");
    let text = Budget::open(1.0, &path).err().expect("damage").to_string();
    assert!(text.contains("positive") && text.ends_with("schedule.json"), "{text}");
}
