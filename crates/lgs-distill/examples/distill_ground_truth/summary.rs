//! How often the results are right.

use super::edits::EditedForecasts;
use super::measure::Row;
use lgs_mechanics::bands::Verdict;

/// Error at t = 1 (`true`) or t = 2.25 that is asked of a scene, in parts of the path.
fn asked(scene: &str) -> (bool, f64) {
    match scene {
        "kepler" | "rolling-ball" => (false, 0.04),
        "double-pendulum" | "top" | "tumbling" | "bounce" => (true, 0.02),
        _ => (false, 0.02),
    }
}

/// The error that is asked about.
fn asked_error(row: &Row) -> f64 {
    row.errors[usize::from(!asked(&row.scene).0)]
}

fn is_good(row: &Row) -> bool {
    asked_error(row) <= asked(&row.scene).1
}

/// Whether each object has the verdict that the scene expects; where no law explains a motion, `described`
/// claims nothing and is right as well.
fn is_right(row: &Row) -> bool {
    row.verdicts.iter().all(|verdict| (*verdict == Verdict::Explained) == row.is_explained)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Prints medians and counts.
pub(super) fn print(rows: &[Row]) {
    let lawful: Vec<&Row> = rows.iter().filter(|row| row.is_explained).collect();
    let count = |holds: &dyn Fn(&Row) -> bool| lawful.iter().filter(|row| holds(row)).count();
    let all = lawful.len();
    let errors = |at: usize| 100.0 * median(lawful.iter().map(|row| row.errors[at]).collect());
    println!("\nof {all} runs with a law:");
    println!("  error, median            {:.3} % at t = 1, {:.3} % at t = 2.25", errors(0), errors(1));
    println!("  as good as is asked      {}", count(&is_good));
    println!("  explained and good       {}", count(&|row| is_right(row) && is_good(row)));
    println!("  explained and not good   {}", count(&|row| is_right(row) && !is_good(row)));
    println!("  good and not explained   {}", count(&|row| !is_right(row) && is_good(row)));
    println!("  wrongly trusted          {}", count(&|row| row.is_wrongly_trusted));
    let covered: Vec<f64> =
        lawful.iter().filter(|row| is_right(row)).filter_map(|row| row.coverage).collect();
    let mean = covered.iter().sum::<f64>() / covered.len().max(1) as f64;
    let within = covered.iter().filter(|share| (0.8..=0.98).contains(*share)).count();
    println!(
        "  in the 90 % band         {:.0} % of the explained, {within} of {} from 80 to 98 %",
        100.0 * mean,
        covered.len()
    );
    let constants: Vec<bool> = lawful
        .iter()
        .flat_map(|row| row.constants.iter().map(super::constants::Constant::is_recovered))
        .collect();
    let recovered = constants.iter().filter(|recovered| **recovered).count();
    println!("  constants recovered      {recovered} of {}", constants.len());
    let impacts: Vec<bool> =
        lawful.iter().filter_map(|row| row.impacts.as_ref().map(|impacts| impacts.are_right())).collect();
    let right = impacts.iter().filter(|right| **right).count();
    println!("  impacts right            {right} of {}", impacts.len());
    print_edits(rows, &lawful);
    let right = rows.iter().filter(|row| is_right(row)).count();
    println!("verdicts right             {right} of {}", rows.len());
    let explained = |row: &&Row| !row.is_explained && row.verdicts.contains(&Verdict::Explained);
    println!("no law, yet explained      {}", rows.iter().filter(explained).count());
}

/// Prints how good edited forecasts are, and whether they are trusted where they are.
fn print_edits(rows: &[Row], lawful: &[&Row]) {
    let edited: Vec<&EditedForecasts> = lawful.iter().filter_map(|row| row.edited.as_ref()).collect();
    let near = edited.iter().filter(|edited| edited.worst <= 0.04).count();
    println!("  edits within 4 %         {near} of {}", edited.len());
    let trusted: Vec<bool> = edited.iter().flat_map(|edited| edited.trusted.clone()).collect();
    let to_one = trusted.iter().filter(|trusted| **trusted).count();
    println!("  edits trusted to t = 1   {to_one} of {}", trusted.len());
    let wrong: usize = rows.iter().filter_map(|row| Some(row.edited.as_ref()?.wrong.len())).sum();
    println!("edits wrongly trusted      {wrong}");
}
