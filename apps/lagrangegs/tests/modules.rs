//! Modules of a crate import each other in one direction: at every level of folders, no file or folder is
//! reached from itself.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};

type Module = Vec<String>;

/// Paths that a module names, each with whether it is re-exported.
#[derive(Default)]
struct Named {
    paths: Vec<(Vec<String>, bool)>,
}

impl Named {
    fn tree(&mut self, before: &[String], tree: &syn::UseTree, exported: bool) {
        let with = |ident: &syn::Ident| [before, &[ident.to_string()]].concat();
        match tree {
            syn::UseTree::Path(path) => self.tree(&with(&path.ident), &path.tree, exported),
            syn::UseTree::Name(name) if name.ident == "self" => self.paths.push((before.to_vec(), exported)),
            syn::UseTree::Name(name) => self.paths.push((with(&name.ident), exported)),
            syn::UseTree::Rename(rename) => self.paths.push((with(&rename.ident), exported)),
            syn::UseTree::Glob(_) => self.paths.push((before.to_vec(), false)),
            syn::UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.tree(before, tree, exported));
            }
        }
    }
}

impl<'ast> Visit<'ast> for Named {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !item.attrs.iter().any(|attribute| attribute.path().is_ident("cfg")) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.tree(&[], &item.tree, !matches!(item.vis, syn::Visibility::Inherited));
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if names.len() > 1 {
            self.paths.push((names, false));
        }
        visit::visit_path(self, path);
    }
}

/// The modules of a crate that are no tests, with what they name.
fn modules(source: &Path) -> BTreeMap<Module, Named> {
    let mut files = Vec::new();
    rust_files(source, &mut files);
    let mut found = BTreeMap::new();
    for file in files {
        let path = file.strip_prefix(source).expect("a file of the crate").with_extension("");
        let mut module: Module = path.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        module.pop_if(|last| ["mod", "lib", "main"].contains(&last.as_str()));
        if module.iter().any(|part| part.ends_with("tests") || part == "testing") {
            continue;
        }
        let text = fs::read_to_string(&file).expect("a source");
        let mut named = Named::default();
        named.visit_file(&syn::parse_file(&text).expect("Rust"));
        found.entry(module).or_insert_with(Named::default).paths.extend(named.paths);
    }
    found
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The module that a path leads to from another one, and the name that is taken from it.
fn target(all: &BTreeMap<Module, Named>, from: &Module, path: &[String]) -> Option<(Module, Option<String>)> {
    let supers = path.iter().take_while(|part| *part == "super").count();
    let full: Module = match path[0].as_str() {
        "crate" => path[1..].to_vec(),
        "self" => [from.as_slice(), &path[1..]].concat(),
        "super" => [&from[..from.len().checked_sub(supers)?], &path[supers..]].concat(),
        _ if all.contains_key(&[from.as_slice(), &path[..1]].concat()) => [from.as_slice(), path].concat(),
        _ => return None,
    };
    let length = (0..=full.len()).rev().find(|&length| all.contains_key(&full[..length]))?;
    Some((full[..length].to_vec(), full.get(length).cloned()))
}

/// Imports between modules; names that a module re-exports come from where they are defined.
fn imports(all: &BTreeMap<Module, Named>) -> BTreeSet<(Module, Module)> {
    let mut exports = BTreeMap::new();
    for (module, named) in all {
        for (path, _) in named.paths.iter().filter(|(_, exported)| *exported) {
            if let Some((origin, Some(name))) = target(all, module, path) {
                exports.insert((module.clone(), name), origin);
            }
        }
    }
    let mut found = BTreeSet::new();
    for (module, named) in all {
        for (path, _) in named.paths.iter().filter(|(_, exported)| !exported) {
            let Some((mut origin, name)) = target(all, module, path) else { continue };
            while let Some(further) = name.clone().and_then(|name| exports.get(&(origin.clone(), name))) {
                origin.clone_from(further);
            }
            found.insert((module.clone(), origin));
        }
    }
    found
}

/// Files and folders of one folder that import each other in a circle.
fn circles(folder: &[String], imports: &BTreeSet<(Module, Module)>) -> Vec<String> {
    let room = |module: &Module| module.strip_prefix(folder)?.first().cloned();
    let mut reached: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (from, to) in imports {
        if let (Some(from), Some(to)) = (room(from), room(to))
            && from != to
        {
            reached.entry(from).or_default().insert(to);
        }
    }
    loop {
        let further = |rooms: &BTreeSet<String>| -> BTreeSet<String> {
            rooms.iter().filter_map(|room| reached.get(room)).flatten().cloned().collect()
        };
        let next: BTreeMap<_, _> =
            reached.iter().map(|(room, rooms)| (room.clone(), rooms | &further(rooms))).collect();
        if next == reached {
            break;
        }
        reached = next;
    }
    reached.into_iter().filter(|(room, rooms)| rooms.contains(room)).map(|(room, _)| room).collect()
}

#[test]
fn no_module_imports_itself_through_others() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let crates = ["crates", "apps"].map(|folder| fs::read_dir(root.join(folder)).expect("a folder"));
    let mut offenders = Vec::new();
    for member in crates.into_iter().flatten() {
        let source = member.expect("an entry").path().join("src");
        let all = modules(&source);
        let imports = imports(&all);
        let folders: BTreeSet<&[String]> =
            all.keys().flat_map(|module| (0..module.len()).map(|length| &module[..length])).collect();
        for folder in folders {
            let found = circles(folder, &imports);
            if !found.is_empty() {
                let place = source.join(folder.join("/"));
                offenders.push(format!("{}: {}", place.display(), found.join(", ")));
            }
        }
    }
    assert!(offenders.is_empty(), "circles of imports\n{}", offenders.join("\n"));
}
