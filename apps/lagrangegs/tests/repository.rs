//! Rules of the repository that no compiler checks: sizes of the sources, and documents that name what
//! exists.

use std::fs;
use std::path::{Path, PathBuf};

const WIDEST_LINE: usize = 110;
const LONGEST_FILE: usize = 300;
const LONGEST_FUNCTION: usize = 40;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// All Rust sources with their lines.
fn sources() -> Vec<(PathBuf, Vec<String>)> {
    let mut paths = Vec::new();
    ["crates", "apps"].iter().for_each(|folder| rust_files(&root().join(folder), &mut paths));
    assert!(paths.len() > 300, "{} sources", paths.len());
    let lines =
        |path: &PathBuf| fs::read_to_string(path).expect("a source").lines().map(str::to_owned).collect();
    paths.iter().map(|path| (path.clone(), lines(path))).collect()
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn lines_files_and_functions_are_short() {
    let mut offenders = Vec::new();
    for (path, lines) in sources() {
        let name = path.display();
        if lines.len() > LONGEST_FILE {
            offenders.push(format!("{name}: {} lines", lines.len()));
        }
        for (number, line) in (1..).zip(&lines).filter(|(_, line)| line.chars().count() > WIDEST_LINE) {
            offenders.push(format!("{name}:{number}: {} columns", line.chars().count()));
        }
        offenders.extend(long_functions(&lines).iter().map(|found| format!("{name}:{found}")));
    }
    assert!(offenders.is_empty(), "{}", offenders.join("\n"));
}

/// First lines and lengths of the functions that are too long, as the formatter lays them out.
fn long_functions(lines: &[String]) -> Vec<String> {
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate().filter(|(_, line)| starts_function(line)) {
        let indent = &line[..line.len() - line.trim_start().len()];
        let opening = lines[at..].iter().position(|line| line.ends_with(['{', ';', '}']));
        let Some(opening) = opening.filter(|&opening| lines[at + opening].ends_with('{')) else { continue };
        let closing = format!("{indent}}}");
        let Some(length) = lines[at + opening..].iter().position(|line| *line == closing) else { continue };
        if opening + length + 1 > LONGEST_FUNCTION {
            found.push(format!("{}: a function of {} lines", at + 1, opening + length + 1));
        }
    }
    found
}

fn starts_function(line: &str) -> bool {
    let mut words = line.trim_start().split(' ');
    let is_qualifier = |word: &str| word.starts_with("pub") || ["const", "unsafe", "async"].contains(&word);
    words.find(|word| !is_qualifier(word)).is_some_and(|word| word == "fn")
}

/// `docs/method.md` names items as `crate_name::path::Item`.
#[test]
fn the_method_names_items_that_exist() {
    let text = fs::read_to_string(root().join("docs/method.md")).expect("docs/method.md");
    let named: Vec<&str> =
        text.split('`').skip(1).step_by(2).filter(|code| code.starts_with("lgs_")).collect();
    assert!(named.len() > 20, "{} items", named.len());
    let sources = sources();
    let missing: Vec<&&str> = named.iter().filter(|path| !exists(path, &sources)).collect();
    assert!(missing.is_empty(), "docs/method.md names what does not exist: {missing:?}");
}

fn exists(path: &str, sources: &[(PathBuf, Vec<String>)]) -> bool {
    let mut parts = path.split("::");
    let folder = format!("crates/{}/src", parts.next().unwrap_or_default().replace('_', "-"));
    let Some(item) = parts.last() else { return root().join(folder).exists() };
    let keywords = ["fn", "struct", "enum", "trait", "mod", "const", "type"];
    let defined = keywords.map(|keyword| format!("{keyword} {item}"));
    let ends = |rest: &str| !rest.starts_with(|next: char| next.is_alphanumeric() || next == '_');
    let defines = |line: &String| {
        defined.iter().any(|form| line.find(form).is_some_and(|at| ends(&line[at + form.len()..])))
    };
    let in_crate = sources.iter().filter(|(path, _)| path.to_string_lossy().contains(&folder));
    in_crate.into_iter().any(|(_, lines)| lines.iter().any(defines))
}
